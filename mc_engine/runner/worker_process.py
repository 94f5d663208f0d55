"""Inside a worker process: the campaign of its run, the limits it keeps, and its end with the process that began it."""

import os
import re
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from mc_engine.campaign.loading import Campaign
from mc_engine.durable_file import leave, names_in, publish, remove_file, temporary_name
from mc_engine.errors import StoreError
from mc_engine.flight.chunks import Order, carry_out, fly_nominal
from mc_engine.interruption import SIGNALS
from mc_engine.runner.flown_campaign import campaign_of
from mc_engine.store.opening import open_store
from mc_engine.store.parts import Column, Written

LOOK_EVERY_S = 0.5  # at the parent process, and at the memory where the system keeps no limit
_MIB = 2**20


@dataclass(frozen=True)
class Site:
    """Where a worker finds its campaign.  All paths are absolute, and the same for all workers.

    directory : folder of the campaign's files; the run directory has copies where that one is not to be seen.
    n_cases : how many cases the campaign has.  case_seconds : time that one case may take, or no limit.
    memory_mib : what the worker's process may have, or no limit of ours.
    """

    run: str
    directory: str
    n_cases: int
    case_seconds: float | None = None
    memory_mib: int | None = None


def perform(site: Site, order: Order) -> Written:
    """Carry out one order in this process."""
    if site.memory_mib is not None:
        _limit_memory(site.memory_mib)
    campaign, columns = _campaign(site)
    guard = None
    if site.case_seconds is not None or order.suspected:
        guard = Watch(Path(site.run), site.case_seconds).over
    try:
        return carry_out(campaign, columns, Path(site.run), order, guard)
    except Exception as error:
        if is_out_of_memory(error):  # causes do not travel
            raise MemoryError(str(error)) from None
        raise


def is_out_of_memory(error: BaseException | None) -> bool:
    """True for a MemoryError, also as the cause of another."""
    return error is not None and (isinstance(error, MemoryError) or is_out_of_memory(error.__cause__))


@lru_cache(maxsize=4)
def _campaign(site: Site) -> tuple[Campaign, tuple[Column, ...]]:
    """The campaign, checked against the run's digests, with its kernel compiled or loaded."""
    store = open_store(site.run)
    if store.n_cases != site.n_cases:
        raise StoreError(f"{site.run}: a worker sees {store.n_cases} cases here, where there are {site.n_cases}")
    directory = Path(site.directory)
    campaign = campaign_of(store, directory if directory.is_dir() else None)
    fly_nominal(campaign)
    return campaign, store.columns


class Watch:
    """Leaves a note in the run directory of which cases are in flight, and ends this process where they take too long.

    A worker that dies leaves its last note behind.
    """

    def __init__(self, run: Path, seconds: float | None):
        self._run, self._seconds = run, seconds

    @contextmanager
    def over(self, case_ids: np.ndarray) -> Iterator[None]:
        """The cases of a batch fly side by side, so that the batch takes as long as its longest case."""
        first, last = int(case_ids[0]), int(case_ids[-1])
        note = _note(IN_FLIGHT, first, last)
        leave(self._run, note)
        timer = threading.Timer(self._seconds or 0.0, self._end, (note, _note(LATE, first, last)))
        timer.daemon = True
        if self._seconds is not None:
            timer.start()
        try:
            yield
        finally:
            timer.cancel()
        remove_file(self._run, note)

    def _end(self, in_flight: str, late: str) -> None:
        try:
            publish(self._run, in_flight, late)
        finally:
            os._exit(1)  # nothing else ends a thread that flies


IN_FLIGHT, LATE = "in_flight", "late"


def _note(kind: str, first: int, last: int) -> str:
    return temporary_name(f"cases/{kind}-{first}-{last}")  # a name that the next writer sweeps away


def take_notes(run: Path, case_ids: np.ndarray) -> tuple[str, np.ndarray]:
    """What dead workers noted of some of these cases: "late", "in_flight" or nothing, and which.  Takes the notes away.

    case_ids : int64[n], what the workers were flying.
    """
    found = {kind: _noted(run, kind, case_ids) for kind in (LATE, IN_FLIGHT)}
    return next(((kind, noted) for kind, noted in found.items() if noted.size), ("", case_ids[:0]))


def _noted(run: Path, kind: str, case_ids: np.ndarray) -> np.ndarray:
    noted = np.zeros(case_ids.size, dtype=bool)
    for name in names_in(run, "cases"):
        found = re.fullmatch(rf"\.{kind}-([0-9]{{1,18}})-([0-9]{{1,18}})\.tmp", name)
        if found is None:
            continue
        these = (case_ids >= int(found[1])) & (case_ids <= int(found[2]))
        if these.any():
            remove_file(run, f"cases/{name}")
            noted |= these
    return case_ids[noted]


def begin_process(parent: int) -> None:
    """Set up this process as a worker of process `parent`."""
    for number in SIGNALS:  # a Ctrl-C goes to all processes of a terminal; the one that asked us decides
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def dask_setup(worker: object) -> None:
    """Called in a Dask worker that has this module among its preloads: a terminal's Ctrl-C is not for it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _end_with(parent: int) -> None:
    """Leave when the parent is gone.  Windows keeps the number of a dead parent; idle workers leave by themselves."""
    while os.getppid() == parent:
        time.sleep(LOOK_EVERY_S)
    os._exit(1)


@lru_cache(maxsize=1)
def _limit_memory(mib: int) -> None:
    """Let allocations beyond `mib` fail, or where the system cannot, end the process that has more."""
    if sys.platform.startswith("linux"):
        import resource

        resource.setrlimit(resource.RLIMIT_DATA, (mib * _MIB, mib * _MIB))
    else:
        threading.Thread(target=_end_beyond, args=(mib * _MIB,), daemon=True).start()


def _end_beyond(limit: int) -> None:
    import psutil

    process = psutil.Process()
    while process.memory_info().rss <= limit:
        time.sleep(LOOK_EVERY_S)
    os._exit(1)
