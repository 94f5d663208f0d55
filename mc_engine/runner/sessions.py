"""One session on a run directory: flies the missing cases until the run is complete or stopped.

One process at a time is the writer of a run; it commits the parts that the workers of its pool wrote.
"""

import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from numbers import Integral

from mc_engine.campaign.loading import Campaign
from mc_engine.campaign.sensitivity_design import DESIGN as PICK_FREEZE
from mc_engine.campaign.sensitivity_design import companion, sensitivity_record
from mc_engine.durable_file import remove_file
from mc_engine.errors import DiskError, EngineError, ModelError, RunInterrupted, StoreError, WorkersLost
from mc_engine.flight.chunks import NOMINAL_TASK, Task, chunk_size, rerun_tasks
from mc_engine.flight.flyer import Flyer
from mc_engine.flight.flyers import flyer_of
from mc_engine.interruption import COMPLETING, GIVING_UP, in_threads, stop_signal
from mc_engine.model.simulator import Simulator
from mc_engine.runner.backends import Backend, flyer_on
from mc_engine.runner.dispatch import Dispatch
from mc_engine.runner.flown_campaign import companions_of
from mc_engine.runner.histories import integration_changes, write_histories
from mc_engine.runner.manifest import columns_of, manifest_of
from mc_engine.runner.part_bounds import Stretch, part_bounds, stretches
from mc_engine.runner.pools import pool_of
from mc_engine.runner.progress import ProgressCall
from mc_engine.runner.summary import failed_cases
from mc_engine.shell_words import shell_word
from mc_engine.status import MOST_CASES, OK, STATUS_NAME
from mc_engine.store.case_rows import recorded_cases, remove_logs, rows_so_far
from mc_engine.store.opening import open_store
from mc_engine.store.parts import Written, problem_of
from mc_engine.store.repair import mend_journal, withdraw_damaged
from mc_engine.store.run_files import JOURNAL, NOMINAL_CASE, SENSITIVITY, is_run_directory
from mc_engine.store.store import Store, create_store

_OF_A_CLUSTER = 64  # workers, at least, for which the cases of a scheduler are cut: each part takes its time
_LOOK_SELDOM = 20.0  # times what a look at the recorded rows takes, until the next one

Done = Sequence[tuple[Task, Written]]  # what tasks wrote


@dataclass(frozen=True)
class Session:
    """How to fly.  workers : threads or processes, by default one per core.  chunk : cases of a task, and of a part."""

    progress: ProgressCall | None
    workers: int
    chunk: int | None
    backend: Backend


def session_of(
    progress: ProgressCall | None, workers: int | None, chunk: int | None, backend: Backend | str
) -> Session:
    """A session from the arguments of the runner's functions; EngineError for an invalid argument."""
    workers = (os.cpu_count() or 1) if workers is None else count_of("workers", workers)
    chunk = None if chunk is None else min(count_of("chunk", chunk), MOST_CASES)
    if progress is not None and not callable(progress):
        raise EngineError(f"progress: {progress!r} is no function of (cases done, cases wanted, cases failed)")
    backend = Backend(backend) if isinstance(backend, str) else backend
    if not isinstance(backend, Backend):
        raise EngineError(f'backend: {backend!r} is not allowed; it is a Backend or the name of one, as "threading"')
    return Session(progress, workers, chunk, backend)


def count_of(name: str, number: object, least: int = 1) -> int:
    """The argument of this name as an int, also of NumPy's; EngineError unless it is a whole number from `least` on."""
    if isinstance(number, bool) or not (isinstance(number, Integral) and int(number) >= least):
        raise EngineError(f"{name}: {number!r} is not allowed; it must be a whole number from {least} on")
    return int(number)


def complete(store: Store, campaign: Campaign, session: Session, repair: bool = False) -> Store:
    """Fly the missing cases, the time histories and the flights for sensitivities.

    repair : damaged parts count as missing.  Raises RunInterrupted with the command that continues the run.
    """
    with _as_writer(store, campaign, "resume --repair" if repair else "resume", session) as stop:
        _fly_missing(store, campaign, session, repair, stop)
    return store


def _fly_missing(store: Store, campaign: Campaign, session: Session, repair: bool, stop: threading.Event) -> None:
    if repair:
        withdraw_damaged(store)
    elif lost := [part.file for part in store.parts if not (store.path / part.file).exists()]:
        again = f"`mc-engine resume {shell_word(store.path)} --repair` flies its cases again"
        raise StoreError(f"{store.path / lost[0]}: is gone; {again}")
    tasks, size = _missing_tasks(store, session, flyer_on(session.backend.name, campaign))
    missing = sum(task.stop - task.first for task in tasks)
    store.note("started", backend=session.backend.name, workers=session.workers, chunk=size, missing=missing)
    begin = time.perf_counter()
    nominal = bool(_nominal_problem(store))
    further = campaign.sensitivity.flights if _has_companion(store, campaign) and campaign.sensitivity else 0
    before = _counting(session, further if store.notes("companion") else 0, further)

    def commit(done: Done) -> None:
        store.publish(*(written for _, written in done))

    begun = _run_tasks(store, campaign, before, nominal, tasks, commit, stop.is_set)
    if (problem := _nominal_problem(store)) or store.missing():
        raise _interrupted(store, f"; {problem}" if store.nominal_part and problem else "")
    remove_logs(store.path)
    flown = time.perf_counter()
    _fly_histories(store, campaign, session, stop.is_set)
    if _has_companion(store, campaign):
        _fly_companion(store, campaign, session, repair, stop)
        if not store.notes("companion"):
            store.note("companion")
    store.check_originals()  # without them a directory of all cases is no run
    times = {"prepare_s": round(begun - begin, 3), "fly_s": round(flown - begun, 3)}
    store.note("finished", **times, integration=integration_changes(store, campaign))


def _has_companion(store: Store, campaign: Campaign) -> bool:
    """Whether the flights for sensitivities belong to the run; a shard has none."""
    asked = campaign.sensitivity is not None and campaign.design != PICK_FREEZE
    return asked and len(store.wanted) == store.n_cases


def _counting(session: Session, flown: int, cases: int, failed: int = 0) -> Session:
    """The session whose progress also counts the `cases` of another stage, `flown` of them done, `failed` failed."""
    report = session.progress
    if report is None:
        return session
    return replace(session, progress=lambda n, total, lost: report(flown + n, cases + total, failed + lost))


@contextmanager
def _as_writer(store: Store, campaign: Campaign, command: str, session: Session) -> Iterator[threading.Event]:
    """Hold the run's lock, and yield the event that a signal sets.

    command : continues the run.  A run that is stopped, by whatever cause, raises RunInterrupted with that command.  So
        does a simulator that no longer starts, for want of a licence perhaps, once a case has been flown.
    """
    place = shell_word(store.path)
    simulator = campaign.model if isinstance(campaign.model, Simulator) else None
    left = simulator is not None and (not simulator.batch or session.backend.name == "threading")
    try:
        with store.lock(), stop_signal(GIVING_UP if left else COMPLETING) as stop:
            yield stop
    except (StoreError, ModelError, RunInterrupted, KeyboardInterrupt) as error:
        why = str(error)
        if not (store.path / JOURNAL).exists():
            why = f"{store.path}: was moved or removed while the run was flying; if it was moved, no case is lost and"
            place = "NEW_PLACE"
        elif isinstance(error, DiskError) or (isinstance(error, ModelError) and simulator and _has_flown(store)):
            why += "; what was committed is safe,"
        elif not isinstance(error, RunInterrupted):
            raise
        again = f"mc-engine {command} {place}{session.backend.options()}"
        raise RunInterrupted(f"{why} `{again}` flies the rest") from error


def _has_flown(store: Store) -> bool:
    return bool(store.parts or store.nominal_part or recorded_cases(store.path))


def fly_failed(store: Store, campaign: Campaign, session: Session) -> Store:
    """Fly the failed cases again, and a failed nominal case; identical results are not replaced."""
    if store.missing():
        resume = f"`mc-engine resume {shell_word(store.path)}`"
        raise StoreError(f"{store.path}: is not complete; {resume} flies the rest first")
    with _as_writer(store, campaign, "rerun --failed", session) as stop:
        tasks = rerun_tasks(store.path, store.parts)
        cases = sum(len(task.failed) for task in tasks)
        store.note("rerun", backend=session.backend.name, workers=session.workers, cases=cases)
        nominal = bool(_nominal_problem(store)) or store.nominal()["status"] != STATUS_NAME[OK]
        remaining = {task.first for task in tasks} | ({NOMINAL_CASE} if nominal else set())

        def commit(done: Done) -> None:
            for task, written in done:
                remaining.discard(task.first)
                before = task.base or store.nominal_part
                if before is not None and written.part.sha256 == before.sha256:
                    remove_file(store.path, written.temporary)
                elif task.base is not None:
                    store.replace(task.base, written)
                else:
                    store.publish(written)

        _run_tasks(store, campaign, session, nominal, tasks, commit, stop.is_set)
        if remaining:
            raise _interrupted(store)
        _fly_histories(store, campaign, session, stop.is_set)
        store.note("finished")
    return store


def _run_tasks(
    store: Store,
    campaign: Campaign,
    session: Session,
    nominal: bool,
    tasks: list[Task],
    commit: Callable[[Done], None],
    stopped: Callable[[], bool],
) -> float:
    """Run the tasks in a worker pool, commit each part that is written, and report the progress.

    nominal : the nominal case flies, before any other begins: it shows what is wrong with a model, and compiles.
    Returns when the others began, by `time.perf_counter`.
    """
    counts = store.status_counts()
    done, failed = sum(counts.values()), failed_cases(counts)
    total = len(store.wanted)
    report = session.progress or (lambda *_: None)
    if not (nominal or tasks) or stopped():
        report(done, total, failed)
        return time.perf_counter()
    pool, at_once, flyer = None, True, flyer_of(campaign)
    leaves = flyer.keeps_rows  # its cases may take long
    try:
        if not nominal:
            in_threads(lambda flyer: flyer.make_ready(), [flyer])
        pool = pool_of(session.backend, store, campaign, session.workers, stopped)
        dispatch = Dispatch(pool, store.path, session.backend.case_seconds, leaves, flyer.most_workers)
        for receipts in dispatch.receipts([NOMINAL_TASK] if nominal else [], stopped):
            commit(receipts)
        begun = time.perf_counter()
        told, next_look_s = (-1, -1), begun

        def tell() -> None:
            nonlocal told, next_look_s
            look = time.perf_counter()
            rows, lost = rows_so_far(store.path) if leaves else (0, 0)
            next_look_s = look + _LOOK_SELDOM * (time.perf_counter() - look)
            if done + rows >= told[0] and (done + rows, failed + lost) != told:  # a part may be behind its rows
                told = done + rows, failed + lost
                report(told[0], total, told[1])

        def waiting() -> None:
            if leaves and time.perf_counter() >= next_look_s:
                tell()

        tell()
        for receipts in dispatch.receipts(tasks, stopped, waiting):
            commit(receipts)
            for task, written in receipts:
                done += written.part.rows - (task.base.rows if task.base else 0)
                failed += failed_cases(written.part.status) - (failed_cases(task.base.status) if task.base else 0)
            tell()
        at_once = leaves and stopped()
        return begun
    except WorkersLost as error:
        store.note("interrupted", cases=done)
        raise RunInterrupted(f"{error}; {done:,} of {total:,} cases are safe,") from error
    finally:
        if pool is not None:
            pool.close(at_once)
        store.sweep()


def _interrupted(store: Store, without: str = "") -> RunInterrupted:
    done, total = sum(store.status_counts().values()), len(store.wanted)
    store.note("interrupted", cases=done)
    recorded = recorded_cases(store.path)
    more = f" and the rows of {recorded:,} more" if recorded else ""
    return RunInterrupted(f"interrupted with {done:,} of {total:,} cases{more}{without};")


def _fly_histories(store: Store, campaign: Campaign, session: Session, stopped: Callable[[], bool]) -> None:
    """Fly the saved time histories.  A shard has none: the worst cases are known once all shards are merged."""
    whole = len(store.wanted) == store.n_cases
    if whole and not write_histories(store, campaign, session.workers, stopped):
        raise _interrupted(store, " and without the saved time histories")


def _fly_companion(store: Store, campaign: Campaign, session: Session, repair: bool, stop: threading.Event) -> None:
    """Fly or complete the flights for sensitivities, which are a run directory inside the run directory."""
    beside, path = companion(campaign), store.path / SENSITIVITY
    if path.is_symlink():
        raise StoreError(f"{path}: is a symbolic link; remove it, and `resume` makes the folder anew")
    if not is_run_directory(path):
        manifest = {**manifest_of(beside), "sensitivity": sensitivity_record(campaign)}
        create_store(path, manifest, beside.text, columns_of(beside), companions_of(beside))
    elif repair:
        mend_journal(path)
    counts = store.status_counts()
    after = _counting(session, sum(counts.values()), sum(counts.values()), failed_cases(counts))
    inner = open_store(path)
    if inner.manifest["campaign"]["digest"] != beside.digest:
        raise StoreError(f"{path}: holds flights of another campaign; remove it, and `resume` flies them anew")
    with inner.lock():
        _fly_missing(inner, beside, replace(after, chunk=None), repair, stop)


def _nominal_problem(store: Store) -> str:
    """Why there is no nominal case that can be read; empty if there is."""
    if store.nominal_part is None:
        return "the nominal case has not been flown"
    path = store.path / store.nominal_part.file
    problem = problem_of(path, store.nominal)
    return problem and f"{path}: {problem}"


def _missing_tasks(store: Store, session: Session, flyer: Flyer) -> tuple[list[Task], int]:
    """Tasks for the missing cases, and the number of cases of a part."""
    missing = store.missing()
    end = store.wanted.stop
    along = stretches(store.notes(), min(end, store.manifest["campaign"]["cases"]), end)
    cases = sum(stop - first for first, stop in missing)
    workers = session.workers
    if flyer.keeps_rows and session.backend.scheduler is not None:  # its workers come and go
        workers = max(workers, _OF_A_CLUSTER)
    size = session.chunk or along[-1].chunk or chunk_size(cases, workers, flyer)
    if session.chunk is not None:
        along = [Stretch(end, session.chunk)]
    return [Task(*bounds) for bounds in part_bounds(missing, store.notes(), along, size)], size
