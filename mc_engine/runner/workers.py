"""The interface of a worker pool, and the result of a task.  `mc_engine.runner.pools` has the implementations."""

import ctypes
import sys
from abc import ABC, abstractmethod
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

from mc_engine.flight.chunks import Task
from mc_engine.store.parts import Written

_LARGEST_KEPT = 31 * 2**20  # bytes; glibc's limit is below 32 MiB
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # of malloc.h


@dataclass(frozen=True)
class Result:
    """Outcome of a task: the part that was written, or the error that ended the task.

    died : the worker process died, or ran out of memory; the task itself may be sound.
    """

    task: Task
    written: Written | None = None
    error: BaseException | None = None
    died: bool = False


class WorkerPool(ABC):
    """Workers that run tasks and return their results in any order.  Used from one thread.

    shared : one process may run several tasks at once, so that a task can die because of another one.
    in_process : the workers are threads of this process, which see by themselves that a run is stopped.
    """

    shared = False
    in_process = False

    def __init__(self) -> None:
        self._results: SimpleQueue[Result] = SimpleQueue()

    @abstractmethod
    def room(self) -> int:
        """How many tasks may run or be queued at this moment."""

    @abstractmethod
    def begin(self, task: Task) -> None:
        """Submit a task; only while fewer than `room()` tasks are under way."""

    def next(self, patience_s: float) -> Result | None:
        """The next result, or None if no task ends within `patience_s` seconds."""
        try:
            return self._results.get(timeout=patience_s)
        except Empty:
            return None

    def without_workers_s(self) -> float:
        """How long the pool has had no worker [s]; always 0 for a pool that starts its own."""
        return 0.0

    @abstractmethod
    def close(self, at_once: bool) -> None:
        """End the workers; at_once : without waiting for their tasks."""


def keep_freed_memory() -> None:
    """Have this process keep the memory of freed arrays for the arrays of the next chunk.

    glibc gives the memory of arrays of more than 128 KiB back to the system when they are freed, so that each page of
    the next array is a page fault, for which all threads wait in turn; with MALLOC_TRIM_THRESHOLD_, which Dask sets for
    its workers, that of smaller ones, too.  See mallopt(3).  Without effect on other systems.
    """
    if not sys.platform.startswith("linux"):
        return
    if (limit := getattr(ctypes.CDLL(None), "mallopt", None)) is not None:
        limit(_M_MMAP_THRESHOLD, _LARGEST_KEPT)
        limit(_M_TRIM_THRESHOLD, 2 * _LARGEST_KEPT)


def result_of(task: Task, future: Any, deaths: type[Exception]) -> Result:
    """The result of a task from its finished future.  deaths : what the future raises if its worker died."""
    try:
        return Result(task, future.result())
    except Exception as error:  # any: a result that cannot be sent back would otherwise be waited for without end
        return Result(task, error=error, died=isinstance(error, deaths | MemoryError))
