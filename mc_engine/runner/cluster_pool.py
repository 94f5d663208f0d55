"""The workers of a Dask cluster, as many as there are at any time.

The cluster is that of a scheduler that somebody started, or one of this machine, begun for the run and ended with it.
"""

import atexit
import logging
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from typing import Any

from mc_engine.errors import WorkersLost
from mc_engine.flight.chunks import Order
from mc_engine.runner.backends import Backend
from mc_engine.runner.worker_process import Site, perform
from mc_engine.runner.workers import Crew, Landing, landing_of
from mc_engine.safe_path import safe_import_path

COUNT_AGAIN_S = 2.0  # a cluster grows and shrinks
START_S = 15.0  # to find a scheduler
ANSWER_S = 5.0  # for a scheduler to count its workers
PATIENCE_S = 300.0  # without a worker, unless the user says
END_S = 30.0  # for a cluster of our own to end

# On our own cluster one death is enough to ask what the worker died of; Dask would try the same order four times.
# Its cluster also gives a worker up that is not there 15 s after any of its deaths, be it only because it is just
# being begun again after a later one: with a case that keeps killing, none would be left after a minute.
OUR_CLUSTER = {"distributed.scheduler.allowed-failures": 0, "distributed.deploy.lost-worker-timeout": "1000 days"}


class ClusterCrew(Crew):
    """A client of the scheduler; orders are its tasks."""

    def __init__(self, site: Site, workers: int, backend: Backend):
        super().__init__()
        self._site = site
        self._patience_s = PATIENCE_S if backend.patience_s is None else backend.patience_s
        self._futures: dict[Order, Any] = {}
        with ExitStack() as held:
            self._ours = _LocalWorkers(workers, held) if backend.scheduler is None else None
            self._client = held.enter_context(_client(self._ours.cluster if self._ours else backend.scheduler))
            self._held = held.pop_all()
        self.shared = self._ours is None  # a worker of somebody else's may have several threads
        self._threads, self._counted, self._manned = 0, -COUNT_AGAIN_S, time.monotonic()

    def room(self) -> int:
        self._count()
        # No more than threads: who waits on a worker that dies shares the blame.  One where there is none: a cluster
        # that adapts begins a worker only for work that waits.
        return max(1, self._threads)

    def _count(self) -> None:
        now = time.monotonic()
        if now - self._counted < COUNT_AGAIN_S:
            return
        if self._ours is not None:
            self._ours.replace_lost()
        self._threads = _threads(self._client)
        self._counted = time.monotonic()
        if self._threads:
            self._manned = self._counted

    def deserted_s(self) -> float:
        self._count()
        return 0.0 if self._threads else time.monotonic() - self._manned

    def begin(self, order: Order) -> None:
        if self._client.status in ("closing", "closed"):
            raise WorkersLost("the scheduler is gone")
        future = self._client.submit(perform, self._site, order, pure=False, key=None)
        self._futures[order] = future  # a future that is forgotten is called off
        future.add_done_callback(partial(self._land, order))

    def _land(self, order: Order, future: Any) -> None:
        from distributed import KilledWorker

        if future.cancelled():
            lost = WorkersLost("the scheduler has called off the work, or is gone")
            self._landed.put(Landing(order, error=lost))
        else:
            self._landed.put(landing_of(order, future, KilledWorker))

    def next(self, patience_s: float) -> Landing | None:
        landing = super().next(patience_s)
        if landing is not None:
            del self._futures[landing.order]
            self._manned = time.monotonic()
        elif self.deserted_s() > self._patience_s:
            raise WorkersLost(f"the scheduler has had no worker for {self._patience_s:g} s (--patience waits longer)")
        return landing

    def close(self, at_once: bool) -> None:
        if at_once and self._client.status == "running":
            with suppress(OSError):
                self._client.cancel(list(self._futures.values()), force=True)
        self._held.close()


class _LocalWorkers:
    """A cluster of this machine: processes of one thread, each begun again by its nanny when it dies."""

    def __init__(self, workers: int, held: ExitStack):
        import dask
        from distributed import LocalCluster
        from distributed.deploy.spec import close_clusters

        # At the end of Python it would close a cluster that a second signal left half made, and raise; ours is closed
        # by `_close`, and its processes end with this one.
        atexit.unregister(close_clusters)
        held.enter_context(safe_import_path())
        held.enter_context(dask.config.set(OUR_CLUSTER))
        self._workers = workers
        self.cluster = LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            dashboard_address="127.0.0.1:0",  # any port: 8787 may be that of another run
            scheduler_kwargs={"dashboard": False},
            silence_logs=logging.CRITICAL,  # a worker that dies is no news
            memory_limit=0,  # Dask's own limit ends or pauses workers; `Site.memory_mib` makes allocations fail
            preload=["mc_engine.runner.worker_process"],
        )
        held.callback(self._close)

    def replace_lost(self) -> None:
        """New workers for those whose nanny has given up, as where the system allowed it no process."""
        from distributed.core import Status

        lost = [name for name, nanny in list(self.cluster.workers.items()) if nanny.status == Status.closed]
        for name in lost:
            del self.cluster.workers[name]
        if lost:
            self.cluster.scale(self._workers)

    def _close(self) -> None:
        with suppress(TimeoutError):  # what is left ends with this process
            self.cluster.close(timeout=END_S)


@contextmanager
def _client(scheduler: Any) -> Iterator[Any]:
    """A client of a scheduler, by its address or its cluster; left without waiting for one that does not answer."""
    from distributed import Client

    try:
        client = Client(scheduler, timeout=START_S, set_as_default=False)
    except (OSError, ValueError) as error:  # nobody there, or no address
        raise WorkersLost(f"--scheduler {scheduler}: there is no scheduler: {error}") from error
    try:
        yield client
    finally:
        with suppress(TimeoutError):
            client.close(timeout=ANSWER_S)


def _threads(client: Any) -> int:
    """How many threads all workers of a scheduler have, none where it does not answer."""
    if client.status != "running":
        return 0
    try:
        return sum(client.sync(client.scheduler.ncores, callback_timeout=ANSWER_S).values())
    except OSError:  # a TimeoutError, too
        return 0
