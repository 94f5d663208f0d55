"""From chunks to receipts: keeps a crew busy, and finds the cases that kill their workers.

A chunk whose worker died is flown again, in small batches, with a note of each.  If that worker dies too, the cases
of its last note are flown first, one by one.  A case whose worker dies of it alone, twice, is lost: the chunk is flown
without it, and its row says so.  So a part holds the same cases whatever happened on the way.
"""

from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from mc_engine.errors import WorkersLost
from mc_engine.flight.chunks import Lost, Order
from mc_engine.runner.worker_process import LATE, take_notes
from mc_engine.runner.workers import Crew, Landing
from mc_engine.status import STATUS_NAME, TIME_LIMIT, WORKER_DIED
from mc_engine.store.parts import Written

LOOK_EVERY_S = 0.2  # at whether to stop
DRAIN_S = 10.0  # without a worker, then what is under way is under way no more
MOST_DEATHS = 30  # before any case has come through: it is not the cases then
MOST_UNNOTED = 10  # deaths of one order of which nobody knows what was in flight
DIED = "the process flying this case died"
NO_MEMORY = "needed more memory than its worker may have"


class Dispatch:
    """Gives a crew its orders and brings what landed.

    case_seconds : what the workers give a case; they leave a note in `run` where one takes longer.
    """

    def __init__(self, crew: Crew, run: Path, case_seconds: float | None = None):
        self._crew, self._run, self._case_seconds = crew, run, case_seconds
        self._waiting: deque[Order] = deque()
        self._under_way = 0
        self._apart = False  # an order is under way, and nothing may be beside it
        self._deaths: Counter[int] = Counter()  # of a case that flew alone
        self._unnoted: Counter[int] = Counter()  # of an order, by its first case
        self._lost, self._came_through = 0, False

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
            self._apart = self._apart and self._under_way > 0
            if landing.died:
                self._on_worker_death(landing)
            elif landing.written is None:
                raise landing.error or AssertionError(landing)
            else:
                self._came_through = True
                self._fill(stopped)  # no worker waits until the receipt is dealt with
                yield landing.order, landing.written

    def _fill(self, stopped: Callable[[], bool]) -> None:
        while self._waiting and not stopped() and self._may_begin(self._waiting[0]):
            order = self._waiting.popleft()
            self._crew.begin(order)
            self._under_way += 1
            self._apart = self._flies_apart(order)

    def _may_begin(self, order: Order) -> bool:
        if self._apart or self._flies_apart(order):
            return self._under_way == 0
        return self._under_way < self._crew.room()

    def _flies_apart(self, order: Order) -> bool:
        """Whether nothing may fly beside an order, so that its worker dies of nothing else."""
        return self._crew.shared and bool(order.alone)

    def _on_worker_death(self, landing: Landing) -> None:
        """Fly the order of a dead worker again, without the case that killed it if that is known by now.

        The worker of an innocent case may be killed from outside, but hardly twice.
        """
        order, flown = landing.order, landing.order.flown()
        kind, noted = take_notes(self._run, flown)
        self._lost += 1
        self._came_through = self._came_through or (noted.size > 0 and noted[0] != flown[0])
        if self._lost >= MOST_DEATHS and not self._came_through:
            raise WorkersLost(f"the workers die whatever they fly; the last one said: {landing.error}")
        if noted.size != 1:
            if order.suspected and not noted.size:
                self._count_unnoted(order)
            self._waiting.append(order.suspecting(noted))
            return
        case = int(noted[0])
        self._deaths[case] += case in order.alone
        if kind == LATE:
            order = order.without(Lost(case, STATUS_NAME[TIME_LIMIT], f"took longer than {self._case_seconds:g} s"))
        elif self._deaths[case] > 1:
            reason = NO_MEMORY if isinstance(landing.error, MemoryError) else DIED
            order = order.without(Lost(case, STATUS_NAME[WORKER_DIED], reason))
        self._waiting.append(order.suspecting(noted))

    def _count_unnoted(self, order: Order) -> None:
        """It waited for a worker that died of another order, or was being set up; but not always."""
        self._unnoted[order.first] += 1
        if self._unnoted[order.first] > MOST_UNNOTED:
            raise WorkersLost(f"cases {order.first} to {order.stop - 1}: their workers die before any of them flies")
