"""Chunks of consecutive cases: sampled, flown and stored by one worker: a thread, a process or a remote machine.

The result of a case depends only on (campaign, sources, seed, case_id), so not on the chunk size or the workers.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from mc_engine.campaign.cases import case_table, full_inputs
from mc_engine.campaign.loading import Campaign
from mc_engine.campaign.sensitivity_design import noise_ids, upstream_ids
from mc_engine.flight.flyer import NOMINAL_NOISE, Columns, Flyer, RunStopped, never
from mc_engine.flight.flyers import flyer_of
from mc_engine.interruption import in_threads
from mc_engine.model.faults import naming_faults
from mc_engine.sampling.distributions import column
from mc_engine.status import OK, STATUS_NAME
from mc_engine.store.case_rows import Row, RowLog
from mc_engine.store.parts import CASE_COLUMNS, Column, Part, Written, read_part, revised_name, write_aside
from mc_engine.store.run_files import NOMINAL_CASE

LARGEST_CHUNK = Flyer.largest_chunk
Guard = Callable[[np.ndarray], AbstractContextManager[Any]]


def chunk_size(cases: int, workers: int, flyer: Flyer | type[Flyer] = Flyer) -> int:
    """How many cases a worker flies at a time, and a part holds, by default; all workers have equally many parts."""
    each = max(flyer.chunks_per_worker, -(-cases // (workers * flyer.largest_chunk)))
    return max(-(-cases // (each * workers)), flyer.smallest_chunk)


def chunks_of(ranges: Iterable[tuple[int, int]], size: int) -> Iterator[tuple[int, int]]:
    """Ranges of cases cut into chunks of at most `size`; all are half open."""
    for first, stop in ranges:
        for begin in range(first, stop, size):
            yield begin, min(begin + size, stop)


@dataclass(frozen=True)
class Lost:
    """A case that cannot be completed: it kills its worker, or it takes too long."""

    case_id: int
    status: str
    reason: str


@dataclass(frozen=True, eq=False)  # compared by identity: two tasks may name the same cases
class Task:
    """One unit of work for a worker: fly the cases first .. stop - 1, or the nominal, and write their part.

    lost : cases that are not flown; their rows hold their inputs and the reason.
    base : an existing part of which only the failed cases are flown again.  failed : these cases.
    suspected : a worker died while it ran this task; it now flies small batches and records each of them.
    alone : cases that fly first and one by one, because one of them may have killed the worker.
    """

    first: int
    stop: int
    lost: tuple[Lost, ...] = ()
    base: Part | None = None
    failed: tuple[int, ...] = ()
    suspected: bool = False
    alone: tuple[int, ...] = ()

    def flown(self) -> np.ndarray:
        """int64[n], the cases that are to be flown, in the order in which they are."""
        cases = np.array(self.failed, dtype=np.int64) if self.base else np.arange(self.first, self.stop, dtype=np.int64)
        cases = cases[~np.isin(cases, [lost.case_id for lost in self.lost])]
        return cases[np.argsort(~np.isin(cases, self.alone), kind="stable")]

    def isolating(self, cases: np.ndarray) -> "Task":
        """A copy of the task, marked as suspected, in which these cases fly alone as well."""
        alone = {*self.alone, *cases.tolist()} - {lost.case_id for lost in self.lost}
        return replace(self, suspected=True, alone=tuple(sorted(alone)))

    def without(self, lost: Lost) -> "Task":
        """A copy of the task in which this case is not flown."""
        return replace(self, lost=(*self.lost, lost))


NOMINAL_TASK = Task(NOMINAL_CASE, 0)


def run_task(
    campaign: Campaign,
    columns: Sequence[Column],
    run: Path,
    task: Task,
    guard: Guard | None = None,
    stopped: Callable[[], bool] = never,
    flyer: Flyer | None = None,
) -> Written:
    """Fly the cases of a task and write their part under a temporary name in `run`.

    flyer : if another one than the campaign's own.
    guard : entered with the cases of each batch; batches are then no larger than the cases that fly together.
    Raises RunStopped if `stopped()` is true before it begins, and while it flies if a case may take long.
    """
    if stopped():
        raise RunStopped
    flown, flyer = task.flown(), flyer or flyer_of(campaign)
    batch = None if guard is None else flyer.batch
    log = RowLog(run, task.first, task.stop) if flyer.keeps_rows and task.base is None else None
    known = log.rows() if log is not None else {}
    fresh = flown[~np.isin(flown, [*known])]
    flights = []
    if fresh.size:
        keep = run if task.first != NOMINAL_CASE else None
        flight = fly_cases(campaign, fresh, batch, guard or nullcontext, len(task.alone), keep, log, stopped, flyer)
        flights.append({**flight, "case_id": fresh})
    names = [column.name for column in columns]
    if known:
        flights.append(_known_rows(campaign, known, names))
    arrays: Mapping[str, Any] = flights[0] if flights else {}
    if task.lost or task.alone or task.base is not None or known:
        arrays = _gathered(names, [*flights, _lost_rows(campaign, task.lost, names), _base_rows(run, task, flown)])
    file = revised_name(task.base.file) if task.base else None
    written = write_aside(run, columns, task.first, task.stop - task.first, arrays, file)
    if log is not None:
        log.remove()
    return written


def fly_cases(
    campaign: Campaign,
    case_ids: np.ndarray,
    batch: int | None = None,
    guard: Guard = nullcontext,
    alone: int = 0,
    keep: Path | None = None,
    log: RowLog | None = None,
    stopped: Callable[[], bool] = never,
    flyer: Flyer | None = None,
) -> Columns:
    """All columns but case_id of some cases.  case_ids : int64[n], n > 0.

    batch : cases at a time, if not all.  alone : how many of the first ones fly one by one.  keep : run directory for
    what the cases of a simulator leave behind.  log : of the rows of complete cases.
    """
    table, noise = drawn(campaign, case_ids)
    edges = [*range(alone), *range(alone, case_ids.size, batch or case_ids.size), case_ids.size]
    flights, flyer = [], flyer or flyer_of(campaign)
    with naming_faults(campaign.model_reference, cases_in_words(case_ids.min(), case_ids.max())):
        for piece in (slice(*edge) for edge in pairwise(edges)):
            inputs = full_inputs(campaign, {name: column[piece] for name, column in table.items()})
            flyer.start()
            with guard(case_ids[piece]):
                rows = None if log is None else log.of(case_ids[piece])
                flights.append(flyer.fly(inputs, noise[piece], rows, keep, stopped))
    flight = flights[0]
    if len(flights) > 1:
        flight = {name: np.concatenate([columns[name] for columns in flights]) for name in flight}
    name_upstream(campaign, case_ids, flight)
    return {**table, **flight}


def drawn(campaign: Campaign, case_ids: np.ndarray) -> tuple[Columns, np.ndarray]:
    """(case table, what addresses the noise) of some cases, or of the nominal, which is [NOMINAL_CASE]."""
    if case_ids.size != 1 or case_ids[0] != NOMINAL_CASE:
        return case_table(campaign, case_ids), noise_ids(campaign, case_ids)
    row = {dispersion.name: campaign.nominal[dispersion.name] for dispersion in campaign.dispersions}
    if campaign.upstream is not None:
        row |= campaign.upstream.nominal_row()
    return {name: np.asarray([value]) for name, value in row.items()}, np.array([NOMINAL_NOISE])


def cases_in_words(first: int, last: int) -> str:
    """Such as "cases 64 to 127", for messages."""
    return "the nominal case" if first == NOMINAL_CASE else f"cases {first} to {last}"


def fly_in_threads(
    campaign: Campaign,
    inputs: Columns,
    noise: np.ndarray,
    wanted: Sequence[str],
    workers: int,
    flyer: Flyer | None = None,
) -> Columns:
    """The wanted columns of cases outside the campaign's design, flown by several threads in pieces of whole blocks.

    inputs : the dispersed columns.  noise : int64[n], what addresses the noise of each case.
    flyer : if another one than the campaign's own.
    """
    flyer = flyer or flyer_of(campaign)

    def fly_rows(rows: slice) -> Columns:
        piece = full_inputs(campaign, {name: values[rows] for name, values in inputs.items()})
        flown = flyer.fly(piece, noise[rows])
        return {name: flown[name] for name in wanted}

    workers = min(workers, flyer.most_workers or workers)
    in_threads(lambda flyer: flyer.make_ready(), [flyer])  # once, before several threads ask for it together
    size = flyer.batch * -(-len(noise) // (flyer.batch * workers))
    pieces = [slice(first, first + size) for first in range(0, len(noise), size)]
    tables = in_threads(fly_rows, pieces, workers)
    return {name: np.concatenate([columns[name] for columns in tables]) for name in wanted}


def name_upstream(campaign: Campaign, case_ids: np.ndarray, flight: Columns) -> None:
    """Set the reason of cases that lack inputs from upstream to how that case ended; not of the nominal case."""
    if campaign.upstream is not None and case_ids.min() != NOMINAL_CASE:
        reasons = campaign.upstream.refusals(upstream_ids(campaign, case_ids))
        flight["reason"] = np.where(reasons != "", reasons, flight["reason"])


def _lost_rows(campaign: Campaign, lost: Sequence[Lost], names: Sequence[str]) -> Mapping[str, Any]:
    """The rows of cases that were not flown: inputs, status and reason; all other numbers are NaN."""
    if not lost:
        return {}
    ids = np.array([case.case_id for case in lost], dtype=np.int64)
    known = {
        "case_id": ids,
        "status": np.array([case.status for case in lost], dtype=object),
        "reason": np.array([case.reason for case in lost], dtype=object),
        **drawn(campaign, ids)[0],
    }
    return {name: known.get(name, np.full(ids.size, np.nan)) for name in names}


def _known_rows(campaign: Campaign, rows: Mapping[int, Row], names: Sequence[str]) -> Columns:
    """Rows that were recorded before the run was stopped, with the inputs of their cases."""
    ids = np.array(sorted(rows), dtype=np.int64)
    known: Columns = {"case_id": ids, **drawn(campaign, ids)[0]}
    return {
        name: known[name] if name in known else column([rows[case].get(name, np.nan) for case in ids.tolist()])
        for name in names
    }


def _base_rows(run: Path, task: Task, flown: np.ndarray) -> Mapping[str, Any]:
    """The rows of the part that stand: neither flown anew nor lost."""
    if task.base is None:
        return {}
    table = read_part(run, task.base)
    anew = np.concatenate([flown, [lost.case_id for lost in task.lost]])
    stand = ~np.isin(table["case_id"].to_numpy(), anew)
    return {name: table[name].to_numpy(zero_copy_only=False)[stand] for name in table.column_names}


def _gathered(names: Sequence[str], tables: Sequence[Mapping[str, Any]]) -> Columns:
    """Rows of several tables as one, by case_id."""
    filled = [table for table in tables if table]
    by_case = np.argsort(np.concatenate([table["case_id"] for table in filled]))
    return {name: np.concatenate([table[name] for table in filled])[by_case] for name in names}


def rerun_tasks(run: Path, counted: Sequence[Part]) -> list[Task]:
    """One task for every part that has cases which did not complete."""
    tasks = []
    for part in counted:
        if set(part.status) - {STATUS_NAME[OK]}:
            table = read_part(run, part, CASE_COLUMNS[:2])
            failed = table["status"].to_numpy(zero_copy_only=False) != STATUS_NAME[OK]
            cases = tuple(int(case) for case in table["case_id"].to_numpy()[failed])
            tasks.append(Task(part.first, part.stop, base=part, failed=cases))
    return tasks
