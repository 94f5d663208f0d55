"""A session of work on a run directory: from what is missing to a complete run, or to a clean stop.

One process writes at a time; it counts the parts that the workers of its crew wrote.
"""

import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

from mc_engine.campaign.loading import Campaign
from mc_engine.campaign.sensitivity_design import DESIGN as PICK_FREEZE
from mc_engine.campaign.sensitivity_design import companion, sensitivity_record
from mc_engine.durable_file import remove_file
from mc_engine.errors import DiskError, RunInterrupted, StoreError, WorkersLost
from mc_engine.flight.chunks import Order, chunk_size, fly_nominal, rerun_orders
from mc_engine.interruption import stop_signal
from mc_engine.runner.backends import Backend
from mc_engine.runner.dispatch import Dispatch
from mc_engine.runner.flown_campaign import companions_of
from mc_engine.runner.histories import write_histories
from mc_engine.runner.manifest import columns_of, manifest_of
from mc_engine.runner.part_bounds import Stretch, part_bounds, stretches
from mc_engine.runner.pools import crew_of
from mc_engine.runner.progress import ProgressCall
from mc_engine.shell_words import shell_word
from mc_engine.status import OK, STATUS_NAME
from mc_engine.store.opening import open_store
from mc_engine.store.parts import Written, problem_of
from mc_engine.store.repair import mend_journal, withdraw_damaged
from mc_engine.store.run_files import JOURNAL, SENSITIVITY, is_run_directory
from mc_engine.store.store import Store, create_store

Settle = Callable[[Order, Written], None]


@dataclass(frozen=True)
class Session:
    """How to fly.  workers : threads or processes, all cores by default.  chunk : cases of an order, and of a part."""

    progress: ProgressCall | None = None
    workers: int = field(default_factory=lambda: os.cpu_count() or 1)
    chunk: int | None = None
    backend: Backend = field(default_factory=Backend)


def session_of(
    progress: ProgressCall | None, workers: int | None, chunk: int | None, backend: Backend | str
) -> Session:
    """A session from the arguments of the runner's functions."""
    backend = Backend(backend) if isinstance(backend, str) else backend
    return Session(progress, workers or os.cpu_count() or 1, chunk, backend)


def complete(store: Store, campaign: Campaign, session: Session, repair: bool = False) -> Store:
    """Fly what is missing, then the histories and the companion.  repair : parts that are damaged are missing, too."""
    with _resumable(store, "resume --repair" if repair else "resume", session) as stop:
        _complete(store, campaign, session, repair, stop)
    return store


def _complete(store: Store, campaign: Campaign, session: Session, repair: bool, stop: threading.Event) -> None:
    """The same, for the writer of the run.  stop : is set where it is to end."""
    if repair:
        withdraw_damaged(store)
    orders, size = _orders(store, session)
    wanted = sum(order.stop - order.first for order in orders)
    store.note("started", backend=session.backend.name, workers=session.workers, chunk=size, missing=wanted)
    begin = time.perf_counter()
    _keep_nominal(store, campaign, bool(orders))
    compiled = time.perf_counter()
    _fly(store, campaign, session, orders, lambda order, written: store.publish(written), stop.is_set)
    if store.missing():
        raise _interrupted(store)
    flown = time.perf_counter()
    _keep_histories(store, campaign, session, stop.is_set)
    if campaign.sensitivity is not None and campaign.design != PICK_FREEZE and len(store.wanted) == store.n_cases:
        _keep_companion(store, campaign, session, repair, stop)
        if not store.notes("companion"):
            store.note("companion")
    store.note("finished", prepare_s=round(compiled - begin, 3), fly_s=round(flown - compiled, 3))


@contextmanager
def _resumable(store: Store, command: str, session: Session) -> Iterator[threading.Event]:
    """Be the writer of the run, with what a signal sets; whatever stops it, say with which command it goes on."""
    place = shell_word(store.path)
    try:
        with store.lock(), stop_signal() as stop:
            yield stop
    except (StoreError, RunInterrupted, KeyboardInterrupt) as error:
        why = str(error)
        if not (store.path / JOURNAL).exists():
            why = f"{store.path}: was moved or removed while the run was flying; what was committed is in it still,"
            place = "NEW_PLACE"
        elif isinstance(error, DiskError):
            why += "; what was committed is safe,"
        elif not isinstance(error, RunInterrupted):
            raise
        again = f"mc-engine {command} {place}{session.backend.options()}"
        raise RunInterrupted(f"{why} `{again}` flies the rest") from error


def fly_failed(store: Store, campaign: Campaign, session: Session) -> Store:
    """Fly the cases again that did not complete; a part in which nothing changes stays as it is."""
    if store.missing():
        resume = f"`mc-engine resume {shell_word(store.path)}`"
        raise StoreError(f"{store.path}: is not complete; {resume} flies the rest first")
    with _resumable(store, "rerun --failed", session) as stop:
        orders = rerun_orders(store.path, store.parts)
        cases = sum(len(order.failed) for order in orders)
        store.note("rerun", backend=session.backend.name, workers=session.workers, cases=cases)
        fly_nominal(campaign)  # compiles the kernel
        left = {order.base.file for order in orders if order.base}

        def settle(order: Order, written: Written) -> None:
            assert order.base is not None  # each of these orders has one
            left.discard(order.base.file)
            if written.part.sha256 == order.base.sha256:
                remove_file(store.path, written.temporary)
            else:
                store.replace(order.base, written)

        _fly(store, campaign, session, orders, settle, stop.is_set)
        if left:
            raise _interrupted(store)
        _keep_histories(store, campaign, session, stop.is_set)
        store.note("finished")
    return store


def _fly(
    store: Store,
    campaign: Campaign,
    session: Session,
    orders: Iterable[Order],
    settle: Settle,
    stopped: Callable[[], bool],
) -> None:
    """Have the orders carried out, settle each as it lands, and tell of the progress."""
    counts = store.status_counts()
    done, failed = sum(counts.values()), _failed(counts)
    total = len(store.wanted)
    tell = session.progress or (lambda *_: None)
    tell(done, total, failed)
    orders = list(orders)
    if not orders or stopped():
        return
    crew, at_once = None, True
    try:
        crew = crew_of(session.backend, store, campaign, session.workers)
        dispatch = Dispatch(crew, store.path, session.backend.case_seconds)
        for order, written in dispatch.receipts(orders, stopped):
            settle(order, written)
            done += written.part.rows - (order.base.rows if order.base else 0)
            failed += _failed(written.part.status) - (_failed(order.base.status) if order.base else 0)
            tell(done, total, failed)
        at_once = False
    except WorkersLost as error:
        store.note("interrupted", cases=done)
        raise RunInterrupted(f"{error}; {done:,} of {total:,} cases are safe,") from error
    finally:
        if crew is not None:
            crew.close(at_once)
        store.sweep()


def _failed(status: dict[str, int]) -> int:
    return sum(count for word, count in status.items() if word != STATUS_NAME[OK])


def _interrupted(store: Store) -> RunInterrupted:
    done, total = sum(store.status_counts().values()), len(store.wanted)
    store.note("interrupted", cases=done)
    return RunInterrupted(f"interrupted with {done:,} of {total:,} cases;")


def _keep_histories(store: Store, campaign: Campaign, session: Session, stopped: Callable[[], bool]) -> None:
    """A shard has none: which cases are the worst is known when all have been flown."""
    whole = len(store.wanted) == store.n_cases
    if whole and not write_histories(store, campaign, session.workers, stopped):
        raise _interrupted(store)


def _keep_companion(store: Store, campaign: Campaign, session: Session, repair: bool, stop: threading.Event) -> None:
    """Fly or complete the flights beside the run, a run directory inside it."""
    beside, path = companion(campaign), store.path / SENSITIVITY
    if path.is_symlink():
        raise StoreError(f"{path}: is a symbolic link; remove it, and `resume` flies into a folder of the run's own")
    if not is_run_directory(path):
        manifest = {**manifest_of(beside), "sensitivity": sensitivity_record(campaign)}
        create_store(path, manifest, beside.text, columns_of(beside), companions_of(beside))
    elif repair:
        mend_journal(path)
    done, flown = store.status_counts(), session.progress

    def tell(cases: int, total: int, failed: int) -> None:
        if flown is not None:
            flown(sum(done.values()) + cases, sum(done.values()) + total, _failed(done) + failed)

    inner = open_store(path)
    if inner.manifest["campaign"]["digest"] != beside.digest:
        raise StoreError(f"{path}: holds flights of another campaign; remove it, and `resume` flies them anew")
    with inner.lock():
        _complete(inner, beside, replace(session, progress=tell, chunk=None), repair, stop)


def _keep_nominal(store: Store, campaign: Campaign, flying: bool) -> None:
    """Fly the nominal case where it is not there as it was written; and before others fly, to compile the kernel."""
    part = store.nominal_part
    sound = part is not None and not problem_of(store.path / part.file, store.nominal)
    if flying or not sound:
        row = fly_nominal(campaign)
        if not sound:
            store.write_nominal(row)


def _orders(store: Store, session: Session) -> tuple[list[Order], int]:
    """Orders for what is missing, and how many cases a part has."""
    missing = store.missing()
    end = store.wanted.stop
    along = stretches(store.notes(), min(end, store.manifest["campaign"]["cases"]), end)
    cases = sum(stop - first for first, stop in missing)
    size = session.chunk or along[-1].chunk or chunk_size(cases, session.workers)
    if session.chunk is not None:
        along = [Stretch(end, session.chunk)]
    return [Order(*bounds) for bounds in part_bounds(missing, store.notes(), along, size)], size
