"""Crews: who flies the chunks of a run.  Threads of this process, processes of this machine, or a Dask cluster.

Every crew takes orders and brings back receipts, in any order.  Workers write their own parts; in process crews
nothing else but orders and receipts travels.

    threading   threads: no start-up, no copies; a crash of the model's own code ends the run
    loky        processes: a worker that dies takes nothing with it; budgets of time and memory can be kept
    dask        the same over a `distributed` scheduler, which dask-jobqueue starts on SLURM, PBS or LSF
"""

import os
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from mc_engine.backends import Backend
from mc_engine.campaign import Campaign
from mc_engine.chunks import Order, carry_out
from mc_engine.errors import WorkersLost
from mc_engine.interruption import unsignalled_children
from mc_engine.parts import Written
from mc_engine.store import Store
from mc_engine.worker_process import Site, begin_process, perform

THREADS_INSIDE = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
COUNT_AGAIN_S = 2.0  # a cluster grows and shrinks
START_S = 15.0  # to find a scheduler


@dataclass(frozen=True)
class Landing:
    """What became of an order: its receipt, which a probe has not, or the error that ended it.

    died : the worker is gone, or had not the memory; nothing is wrong with the order as far as is known.
    """

    order: Order
    written: Written | None = None
    error: BaseException | None = None
    died: bool = False


class Crew(ABC):
    """Workers that carry out orders.  `begin` only while there is room; one thread asks."""

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

    @abstractmethod
    def close(self, at_once: bool) -> None:
        """Let the workers go; at once: whatever they are doing."""


def crew_of(backend: Backend, store: Store, campaign: Campaign, workers: int) -> Crew:
    """The crew for a run, ready to take orders."""
    if backend.name == "threading":
        return ThreadCrew(partial(carry_out, campaign, store.columns, store.path), workers)
    site = Site(str(store.path.resolve()), str(Path(campaign.directory).resolve()), store.n_cases, backend.case_seconds)
    if backend.name == "loky":
        return ProcessCrew(site, workers, backend.memory_mib)
    return ClusterCrew(site, workers, backend)


class ThreadCrew(Crew):
    """Threads of this process; kernels hold no interpreter lock."""

    def __init__(self, perform: Callable[[Order], Written | None], workers: int):
        from multiprocessing.pool import ThreadPool

        super().__init__()
        self._perform, self._workers = perform, workers
        self._pool = ThreadPool(workers)  # whose threads do not hold up the end of the process

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

    def __init__(self, site: Site, workers: int, memory_mib: int | None):
        super().__init__()
        self._site, self._workers, self._memory = site, workers, memory_mib
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

        start = (self._memory, os.getpid())
        executor = ProcessPoolExecutor(1, initializer=begin_process, initargs=start, env=THREADS_INSIDE)
        self._executors.append(executor)
        return executor

    def _drop(self, executor: Any) -> None:
        self._executors.remove(executor)
        executor.shutdown(wait=False, kill_workers=True)

    def _land(self, order: Order, future: Any) -> None:
        from joblib.externals.loky.process_executor import BrokenProcessPool

        error = future.exception()
        if error is None:
            self._landed.put(Landing(order, future.result()))
        else:
            died = isinstance(error, BrokenProcessPool | MemoryError)
            self._landed.put(Landing(order, error=error, died=died))

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
        for executor in self._executors:
            executor.shutdown(wait=True, kill_workers=at_once)


class ClusterCrew(Crew):
    """The workers of a Dask cluster, as many as there are at any time."""

    def __init__(self, site: Site, workers: int, backend: Backend):
        from distributed import Client, LocalCluster

        super().__init__()
        self._site = site
        self._cluster = None
        if backend.scheduler is None:
            memory = "auto" if backend.memory_mib is None else f"{backend.memory_mib} MiB"
            self._cluster = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                dashboard_address=None,
                memory_limit=memory,
                preload=["mc_engine.worker_process"],
            )
        try:
            self._client = Client(backend.scheduler or self._cluster, timeout=START_S, set_as_default=False)
        except (OSError, ValueError) as error:  # nobody there, or no address
            raise WorkersLost(f"--scheduler {backend.scheduler}: there is no scheduler: {error}") from error
        self._futures: dict[Order, Any] = {}
        self._threads, self._counted = 1, -COUNT_AGAIN_S

    def room(self) -> int:
        if time.monotonic() - self._counted > COUNT_AGAIN_S:
            self._threads = max(1, sum(self._client.nthreads().values()))
            self._counted = time.monotonic()
        return self._threads  # and no more: an order that waits on a worker that dies would share the blame

    def begin(self, order: Order) -> None:
        future = self._client.submit(perform, self._site, order, pure=False, key=None)
        self._futures[order] = future  # a future that is forgotten is called off
        future.add_done_callback(partial(self._land, order))

    def _land(self, order: Order, future: Any) -> None:
        from distributed import KilledWorker

        if future.cancelled():
            message = "the scheduler has called off the work, or is gone"
            self._landed.put(Landing(order, error=WorkersLost(message)))
            return
        error = future.exception()
        if error is None:
            self._landed.put(Landing(order, future.result()))
        else:
            died = isinstance(error, KilledWorker | MemoryError)
            self._landed.put(Landing(order, error=error, died=died))

    def next(self, patience_s: float) -> Landing | None:
        landing = super().next(patience_s)
        if landing is not None:
            del self._futures[landing.order]
        return landing

    def close(self, at_once: bool) -> None:
        if at_once:
            self._client.cancel(list(self._futures.values()), force=True)
        self._client.close()
        if self._cluster is not None:
            self._cluster.close()
