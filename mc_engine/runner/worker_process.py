"""Code that runs inside a worker process: loads the campaign, applies limits, and ends with the parent process."""

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
from mc_engine.flight.case_process import end_all
from mc_engine.flight.chunks import Task, run_task
from mc_engine.flight.flyers import flyer_of
from mc_engine.interruption import ignore_signals
from mc_engine.model.faults import naming_faults
from mc_engine.runner.flown_campaign import campaign_of
from mc_engine.runner.workers import keep_freed_memory
from mc_engine.store.opening import open_store
from mc_engine.store.parts import Column, Written

LOOK_EVERY_S = 0.5  # between two checks of the parent process, and of the memory where the system sets no limit
_MIB = 2**20


@dataclass(frozen=True)
class WorkerSetup:
    """What a worker process needs to know.  All paths are absolute, and the same for all workers.

    run : run directory.  directory : folder of the campaign's files; if a worker cannot see it, it uses the copies in
    the run directory.  n_cases : number of cases of the campaign.  case_seconds : time limit of a case, or None.
    memory_mib : memory limit of the process, or None.
    """

    run: str
    directory: str
    n_cases: int
    case_seconds: float | None = None
    memory_mib: int | None = None


def run_in_worker(setup: WorkerSetup, task: Task) -> Written:
    """Run one task in this process.  Raises MemoryError if it needs more memory than the limit."""
    if setup.memory_mib is not None:
        _limit_memory(setup.memory_mib)
    campaign, columns = _campaign(setup)
    guard = None
    if setup.case_seconds is not None or task.suspected:
        guard = Watch(Path(setup.run), setup.case_seconds).over
    try:
        return run_task(campaign, columns, Path(setup.run), task, guard)
    except Exception as error:
        if is_out_of_memory(error):  # the cause of an error is not sent to the parent process
            raise MemoryError(str(error)) from None
        raise


def is_out_of_memory(error: BaseException | None) -> bool:
    """True for a MemoryError, or an error caused by one."""
    return error is not None and (isinstance(error, MemoryError) or is_out_of_memory(error.__cause__))


@lru_cache(maxsize=4)
def _campaign(setup: WorkerSetup) -> tuple[Campaign, tuple[Column, ...]]:
    """The campaign and its columns, checked against the run's digests; its kernel is compiled or loaded."""
    store = open_store(setup.run)
    if store.n_cases != setup.n_cases:
        raise StoreError(f"{setup.run}: a worker reads {store.n_cases} cases here, and the run has {setup.n_cases}")
    directory = Path(setup.directory)
    campaign = campaign_of(store, directory if directory.is_dir() else None)
    with naming_faults(campaign.model_reference, "the nominal case"):
        flyer_of(campaign).make_ready()
    return campaign, store.columns


class Watch:
    """Records in the run directory which cases are in flight, and ends this process if they exceed the time limit.

    A worker that dies leaves its last record behind, which `take_notes` reads.
    """

    def __init__(self, run: Path, seconds: float | None):
        self._run, self._seconds = run, seconds

    @contextmanager
    def over(self, case_ids: np.ndarray) -> Iterator[None]:
        """Watch one batch.  Its cases fly in parallel, so that the limit of a case is the limit of the batch."""
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
            end_all()
        finally:
            os._exit(1)  # a thread in compiled code cannot be ended otherwise


IN_FLIGHT, LATE = "in_flight", "late"


def _note(kind: str, first: int, last: int) -> str:
    return temporary_name(f"cases/{kind}-{first}-{last}")  # temporary, so that the next writer removes it


def take_notes(run: Path, case_ids: np.ndarray) -> tuple[str, np.ndarray]:
    """Read and remove the records that dead workers left on some of these cases.

    case_ids : int64[n], the cases that the workers were to fly.
    Returns the kind of the records, "late", "in_flight" or "" for none, and the cases in them.
    """
    records = {kind: _noted(run, kind, case_ids) for kind in (LATE, IN_FLIGHT)}
    return next(((kind, noted) for kind, noted in records.items() if noted.size), ("", case_ids[:0]))


def _noted(run: Path, kind: str, case_ids: np.ndarray) -> np.ndarray:
    noted = np.zeros(case_ids.size, dtype=bool)
    for name in names_in(run, "cases"):
        match = re.fullmatch(rf"\.{kind}-(-?[0-9]{{1,18}})-(-?[0-9]{{1,18}})\.tmp", name)
        if match is None:
            continue
        in_record = (case_ids >= int(match[1])) & (case_ids <= int(match[2]))
        if in_record.any():
            remove_file(run, f"cases/{name}")
            noted |= in_record
    return case_ids[noted]


def begin_process(parent: int) -> None:
    """Set up this process as a worker of process `parent`."""
    ignore_signals()  # Ctrl-C reaches all processes of a terminal; the parent decides what to do
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    keep_freed_memory()


def dask_setup(worker: object) -> None:
    """Ignore Ctrl-C in a Dask worker; Dask calls this function in workers that preload this module."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _end_with(parent: int) -> None:
    """End this process when its parent has died.  Windows keeps the parent's number; there, idle workers time out."""
    while os.getppid() == parent:
        time.sleep(LOOK_EVERY_S)
    try:
        end_all()
    finally:
        os._exit(1)


@lru_cache(maxsize=1)
def _limit_memory(mib: int) -> None:
    """Make allocations beyond `mib` fail; where the system has no such limit, end the process that exceeds it."""
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
