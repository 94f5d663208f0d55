"""The worker pools of a run: threads of this process, processes of this machine, or a Dask cluster.

Workers write the parts themselves; only tasks and results travel between processes.

    threading   threads: no start-up time and no copies; a crash in model code ends the run
    loky        processes: a crash ends one worker only; limits on time and memory can be set
    cuda        threads that let NVIDIA cards fly the cases of a compiled model
    auto        cuda if it was measured to be faster, otherwise threading
    dask        processes of a `distributed` scheduler, which dask-jobqueue starts on SLURM, PBS or LSF
"""

import os
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

from mc_engine.campaign.loading import Campaign
from mc_engine.flight.chunks import Task, run_task
from mc_engine.interruption import unsignalled_children
from mc_engine.runner.backends import Backend, flyer_on
from mc_engine.runner.cluster_pool import ClusterWorkerPool
from mc_engine.runner.worker_process import WorkerSetup, begin_process, run_in_worker
from mc_engine.runner.workers import Result, WorkerPool, keep_freed_memory, result_of
from mc_engine.safe_path import safe_import_path
from mc_engine.store.parts import Written
from mc_engine.store.store import Store

_MOST_THREADS = 1024  # a system allows some ten thousand; more than its cores gain nothing
THREADS_INSIDE = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def pool_of(
    backend: Backend, store: Store, campaign: Campaign, workers: int, stopped: Callable[[], bool]
) -> WorkerPool:
    """The worker pool that `backend` asks for, ready to take tasks.  stopped : whether the run is to end."""
    if backend.name in ("threading", "cuda", "auto"):
        flyer = flyer_on(backend.name, campaign)
        run = partial(run_task, campaign, store.columns, store.path, stopped=stopped, flyer=flyer)
        return ThreadWorkerPool(run, workers)
    setup = WorkerSetup(
        str(store.path.resolve()),
        str(Path(campaign.directory).resolve()),
        store.n_cases,
        backend.case_seconds,
        backend.memory_mib,
    )
    if backend.name == "loky":
        return ProcessWorkerPool(setup, workers)
    return ClusterWorkerPool(setup, workers, backend)


class ThreadWorkerPool(WorkerPool):
    """Threads of this process; compiled kernels release the interpreter lock."""

    in_process = True

    def __init__(self, run_in_worker: Callable[[Task], Written], workers: int):
        from multiprocessing.pool import ThreadPool

        super().__init__()
        keep_freed_memory()
        self._run_task, self._workers = run_in_worker, min(workers, _MOST_THREADS)
        self._pool = ThreadPool(self._workers)  # daemon threads: they do not delay the end of the process

    def room(self) -> int:
        # As many more tasks wait in the queue, so that threads are busy while the parts of others are published.  A run
        # that is stopped begins none of them.
        return 2 * self._workers

    def begin(self, task: Task) -> None:
        self._pool.apply_async(
            self._run_task,
            (task,),
            callback=lambda written: self._results.put(Result(task, written)),
            error_callback=lambda error: self._results.put(Result(task, error=error)),
        )

    def close(self, at_once: bool) -> None:
        self._pool.terminate()


class ProcessWorkerPool(WorkerPool):
    """Processes of this machine.  Each is an executor of its own, so that a death is known to belong to one task."""

    def __init__(self, setup: WorkerSetup, workers: int):
        super().__init__()
        self._setup, self._workers = setup, workers
        self._held = ExitStack()
        self._held.enter_context(safe_import_path())
        self._executors: list[Any] = []
        self._idle: list[Any] = []
        self._busy: dict[Task, Any] = {}

    def room(self) -> int:
        return self._workers

    def begin(self, task: Task) -> None:
        from joblib.externals.loky.process_executor import BrokenProcessPool

        executor = self._idle.pop() if self._idle else self._start()
        with unsignalled_children():
            try:
                future = executor.submit(run_in_worker, self._setup, task)
            except BrokenProcessPool:  # the worker died while it was idle
                self._drop(executor)
                executor = self._start()
                future = executor.submit(run_in_worker, self._setup, task)
        self._busy[task] = executor
        future.add_done_callback(partial(self._on_done, task))

    def _start(self) -> Any:
        from joblib.externals.loky import ProcessPoolExecutor

        executor = ProcessPoolExecutor(1, initializer=begin_process, initargs=(os.getpid(),), env=THREADS_INSIDE)
        self._executors.append(executor)
        return executor

    def _drop(self, executor: Any) -> None:
        self._executors.remove(executor)
        executor.shutdown(wait=False, kill_workers=True)

    def _on_done(self, task: Task, future: Any) -> None:
        from joblib.externals.loky.process_executor import BrokenProcessPool

        self._results.put(result_of(task, future, BrokenProcessPool))

    def next(self, patience_s: float) -> Result | None:
        result = super().next(patience_s)
        if result is not None:
            executor = self._busy.pop(result.task)
            if result.died:
                self._drop(executor)
            else:
                self._idle.append(executor)
        return result

    def close(self, at_once: bool) -> None:
        with self._held:
            for executor in self._executors:
                executor.shutdown(wait=True, kill_workers=at_once)
