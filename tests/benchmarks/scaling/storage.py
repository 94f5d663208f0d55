"""Runs on an object store, a server on this machine that speaks S3 (moto): publishing, fetching, merging of shards.

The server is a process of its own.  Its speed is not that of a store; requests and bytes for a part are.
"""

import os
import socket
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import fsspec
from aiobotocore.client import AioBaseClient

from mc_engine.campaign.loading import Campaign
from mc_engine.runner import runner
from mc_engine.runner.shards import Shard
from mc_engine.store.object_store import fetch, publish

LONGEST_S = 30.0  # for the server to begin
BUCKET = "s3://runs"


@contextmanager
def s3_server() -> Iterator[None]:
    """A server with the bucket, whose address and keys are in the environment within the block."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    server = subprocess.Popen(
        [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    access = {
        "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}",
        "AWS_ACCESS_KEY_ID": "key",
        "AWS_SECRET_ACCESS_KEY": "secret",
        "AWS_DEFAULT_REGION": "us-east-1",
    }
    try:
        deadline = time.monotonic() + LONGEST_S
        while not _answers(port) and time.monotonic() < deadline:
            time.sleep(0.1)
        with patch.dict(os.environ, access):
            fsspec.filesystem("s3").mkdir(BUCKET)
            yield
            fsspec.filesystem("s3").clear_instance_cache()
    finally:
        server.kill()
        server.wait()


def _answers(port: int) -> bool:
    with socket.socket() as trial:
        return trial.connect_ex(("127.0.0.1", port)) == 0


@dataclass(frozen=True)
class Step:
    """What one step took.  wall, processor : seconds, the latter of this process.  requests : by name, of S3."""

    wall: float
    processor: float
    requests: Counter[str]


def _timed(do: Callable[[], object]) -> Step:
    requests: Counter[str] = Counter()
    call = AioBaseClient._make_api_call

    async def counted(client: Any, operation: str, arguments: dict[str, Any]) -> Any:
        requests[operation] += 1
        return await call(client, operation, arguments)

    with patch.object(AioBaseClient, "_make_api_call", counted):
        wall, processor = time.perf_counter(), time.process_time()
        do()
        return Step(time.perf_counter() - wall, time.process_time() - processor, requests)


@dataclass(frozen=True)
class Stored:
    """Shards of a campaign, published, fetched and merged.  steps : by name.  part_bytes : all parts together."""

    parts: int
    part_bytes: int
    steps: dict[str, Step]

    def requests(self, steps: Iterable[str]) -> float:
        """Requests for a part of some steps together."""
        return sum(self.steps[name].requests.total() for name in steps) / self.parts


def shards_by_store(campaign: Campaign, folder: Path, chunk: int, shards: int = 2) -> Stored:
    """Fly the shards into `folder`, publish, check and publish again as `run --publish` does, fetch all, and merge."""
    pieces = [f"{campaign.cases}-{chunk}-{number}" for number in range(1, shards + 1)]
    for number, piece in enumerate(pieces, start=1):
        runner.run(campaign, folder / piece, chunk=chunk, shard=Shard(number, shards))
    files = [file for piece in pieces for file in (folder / piece / "cases").iterdir()]
    back = [folder / f"back-{piece}" for piece in pieces]
    steps = {
        "published": _timed(lambda: [publish(folder / piece, f"{BUCKET}/{piece}") for piece in pieces]),
        "checked in flight": _timed(lambda: [publish(folder / one, f"{BUCKET}/{one}", True) for one in pieces]),
        "published again": _timed(lambda: [publish(folder / one, f"{BUCKET}/{one}") for one in pieces]),
        "fetched": _timed(
            lambda: [fetch(f"{BUCKET}/{piece}", place) for piece, place in zip(pieces, back, strict=True)]
        ),
        "merged": _timed(lambda: runner.merge(folder / f"merged-{campaign.cases}", back, chunk=chunk)),
    }
    return Stored(len(files), sum(file.stat().st_size for file in files), steps)
