"""Runs on a Dask cluster of processes of this machine: what the workers, the scheduler and the one writer take.

The writer is the process that commands the run: it gives out the parts and commits what the workers wrote.  It,
the scheduler and each worker are processes of their own, so that their processor times can be told apart.
"""

import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import psutil
from distributed import Client

from mc_engine import load_campaign
from mc_engine.campaign.loading import Campaign
from mc_engine.flight.chunks import NOMINAL_TASK
from mc_engine.runner import runner, worker_process
from mc_engine.runner.backends import Backend
from mc_engine.runner.cluster_pool import ClusterWorkerPool
from mc_engine.store.store import Store

ROOT = Path(__file__).resolve().parents[3]
LONGEST_S = 60.0  # for the processes of a cluster to begin
SETTINGS = {
    "PYTHONPATH": str(ROOT),
    "OMP_NUM_THREADS": "1",
    "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0",  # as how_to/cluster.md says
}


@dataclass(frozen=True)
class Cluster:
    """A scheduler and its workers, of one thread each and without a nanny that would start them again."""

    address: str
    scheduler: psutil.Process
    workers: tuple[psutil.Process, ...]
    client: Client


@contextmanager
def cluster_of(workers: int) -> Iterator[Cluster]:
    """A cluster of so many workers, ended with the block."""
    with ExitStack() as held:
        folder = Path(held.enter_context(tempfile.TemporaryDirectory()))
        file = folder / "scheduler.json"

        def started(module: str, *options: str) -> psutil.Process:
            command = [sys.executable, "-m", f"distributed.cli.{module}", "--no-dashboard", *options]
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            process = subprocess.Popen(command, env={**os.environ, **SETTINGS}, cwd=folder, **quiet)
            held.callback(process.wait)
            held.callback(process.kill)
            return psutil.Process(process.pid)

        place = ["--host", "127.0.0.1", "--scheduler-file", str(file)]
        scheduler = started("dask_scheduler", *place, "--port", "0")
        deadline = time.monotonic() + LONGEST_S
        while not file.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        options = [*place, "--nthreads", "1", "--no-nanny", "--memory-limit", "0"]
        options += ["--preload", "mc_engine.runner.worker_process", "--local-directory", str(folder)]
        processes = tuple(started("dask_worker", *options) for _ in range(workers))
        client = held.enter_context(Client(scheduler_file=str(file), set_as_default=False))
        client.wait_for_workers(workers, timeout=LONGEST_S)
        yield Cluster(client.scheduler.address, scheduler, processes, client)


@dataclass(frozen=True)
class Clocks:
    """Wall time and processor times so far [s]; committed : number of parts."""

    wall: float
    writer: float
    scheduler: float
    workers: float
    committed: int

    def since(self, before: "Clocks") -> "Clocks":
        return Clocks(*(getattr(self, name) - getattr(before, name) for name in self.__dataclass_fields__))


def _processor_s(process: psutil.Process) -> float:
    times = process.cpu_times()
    return times.user + times.system


@dataclass(frozen=True)
class Flown:
    """What a run took between its first parts and its last one.

    start_s : for one worker to load the campaign.  disk_wait_s : of the writer, at each part.
    begun_cases : cases that were given to workers, those that were given anew among them.
    """

    store: Store
    clocks: Clocks
    start_s: float
    disk_wait_s: float
    begun_cases: int


def plain(name: str, cases: int) -> Campaign:
    """A shipped campaign of so many cases, whose file has no time histories and no flights for sensitivities."""
    whole = load_campaign(name, cases=cases)
    text = re.sub(r"^\[(sensitivity|retention)\][^\[]*", "", whole.text, flags=re.MULTILINE)
    text += "\n[retention]\nhistories = { nominal = false }\n"
    return load_campaign(name, cases=cases, text=text, directory=whole.directory)


def fly(
    cluster: Cluster, campaign: Campaign, out: Path, chunk: int, at_part: Callable[[int], None] = lambda _: None
) -> Flown:
    """A run on the cluster, measured from two parts a worker on.  at_part : called with the number of parts."""
    workers = len(cluster.workers)
    seen: list[Clocks] = []
    starts, waits, begun = [], [], []

    def clocks(parts: int) -> Clocks:
        flew = sum(_processor_s(process) for process in cluster.workers)
        return Clocks(time.perf_counter(), time.process_time(), _processor_s(cluster.scheduler), flew, parts)

    def progress(done: int, total: int, failed: int) -> None:
        if done == 0:
            starts.append(_load_in_workers(cluster, campaign, out))
        parts = done // chunk
        at_part(parts)
        if (parts >= 2 * workers and not seen) or (done == total and seen):
            seen.append(clocks(parts))

    publish, begin_task = Store.publish, ClusterWorkerPool.begin

    def timed_publish(store: Store, *written: Any) -> None:
        wall, processor = time.perf_counter(), time.thread_time()
        publish(store, *written)
        waited = time.perf_counter() - wall - (time.thread_time() - processor)
        waits.extend([waited / len(written)] * len(written))

    def counted_begin(pool: ClusterWorkerPool, task: Any) -> None:
        if task is not NOMINAL_TASK:
            begun.append(task.stop - task.first)
        begin_task(pool, task)

    with patch.object(Store, "publish", timed_publish), patch.object(ClusterWorkerPool, "begin", counted_begin):
        store = runner.run(campaign, out, chunk=chunk, backend=Backend("dask", cluster.address), progress=progress)
    # the median: on a machine with other work some waits are for a core
    return Flown(store, seen[-1].since(seen[0]), starts[0], statistics.median(waits), sum(begun))


def _load_in_workers(cluster: Cluster, campaign: Campaign, run: Path) -> float:
    """Have every worker load the campaign and its kernel, as its first part would; seconds of the first, alone."""
    directory = str(Path(campaign.directory).resolve())
    setup = worker_process.WorkerSetup(str(run.resolve()), directory, campaign.cases)
    first, *others = cluster.client.scheduler_info(n_workers=-1)["workers"]
    begin = time.perf_counter()
    cluster.client.run(load, setup, workers=[first])
    taken = time.perf_counter() - begin
    cluster.client.run(load, setup, workers=others)
    return taken


def load(setup: worker_process.WorkerSetup) -> None:
    """What a worker does before its first part."""
    worker_process._campaign(setup)


@dataclass(frozen=True)
class Recovery:
    """What became of a run of which half of the workers were killed.

    first_part_s : from the kill to the next part that was committed.  again_cases : cases that were flown again.
    lost, doubled : rows.  equal : every part has the bytes of a run in threads.
    """

    workers: int
    killed: int
    first_part_s: float
    again_cases: int
    lost: int
    doubled: int
    equal: bool


def recovery(workers: int, campaign: Campaign, folder: Path, chunk: int) -> Recovery:
    """Kill half of the workers when half of the parts are committed, and wait for the end of the run."""
    half, instants = campaign.cases // chunk // 2, []
    with cluster_of(workers) as cluster:

        def kill_half(parts: int) -> None:
            if parts == half:
                for process in cluster.workers[: workers // 2]:
                    process.kill()
            if parts in (half, half + 1):
                instants.append(time.perf_counter())

        flown = fly(cluster, campaign, folder / "halved", chunk, kill_half)
        left = len(cluster.client.scheduler_info(n_workers=-1)["workers"])
    whole = runner.run(campaign, folder / "whole", chunk=chunk)
    ids = flown.store.cases(["case_id"])["case_id"]
    digests = [{part.file: part.sha256 for part in store.parts} for store in (flown.store, whole)]
    return Recovery(
        workers,
        workers - left,
        instants[1] - instants[0],
        flown.begun_cases - campaign.cases,
        campaign.cases - ids.nunique(),
        len(ids) - ids.nunique(),
        digests[0] == digests[1],
    )
