"""Chunks of cases: drawn, flown and written by one worker, be it a thread, a process or another machine.

What a case comes to depends on (campaign, sources, seed, case_id): chunks and workers are bookkeeping.
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
from mc_engine.flight.flight import fly
from mc_engine.flight.kernel import build_kernel, usual_width
from mc_engine.model.faults import naming_faults
from mc_engine.status import OK, STATUS_NAME
from mc_engine.store.parts import CASE_COLUMNS, Column, Part, Written, read_part, revised_name, write_aside

SMALLEST_CHUNK, LARGEST_CHUNK = 64, 32_768
CHUNKS_PER_WORKER = 8  # enough for an even end, few enough that parts stay large
NOMINAL_NOISE = 2**52  # the nominal draws its noise where no case does
Columns = dict[str, np.ndarray]
Guard = Callable[[np.ndarray], AbstractContextManager[None]]


def chunk_size(cases: int, workers: int) -> int:
    """How many cases a worker flies at a time, and a part holds, by default."""
    return min(max(-(-cases // (CHUNKS_PER_WORKER * workers)), SMALLEST_CHUNK), LARGEST_CHUNK)


def chunks_of(ranges: Iterable[tuple[int, int]], size: int) -> Iterator[tuple[int, int]]:
    """Ranges of cases cut into chunks of at most `size`; all are half open."""
    for first, stop in ranges:
        for begin in range(first, stop, size):
            yield begin, min(begin + size, stop)


@dataclass(frozen=True)
class Lost:
    """A case that cannot be flown to an end: its worker dies of it, or it takes too long."""

    case_id: int
    status: str
    reason: str


@dataclass(frozen=True, eq=False)  # an order is itself alone, not another one of the same words
class Order:
    """What a worker is asked for: the part of the cases first .. stop - 1.

    lost : cases that are not flown; their rows hold their inputs and the reason.
    base : a part in which only the cases that failed are flown anew.  failed : these cases.
    suspected : a worker has died of it; it is flown in small batches, with a note of each.
    alone : cases that are flown first, one by one: one of them may be what the worker died of.
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

    def suspecting(self, cases: np.ndarray) -> "Order":
        """The same order, in which these cases fly alone, too."""
        alone = {*self.alone, *cases.tolist()} - {lost.case_id for lost in self.lost}
        return replace(self, suspected=True, alone=tuple(sorted(alone)))

    def without(self, lost: Lost) -> "Order":
        """The same order, in which this case is not flown."""
        return replace(self, lost=(*self.lost, lost))


def carry_out(
    campaign: Campaign, columns: Sequence[Column], run: Path, order: Order, guard: Guard | None = None
) -> Written:
    """Fly an order and write its part aside in `run`.

    guard : entered with the cases of each batch; batches are then no larger than the kernel is wide.
    """
    flown = order.flown()
    batch = None if guard is None else usual_width(campaign.model)
    flights = [fly_cases(campaign, flown, batch, guard or _unguarded, len(order.alone))] if flown.size else []
    names = [column.name for column in columns]
    arrays: Mapping[str, Any] = {**flights[0], "case_id": flown} if flights else {}
    if order.lost or order.alone or order.base is not None:
        arrays = _gathered(names, [arrays, _lost_rows(campaign, order.lost, names), _base_rows(run, order, flown)])
    file = revised_name(order.base.file) if order.base else None
    return write_aside(run, columns, order.first, order.stop - order.first, arrays, file)


def _unguarded(cases: np.ndarray) -> AbstractContextManager[None]:
    return nullcontext()


def fly_cases(
    campaign: Campaign, case_ids: np.ndarray, batch: int | None = None, guard: Guard = _unguarded, alone: int = 0
) -> Columns:
    """All columns but case_id of some cases.  case_ids : int64[n], n > 0.

    batch : cases at a time, if not all.  alone : how many of the first ones fly one by one.
    """
    table = case_table(campaign, case_ids)
    edges = [*range(alone), *range(alone, case_ids.size, batch or case_ids.size), case_ids.size]
    flights = []
    with naming_faults(campaign.model_reference, f"cases {case_ids.min()} to {case_ids.max()}"):
        for piece in (slice(*edge) for edge in pairwise(edges)):
            inputs = full_inputs(campaign, {name: column[piece] for name, column in table.items()})
            with guard(case_ids[piece]):
                noise = noise_ids(campaign, case_ids[piece])
                flights.append(fly(campaign.model, inputs, noise, campaign.seed, folder=campaign.directory))
    flight = flights[0] if len(flights) == 1 else _stacked(flights)
    name_upstream(campaign, case_ids, flight)
    return {**table, **flight}


def _stacked(tables: Sequence[Mapping[str, np.ndarray]]) -> Columns:
    return {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}


def fly_in_threads(
    campaign: Campaign, inputs: Columns, noise: np.ndarray, wanted: Sequence[str], workers: int
) -> Columns:
    """The wanted columns of cases that are not the campaign's own, flown by some threads in pieces of whole blocks.

    inputs : the dispersed columns.  noise : int64[n], what addresses the noise of each case.
    """
    from joblib import Parallel, delayed

    def task(rows: slice) -> Columns:
        piece = full_inputs(campaign, {name: values[rows] for name, values in inputs.items()})
        flown = fly(campaign.model, piece, noise[rows], campaign.seed, folder=campaign.directory)
        return {name: flown[name] for name in wanted}

    width = usual_width(campaign.model)
    build_kernel(campaign.model, campaign.directory, width)  # once, before several threads ask for it together
    size = width * -(-len(noise) // (width * workers))
    pieces = [slice(first, first + size) for first in range(0, len(noise), size)]
    if len(pieces) == 1:
        return task(pieces[0])
    landed: Any = Parallel(n_jobs=workers, backend="threading")(delayed(task)(piece) for piece in pieces)
    return {name: np.concatenate([columns[name] for columns in landed]) for name in wanted}


def name_upstream(campaign: Campaign, case_ids: np.ndarray, flight: Columns) -> None:
    """Say of cases that have nothing to start from what became of theirs upstream."""
    if campaign.upstream is not None:
        reasons = campaign.upstream.refusals(upstream_ids(campaign, case_ids))
        flight["reason"] = np.where(reasons != "", reasons, flight["reason"])


def _lost_rows(campaign: Campaign, lost: Sequence[Lost], names: Sequence[str]) -> Mapping[str, Any]:
    """The rows of cases that were not flown: inputs, status and reason; all else is not a number."""
    if not lost:
        return {}
    ids = np.array([case.case_id for case in lost], dtype=np.int64)
    known = {
        "case_id": ids,
        "status": np.array([case.status for case in lost], dtype=object),
        "reason": np.array([case.reason for case in lost], dtype=object),
        **case_table(campaign, ids),
    }
    return {name: known.get(name, np.full(ids.size, np.nan)) for name in names}


def _base_rows(run: Path, order: Order, flown: np.ndarray) -> Mapping[str, Any]:
    """The rows of the part that stand: neither flown anew nor lost."""
    if order.base is None:
        return {}
    table = read_part(run, order.base)
    anew = np.concatenate([flown, [lost.case_id for lost in order.lost]])
    stand = ~np.isin(table["case_id"].to_numpy(), anew)
    return {name: table[name].to_numpy(zero_copy_only=False)[stand] for name in table.column_names}


def _gathered(names: Sequence[str], tables: Sequence[Mapping[str, Any]]) -> Columns:
    """Rows of several tables as one, by case_id."""
    filled = [table for table in tables if table]
    order = np.argsort(np.concatenate([table["case_id"] for table in filled]))
    return {name: np.concatenate([table[name] for table in filled])[order] for name in names}


def fly_nominal(campaign: Campaign) -> dict[str, Any]:
    """The nominal case by column name."""
    inputs = campaign.nominal
    ids = np.array([NOMINAL_NOISE])
    with naming_faults(campaign.model_reference, "the nominal case"):
        flight = fly(campaign.model, inputs, ids, campaign.seed, folder=campaign.directory)
    dispersed = {one.name: inputs[one.name] for one in campaign.dispersions}
    if campaign.upstream is not None:
        dispersed |= campaign.upstream.nominal_row()
    return {**dispersed, **{name: column[0] for name, column in flight.items()}}


def rerun_orders(run: Path, counted: Sequence[Part]) -> list[Order]:
    """An order for every part with cases that did not complete."""
    orders = []
    for part in counted:
        if set(part.status) - {STATUS_NAME[OK]}:
            table = read_part(run, part, CASE_COLUMNS[:2])
            failed = table["status"].to_numpy(zero_copy_only=False) != STATUS_NAME[OK]
            cases = tuple(int(case) for case in table["case_id"].to_numpy()[failed])
            orders.append(Order(part.first, part.stop, base=part, failed=cases))
    return orders
