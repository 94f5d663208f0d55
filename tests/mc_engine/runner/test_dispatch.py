"""Which cases are given up, by how often their workers died: with workers that die as told."""

import threading
from collections import Counter

import pytest

from mc_engine import load_campaign
from mc_engine.durable_file import leave
from mc_engine.flight import chunks
from mc_engine.flight.chunks import Task, run_task
from mc_engine.runner.dispatch import DIED, NO_MEMORY, Dispatch
from mc_engine.runner.manifest import columns_of
from mc_engine.runner.pools import ThreadWorkerPool
from mc_engine.runner.worker_process import IN_FLIGHT, _note
from mc_engine.runner.workers import Result, WorkerPool
from mc_engine.store.parts import CASE_COLUMNS


class DyingWorkers(WorkerPool):
    """One worker, which dies of some cases so many times.  error : of which it dies."""

    def __init__(self, run, deaths, error=None):
        super().__init__()
        self._run, self._deaths, self._error, self.begun = run, Counter(deaths), error, 0

    def room(self):
        return 1

    def begin(self, task):
        self.begun += 1
        flown = task.flown().tolist()
        alone = [[case] for case in flown if case in task.alone]
        for batch in [*alone, [case for case in flown if case not in task.alone]]:
            if any(self._deaths[case] > 0 for case in batch):
                self._deaths.subtract(case for case in batch if self._deaths[case] > 0)
                if task.suspected:
                    leave(self._run, _note(IN_FLIGHT, batch[0], batch[-1]))
                self._results.put(Result(task, error=self._error, died=True))
                return
        self._results.put(Result(task, written=task))

    def close(self, at_once):
        """Nothing to end."""


@pytest.fixture
def run(tmp_path):
    (tmp_path / "cases").mkdir()
    return tmp_path


def flown_by(workers, run, cases=10):
    return [task for done in Dispatch(workers, run).receipts([Task(0, cases)], lambda: False) for task, _ in done]


def test_a_case_is_given_up_when_its_worker_dies_twice_while_it_flies_alone(run):
    [task] = flown_by(DyingWorkers(run, {5: 3}), run)  # once unnoticed, once with others, once alone
    assert task.lost == ()
    [task] = flown_by(DyingWorkers(run, {5: 4}), run)
    assert [(lost.case_id, lost.status, lost.reason) for lost in task.lost] == [(5, "worker-died", DIED)]
    assert task.flown().tolist() == [0, 1, 2, 3, 4, 6, 7, 8, 9]


def test_the_only_case_of_a_task_flies_as_often(run):
    workers = DyingWorkers(run, {0: 100}, MemoryError())
    [task] = flown_by(workers, run, 1)
    assert [(lost.case_id, lost.reason) for lost in task.lost] == [(0, NO_MEMORY)]
    assert workers.begun == 5


def test_parts_that_came_in_before_an_error_are_handed_over_at_once_and_before_it(run):
    class Quick(DyingWorkers):
        def room(self):
            return 4

        def begin(self, task):
            failed = OSError("no room") if task.first == 20 else None
            self._results.put(Result(task, written=None if failed else task, error=failed))

    receipts = Dispatch(Quick(run, {}), run).receipts([Task(first, first + 10) for first in (0, 10, 20, 30)], lambda: 0)
    assert [task.first for task, _ in next(receipts)] == [0, 10]
    with pytest.raises(OSError, match="no room"):
        next(receipts)


def test_a_stopped_run_ends_the_tasks_under_way_and_begins_none_that_waits(run, monkeypatch):
    campaign, stop, begun = load_campaign("minimal", cases=640), threading.Event(), threading.Semaphore(0)
    columns = [*CASE_COLUMNS, *columns_of(campaign)]
    fly = chunks.fly_cases
    monkeypatch.setattr(chunks, "fly_cases", lambda *given: [begun.release(), stop.wait(60), fly(*given)][2])
    pool = ThreadWorkerPool(lambda task: run_task(campaign, columns, run, task, stopped=stop.is_set), 2)
    next_result = pool.next

    def both_begun_then_stopped(patience_s):
        if not stop.is_set():
            assert all(begun.acquire(timeout=60) for _ in range(2))
            stop.set()
        return next_result(patience_s)

    monkeypatch.setattr(pool, "next", both_begun_then_stopped)
    tasks = [Task(first, first + 64) for first in range(0, 640, 64)]
    receipts = Dispatch(pool, run).receipts(tasks, stop.is_set)
    assert {task.first for done in receipts for task, _ in done} == {0, 64}
    pool.close(at_once=True)
    assert len([*(run / "cases").iterdir()]) == 2
