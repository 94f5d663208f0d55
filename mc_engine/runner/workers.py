"""What a crew is: workers that take orders and bring back what became of them, in any order."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

from mc_engine.flight.chunks import Order
from mc_engine.store.parts import Written


@dataclass(frozen=True)
class Landing:
    """What became of an order: its receipt, or the error that ended it.

    died : the worker is gone, or had not the memory; nothing is wrong with the order as far as is known.
    """

    order: Order
    written: Written | None = None
    error: BaseException | None = None
    died: bool = False


class Crew(ABC):
    """Workers that carry out orders.  `begin` only while there is room; one thread asks.

    shared : orders may fly beside each other in one process, so that one can die of another.
    """

    shared = False

    def __init__(self) -> None:
        self._landed: SimpleQueue[Landing] = SimpleQueue()

    @abstractmethod
    def room(self) -> int:
        """How many orders may be under way at once, now."""

    @abstractmethod
    def begin(self, order: Order) -> None:
        """Hand an order to a worker."""

    def next(self, patience_s: float) -> Landing | None:
        """The next order that has come to an end; None if none has in time."""
        try:
            return self._landed.get(timeout=patience_s)
        except Empty:
            return None

    def deserted_s(self) -> float:
        """For how long there has been no worker [s]; none of this for a crew that makes its own."""
        return 0.0

    @abstractmethod
    def close(self, at_once: bool) -> None:
        """Let the workers go; at once: whatever they are doing."""


def landing_of(order: Order, future: Any, deaths: type[Exception]) -> Landing:
    """What a future that is done says of its order.  deaths : what it raises when its worker is gone."""
    try:
        return Landing(order, future.result())
    except Exception as error:  # also of a result that does not travel: an order that never lands is waited for
        return Landing(order, error=error, died=isinstance(error, deaths | MemoryError))
