"""Crews: who flies the chunks of a run.  Threads of this process, processes of this machine, or a Dask cluster.

Every crew takes orders and brings back receipts, in any order.  Workers write their own parts; in process crews
nothing else but orders and receipts travels.

    threading   threads: no start-up, no copies; a crash of the model's own code ends the run
    loky        processes: a worker that dies takes nothing with it; budgets of time and memory can be kept
    dask        the same over a `distributed` scheduler, which dask-jobqueue starts on SLURM, PBS or LSF
"""

import os
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

from mc_engine.campaign.loading import Campaign
from mc_engine.flight.chunks import Order, carry_out
from mc_engine.interruption import unsignalled_children
from mc_engine.runner.backends import Backend
from mc_engine.runner.cluster_pool import ClusterCrew
from mc_engine.runner.worker_process import Site, begin_process, perform
from mc_engine.runner.workers import Crew, Landing, landing_of
from mc_engine.safe_path import safe_import_path
from mc_engine.store.parts import Written
from mc_engine.store.store import Store

_MOST_THREADS = 1024  # a system has room for some ten thousand, and no machine has as many cores
THREADS_INSIDE = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}


def crew_of(backend: Backend, store: Store, campaign: Campaign, workers: int) -> Crew:
    """The crew for a run, ready to take orders."""
    if backend.name == "threading":
        return ThreadCrew(partial(carry_out, campaign, store.columns, store.path), workers)
    site = Site(
        str(store.path.resolve()),
        str(Path(campaign.directory).resolve()),
        store.n_cases,
        backend.case_seconds,
        backend.memory_mib,
    )
    if backend.name == "loky":
        return ProcessCrew(site, workers)
    return ClusterCrew(site, workers, backend)


class ThreadCrew(Crew):
    """Threads of this process; kernels hold no interpreter lock."""

    def __init__(self, perform: Callable[[Order], Written], workers: int):
        from multiprocessing.pool import ThreadPool

        super().__init__()
        self._perform, self._workers = perform, min(workers, _MOST_THREADS)
        self._pool = ThreadPool(self._workers)  # whose threads do not hold up the end of the process

    def room(self) -> int:
        return self._workers + 1  # one waits, so that none of them has to

    def begin(self, order: Order) -> None:
        self._pool.apply_async(
            self._perform,
            (order,),
            callback=lambda written: self._landed.put(Landing(order, written)),
            error_callback=lambda error: self._landed.put(Landing(order, error=error)),
        )

    def close(self, at_once: bool) -> None:
        self._pool.terminate()


class ProcessCrew(Crew):
    """Processes of this machine, each an executor of its own: when one dies, it is known of which order."""

    def __init__(self, site: Site, workers: int):
        super().__init__()
        self._site, self._workers = site, workers
        self._held = ExitStack()
        self._held.enter_context(safe_import_path())
        self._executors: list[Any] = []
        self._idle: list[Any] = []
        self._busy: dict[Order, Any] = {}

    def room(self) -> int:
        return self._workers

    def begin(self, order: Order) -> None:
        from joblib.externals.loky.process_executor import BrokenProcessPool

        executor = self._idle.pop() if self._idle else self._new()
        with unsignalled_children():
            try:
                future = executor.submit(perform, self._site, order)
            except BrokenProcessPool:  # its worker died while it had nothing to do
                self._drop(executor)
                executor = self._new()
                future = executor.submit(perform, self._site, order)
        self._busy[order] = executor
        future.add_done_callback(partial(self._land, order))

    def _new(self) -> Any:
        from joblib.externals.loky import ProcessPoolExecutor

        executor = ProcessPoolExecutor(1, initializer=begin_process, initargs=(os.getpid(),), env=THREADS_INSIDE)
        self._executors.append(executor)
        return executor

    def _drop(self, executor: Any) -> None:
        self._executors.remove(executor)
        executor.shutdown(wait=False, kill_workers=True)

    def _land(self, order: Order, future: Any) -> None:
        from joblib.externals.loky.process_executor import BrokenProcessPool

        self._landed.put(landing_of(order, future, BrokenProcessPool))

    def next(self, patience_s: float) -> Landing | None:
        landing = super().next(patience_s)
        if landing is not None:
            executor = self._busy.pop(landing.order)
            if landing.died:
                self._drop(executor)
            else:
                self._idle.append(executor)
        return landing

    def close(self, at_once: bool) -> None:
        with self._held:
            for executor in self._executors:
                executor.shutdown(wait=True, kill_workers=at_once)
