"""From chunks to receipts: keeps a crew busy, and finds the cases that kill their workers.

A chunk whose worker died is flown again, in small batches, with a note of each.  If that worker dies too, the cases
of the last note, or all where there is none, are flown on trial, by halves and at last one by one, until those are
found that kill their worker even alone, twice.  The chunk is then flown without them, and their rows say so.  So a
part holds the same cases whatever happened on the way.
"""

from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from mc_engine.chunks import Lost, Order
from mc_engine.crew import Crew, Landing
from mc_engine.errors import WorkersLost
from mc_engine.parts import Written
from mc_engine.status import STATUS_NAME, TIME_LIMIT, WORKER_DIED
from mc_engine.worker_process import LATE, take_notes

FEW = 16  # cases that are flown one by one rather than by halves: to begin a new worker takes longer
LOOK_EVERY_S = 0.2  # at whether to stop
DRAIN_S = 10.0  # without a worker, then what is under way is under way no more
UNNOTED = 3  # deaths in which an order was not in flight as far as is known
MOST_DEATHS = 30  # before any order has come through: it is not the cases then
DIED = "the process flying this case died"
NO_MEMORY = "needed more memory than its worker may have"


@dataclass
class Search:
    """The search of one chunk for the cases that kill their worker."""

    order: Order
    open_probes: int = 0
    found: list[Lost] = field(default_factory=list)


class Dispatch:
    """Gives a crew its orders and brings what landed.

    case_seconds : what the workers give a case; they leave a note in `run` where one takes longer.
    """

    def __init__(self, crew: Crew, run: Path, case_seconds: float | None = None):
        self._crew, self._run, self._case_seconds = crew, run, case_seconds
        self._waiting: deque[Order] = deque()
        self._under_way = 0
        self._twice: set[Order] = set()  # probes of a single case that are flown again
        self._alone: Order | None = None  # one of them that is under way, and nothing beside it
        self._unnoted: Counter[Order] = Counter()  # deaths with no note of what was in flight
        self._searches: dict[Order, Search] = {}  # by their probes
        self._landed = self._lost = 0

    def receipts(self, orders: Iterable[Order], stopped: Callable[[], bool]) -> Iterator[tuple[Order, Written]]:
        """What the workers wrote, as it lands.

        When stopped, nothing new begins, and what is under way still lands while there are workers.
        Raises WorkersLost when there is nobody to fly.
        """
        self._waiting.extend(orders)
        while self._under_way or (self._waiting and not stopped()):
            self._fill(stopped)
            landing = self._crew.next(LOOK_EVERY_S)
            if landing is None:
                if stopped() and self._crew.deserted_s() > DRAIN_S:
                    return
                continue
            self._under_way -= 1
            if landing.order is self._alone:
                self._alone = None
            if landing.died:
                self._mourn(landing)
            elif landing.error is not None:
                raise landing.error
            else:
                self._landed += 1
                if landing.written is None:
                    self._close_probe(landing.order)
                else:
                    self._fill(stopped)  # no worker waits until the receipt is dealt with
                    yield landing.order, landing.written

    def _fill(self, stopped: Callable[[], bool]) -> None:
        while self._waiting and not stopped() and self._may_begin(self._waiting[0]):
            order = self._waiting.popleft()
            self._crew.begin(order)
            self._under_way += 1
            if self._crew.shared and order in self._twice:
                self._alone = order

    def _may_begin(self, order: Order) -> bool:
        """True where there is room; a last trial waits until nothing else flies that its worker could die of."""
        if self._crew.shared and order in self._twice:
            return self._under_way == 0
        return self._alone is None and self._under_way < self._crew.room()

    def _mourn(self, landing: Landing) -> None:
        """A worker died of an order, or with it: fly it again, or look for the case that it dies of."""
        order, flown = landing.order, landing.order.flown()
        self._lost += 1
        if self._lost >= MOST_DEATHS and not self._landed:
            raise WorkersLost(f"the workers die whatever they fly; the last one said: {landing.error}")
        kind, noted = take_notes(self._run, flown)
        if kind == LATE:
            fate = Lost(-1, STATUS_NAME[TIME_LIMIT], f"took longer than {self._case_seconds:g} s")
            self._suspect(order, noted, fate)
        elif not order.suspected:
            self._waiting.append(order.once_more())
        elif not noted.size and self._unnoted[order] < UNNOTED:
            self._unnoted[order] += 1  # it waited for a worker that died of another order, or was being set up
            self._waiting.append(order)
        elif order.probe and flown.size == 1 and order not in self._twice:
            self._twice.add(order)  # the worker of an innocent case may be killed from outside, but hardly twice
            self._waiting.append(order)
        else:
            reason = NO_MEMORY if isinstance(landing.error, MemoryError) else DIED
            self._suspect(order, noted if noted.size else flown, Lost(-1, STATUS_NAME[WORKER_DIED], reason))

    def _suspect(self, order: Order, cases: np.ndarray, fate: Lost) -> None:
        """One of these cases of the order is to blame: fly them by halves, and a few one by one."""
        search = self._searches.get(order) or Search(order)
        if order.probe and cases.size == 1:
            search.found.append(replace(fate, case_id=int(cases[0])))
            self._close_probe(order)
            return
        pieces = cases.size if cases.size <= FEW else 2
        for piece in np.array_split(cases, pieces):
            probe = order.probing(piece)
            self._searches[probe] = search
            self._waiting.append(probe)
        search.open_probes += pieces
        if order.probe:
            self._close_probe(order)

    def _close_probe(self, probe: Order) -> None:
        search = self._searches.pop(probe)
        search.open_probes -= 1
        if search.open_probes:
            return
        batch = search.order.batch
        if not search.found:  # they die in company only, as for want of memory: fly fewer at a time
            if batch == 1:
                cases = f"cases {search.order.first} to {search.order.stop - 1}"
                raise WorkersLost(f"{cases}: their workers die, though each case comes through alone")
            batch = (batch or FEW) // 2
        self._waiting.append(search.order.without(search.found, batch))
