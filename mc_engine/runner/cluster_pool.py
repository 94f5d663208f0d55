"""A worker pool on a Dask cluster, whose number of workers may change while the run is flying.

The cluster belongs to a scheduler that the user started, or is a local one that this pool starts and ends.
"""

import atexit
import logging
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from typing import Any

from mc_engine.errors import WorkersLost
from mc_engine.flight.chunks import Task
from mc_engine.runner.backends import Backend
from mc_engine.runner.worker_process import WorkerSetup, run_in_worker
from mc_engine.runner.workers import Result, WorkerPool, result_of
from mc_engine.safe_path import safe_import_path

COUNT_AGAIN_S = 2.0  # between two counts of the workers
START_S = 15.0  # to connect to a scheduler
ANSWER_S = 5.0  # for a scheduler to count its workers
PATIENCE_S = 300.0  # without a worker, by default
END_S = 30.0  # for the local cluster to end

# Dask would try the task of a dead worker four times; `Dispatch` decides that itself.  Dask would also drop a worker
# that is not back 15 s after any of its deaths, so that a case that keeps killing workers would leave none.
LOCAL_CLUSTER = {"distributed.scheduler.allowed-failures": 0, "distributed.deploy.lost-worker-timeout": "1000 days"}


class ClusterWorkerPool(WorkerPool):
    """A client of the scheduler, to which each task of the run is one Dask task."""

    def __init__(self, setup: WorkerSetup, workers: int, backend: Backend):
        super().__init__()
        self._setup = setup
        self._patience_s = PATIENCE_S if backend.patience_s is None else backend.patience_s
        self._futures: dict[Task, Any] = {}
        with ExitStack() as held:
            self._local = _LocalWorkers(workers, held) if backend.scheduler is None else None
            self._client = held.enter_context(_client(self._local.cluster if self._local else backend.scheduler))
            self._held = held.pop_all()
        self.shared = self._local is None  # workers of the user's scheduler may have several threads
        self._threads, self._counted_s, self._last_worker_s = 0, -COUNT_AGAIN_S, time.monotonic()

    def room(self) -> int:
        self._count()
        # No more tasks than threads: a task that waits on a worker which dies would be suspected, too.  At least one:
        # a cluster that adapts its size starts a worker only when a task waits.
        return max(1, self._threads)

    def _count(self) -> None:
        now = time.monotonic()
        if now - self._counted_s < COUNT_AGAIN_S:
            return
        if self._local is not None:
            self._local.replace_lost()
        self._threads = _threads(self._client)
        self._counted_s = time.monotonic()
        if self._threads:
            self._last_worker_s = self._counted_s

    def without_workers_s(self) -> float:
        self._count()
        return 0.0 if self._threads else time.monotonic() - self._last_worker_s

    def begin(self, task: Task) -> None:
        if self._client.status in ("closing", "closed"):
            raise WorkersLost("the scheduler is gone")
        future = self._client.submit(run_in_worker, self._setup, task, pure=False, key=None)
        self._futures[task] = future  # Dask cancels a task whose future is garbage-collected
        future.add_done_callback(partial(self._on_done, task))

    def _on_done(self, task: Task, future: Any) -> None:
        from distributed import KilledWorker

        if future.cancelled():
            lost = WorkersLost("the scheduler has cancelled the work, or is gone")
            self._results.put(Result(task, error=lost))
        else:
            self._results.put(result_of(task, future, KilledWorker))

    def next(self, patience_s: float) -> Result | None:
        result = super().next(patience_s)
        if result is not None:
            del self._futures[result.task]
            self._last_worker_s = time.monotonic()
        elif self.without_workers_s() > self._patience_s:
            raise WorkersLost(f"the scheduler has had no worker for {self._patience_s:g} s (--patience waits longer)")
        return result

    def close(self, at_once: bool) -> None:
        if at_once and self._client.status == "running":
            with suppress(OSError):
                self._client.cancel(list(self._futures.values()), force=True)
        self._held.close()


class _LocalWorkers:
    """A cluster on this machine: processes of one thread, each restarted by its nanny when it dies."""

    def __init__(self, workers: int, held: ExitStack):
        import dask
        from distributed import LocalCluster
        from distributed.deploy.spec import close_clusters

        # At exit it would raise on a cluster that a second signal left half started.  `_close` closes this one, and
        # its processes end with this process.
        atexit.unregister(close_clusters)
        held.enter_context(safe_import_path())
        held.enter_context(dask.config.set(LOCAL_CLUSTER))
        self._workers = workers
        try:
            self.cluster = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                dashboard_address="127.0.0.1:0",  # any free port: another run may use 8787
                scheduler_kwargs={"dashboard": False},
                silence_logs=logging.CRITICAL,  # `Dispatch` handles dead workers
                memory_limit=0,  # Dask would kill or pause workers; `memory_mib` makes allocations fail
                preload=["mc_engine.runner.worker_process"],
            )
        except RuntimeError as error:
            why = f"the workers of this machine do not start: {str(error).rstrip('.')}"
            below = 'in a script, runs with Dask stand below `if __name__ == "__main__":`, since workers read it, too'
            raise WorkersLost(f"{why}; {below}") from error
        held.callback(self._close)

    def replace_lost(self) -> None:
        """Start new workers for those whose nanny has given up, for example because no process could be started."""
        from distributed.core import Status

        lost = [name for name, nanny in list(self.cluster.workers.items()) if nanny.status == Status.closed]
        for name in lost:
            del self.cluster.workers[name]
        if lost:
            self.cluster.scale(self._workers)

    def _close(self) -> None:
        with suppress(TimeoutError):  # the remaining processes end with this one
            self.cluster.close(timeout=END_S)


@contextmanager
def _client(scheduler: Any) -> Iterator[Any]:
    """A client of a scheduler, by its address or its cluster; left without waiting for one that does not answer."""
    from distributed import Client

    try:
        client = Client(scheduler, timeout=START_S, set_as_default=False)
    except Exception as error:  # nobody there, or a protocol that cannot be used
        raise WorkersLost(f"--scheduler {scheduler}: there is no scheduler: {error}") from error
    log = logging.getLogger("distributed.client")
    level = log.level
    log.setLevel(logging.CRITICAL)  # it would print tracebacks where the scheduler is gone, which `WorkersLost` tells
    try:
        yield client
    finally:
        with suppress(TimeoutError):
            client.close(timeout=ANSWER_S)
        log.setLevel(level)


def _threads(client: Any) -> int:
    """How many threads all workers of a scheduler have, none where it does not answer."""
    if client.status != "running":
        return 0
    try:
        return sum(client.sync(client.scheduler.ncores, callback_timeout=ANSWER_S).values())
    except OSError:  # a TimeoutError, too
        return 0
