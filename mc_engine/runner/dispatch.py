"""Dispatch of tasks to a worker pool, and isolation of the cases that kill their workers.

A task whose worker died runs again in small batches, and the worker records each batch before it flies.  If that worker
dies too, the cases of the last record fly first, one by one.  A case whose worker dies twice while it flies alone is
lost: the task runs without it, and its row gives the reason.  A part therefore always holds the same cases.
"""

from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from mc_engine.errors import WorkersLost
from mc_engine.flight.chunks import Lost, Task, cases_in_words
from mc_engine.flight.flyer import RunStopped
from mc_engine.runner.worker_process import LATE, take_notes
from mc_engine.runner.workers import Result, WorkerPool
from mc_engine.status import STATUS_NAME, TIME_LIMIT, WORKER_DIED
from mc_engine.store.parts import Written

LOOK_EVERY_S = 0.2  # between two checks whether to stop
DRAIN_S = 10.0  # without a worker, after which a stopped run waits for its tasks no longer
MOST_DEATHS = 30  # before any case has completed: then the cases are not the cause
MOST_UNNOTED = 10  # deaths of one task without a record of what was in flight
DIED = "the process flying this case died"
NO_MEMORY = "needed more memory than its worker may have"


class Dispatch:
    """Runs tasks in a worker pool and yields what the workers wrote.

    run : run directory, in which workers record what is in flight.  case_seconds : time limit of a case.
    leaves : a run that is stopped does not wait for the tasks under way, whose workers record each complete case.
    most : tasks under way at a time, None for as many as the pool takes.
    """

    def __init__(
        self,
        pool: WorkerPool,
        run: Path,
        case_seconds: float | None = None,
        leaves: bool = False,
        most: int | None = None,
    ):
        self._pool, self._run, self._case_seconds, self._leaves = pool, run, case_seconds, leaves
        self._most = most
        self._waiting: deque[Task] = deque()
        self._under_way = 0
        self._exclusive = False  # a task is under way beside which no other may run
        self._deaths: Counter[int] = Counter()  # by case, of workers that flew it alone
        self._unnoted: Counter[int] = Counter()  # deaths without a record, by the first case of the task
        self._n_deaths, self._any_completed = 0, False

    def receipts(
        self, tasks: Iterable[Task], stopped: Callable[[], bool], waiting: Callable[[], None] = lambda: None
    ) -> Iterator[list[tuple[Task, Written]]]:
        """Each task with the part that was written for it, in the order of completion; all that have come in at once.

        waiting : called now and then while no part comes in.
        Once `stopped()` is true no further task begins; those under way complete as long as there are workers.
        Raises WorkersLost if the workers cannot be kept alive.
        """
        self._waiting.extend(tasks)
        while self._under_way or (self._waiting and not stopped()):
            self._fill(stopped)
            result = self._pool.next(LOOK_EVERY_S)
            if result is None:
                if stopped() and (self._leaves_now() or self._pool.without_workers_s() > DRAIN_S):
                    return
                waiting()
                continue
            done: list[tuple[Task, Written]] = []
            try:
                while result is not None:
                    done += self._written(result)
                    result = self._pool.next(0.0)
            except Exception:
                if done:
                    yield done  # they have come in before the error
                raise
            self._fill(stopped)  # before the caller handles the parts, so that no worker is idle meanwhile
            if done:
                yield done

    def _written(self, result: Result) -> list[tuple[Task, Written]]:
        """The task with its part, if that was written."""
        self._under_way -= 1
        self._exclusive = self._exclusive and self._under_way > 0
        if result.died:
            self._on_worker_death(result)
        elif result.written is not None:
            self._any_completed = True
            return [(result.task, result.written)]
        elif not isinstance(result.error, RunStopped):
            raise result.error or AssertionError(result)
        return []

    def _leaves_now(self) -> bool:
        """Whether tasks under way are left; threads end by themselves, and are waited for."""
        return self._leaves and not self._pool.in_process

    def _fill(self, stopped: Callable[[], bool]) -> None:
        while self._waiting and not stopped() and self._may_begin(self._waiting[0]):
            task = self._waiting.popleft()
            self._pool.begin(task)
            self._under_way += 1
            self._exclusive = self._needs_pool_alone(task)

    def _may_begin(self, task: Task) -> bool:
        if self._exclusive or self._needs_pool_alone(task):
            return self._under_way == 0
        return self._under_way < min(self._pool.room(), self._most or self._pool.room())

    def _needs_pool_alone(self, task: Task) -> bool:
        """Whether no other task may run at the same time, so that only this one can kill its worker."""
        return self._pool.shared and bool(task.alone)

    def _on_worker_death(self, result: Result) -> None:
        """Queue the task of a dead worker again, without the case that killed it once that case is known.

        A first death may come from outside (out of memory, `kill`), so a case is lost at the second one only.
        Raises WorkersLost if workers die before any case has completed.
        """
        task, flown = result.task, result.task.flown()
        kind, noted = take_notes(self._run, flown)
        self._n_deaths += 1
        self._any_completed = self._any_completed or (noted.size > 0 and noted[0] != flown[0])
        if self._n_deaths >= MOST_DEATHS and not self._any_completed:
            raise WorkersLost(f"{self._n_deaths} workers died before any case completed; last error: {result.error}")
        if noted.size != 1:
            if task.suspected and not noted.size:
                self._count_unnoted(task)
            self._waiting.append(task.isolating(noted))
            return
        case = int(noted[0])
        self._deaths[case] += case in task.alone
        if kind == LATE:
            task = task.without(Lost(case, STATUS_NAME[TIME_LIMIT], f"took longer than {self._case_seconds:g} s"))
        elif self._deaths[case] > 1:
            reason = NO_MEMORY if isinstance(result.error, MemoryError) else DIED
            task = task.without(Lost(case, STATUS_NAME[WORKER_DIED], reason))
        self._waiting.append(task.isolating(noted))

    def _count_unnoted(self, task: Task) -> None:
        """Count a death without a record: the worker died while it started, or of another task."""
        self._unnoted[task.first] += 1
        if self._unnoted[task.first] > MOST_UNNOTED:
            who = cases_in_words(task.first, task.stop - 1)
            raise WorkersLost(f"{who}: the workers die before a case flies")
