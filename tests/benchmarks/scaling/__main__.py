"""Runs on a Dask cluster of this machine and over an object store, and what follows from them for many nodes.

    python -m tests.benchmarks.scaling              # prints the tables of documentation/explanation/scaling.md
    python -m tests.benchmarks.scaling --write      # puts them there
    python -m tests.benchmarks.scaling --parts 24 --small-parts 100 --workers 1 2

Five to ten minutes on two cores that do other work besides.
"""

import argparse
import sys
import tempfile
from datetime import UTC, datetime
from pathlib import Path

from mc_engine.flight.chunks import LARGEST_CHUNK
from tests.benchmarks.scaling import tables
from tests.benchmarks.scaling.cluster import Flown, Recovery, cluster_of, fly, plain, recovery
from tests.benchmarks.scaling.model import ASSUMPTIONS, Costs
from tests.benchmarks.scaling.storage import Stored, s3_server, shards_by_store

CAMPAIGN = "deorbit"
PART, SMALL_PART = 4096, 16  # cases; those of a small part cost next to nothing beside the part itself


def measured(
    workers: list[int], parts: int, small_parts: int, large_parts: int, folder: Path
) -> tuple[dict[int, Flown], dict[int, Flown], Recovery, dict[int, Stored]]:
    """Flights of large and small parts by number of workers, one that loses workers, shards by cases of a part."""
    large, small = {}, {}
    for count in workers:
        tell(f"{count} workers")
        with cluster_of(count) as cluster:
            large[count] = fly(cluster, plain(CAMPAIGN, parts * PART), folder / f"large-{count}", PART)
            small[count] = fly(
                cluster, plain(CAMPAIGN, small_parts * SMALL_PART), folder / f"small-{count}", SMALL_PART
            )
    tell("workers that are killed")
    killed = recovery(max(workers), plain(CAMPAIGN, parts * PART), folder, PART)
    stored = {}
    for count, chunk in ((small_parts // 2, SMALL_PART), (large_parts, LARGEST_CHUNK)):
        tell(f"shards with parts of {chunk} cases")
        with s3_server():
            stored[chunk] = shards_by_store(plain(CAMPAIGN, count * chunk), folder, chunk)
    return large, small, killed, stored


def tell(what: str) -> None:
    """Say what is measured now, beside the tables."""
    print(what, file=sys.stderr, flush=True)


def costs(large: dict[int, Flown], small: dict[int, Flown], stored: dict[int, Stored]) -> Costs:
    """The measured costs to three digits, as the page shows them, with the assumptions."""
    alone, most = small[min(small)], small[max(small)]
    alone_parts, most_parts = alone.clocks.committed, most.clocks.committed
    small_shards, large_shards = (stored[chunk] for chunk in (SMALL_PART, LARGEST_CHUNK))
    published, checked, again, fetched, merged = large_shards.steps.values()
    publishing, fetching = ("published", "checked in flight", "published again"), ("fetched",)
    cases = large_shards.parts * LARGEST_CHUNK
    whole = large[min(large)].clocks
    found = {
        "case_us": 1e6 * whole.workers / (whole.committed * PART),
        "part_idle_ms": 1e3 * (alone.clocks.wall - alone.clocks.workers) / alone_parts,
        "writer_ms": 1e3 * (most.clocks.writer / most_parts + most.disk_wait_s),
        "scheduler_ms": 1e3 * most.clocks.scheduler / most_parts,
        "start_s": large[min(large)].start_s,
        "case_bytes": large_shards.part_bytes / cases,
        "publish_requests": small_shards.requests(publishing),
        "publish_more_requests": more_requests(publishing, small_shards, large_shards),
        "publish_case_us": 1e6 * published.processor / cases,
        "check_case_us": 1e6 * checked.wall / cases,
        "again_case_us": 1e6 * again.processor / cases,
        "fetch_requests": small_shards.requests(fetching),
        "fetch_more_requests": more_requests(fetching, small_shards, large_shards),
        "fetch_case_us": 1e6 * fetched.processor / cases,
        "merge_case_us": 1e6 * merged.wall / cases,
    }
    return Costs(**{name: float(f"{value:.3g}") for name, value in found.items()}, **ASSUMPTIONS)


def more_requests(steps: tuple[str, ...], small: Stored, large: Stored) -> float:
    """Requests that a part of some steps takes more for each 1000 cases that it is larger."""
    return 1e3 * (large.requests(steps) - small.requests(steps)) / (LARGEST_CHUNK - SMALL_PART)


def report(options: argparse.Namespace) -> str:
    """All tables with what each was measured on."""
    with tempfile.TemporaryDirectory() as folder:
        sizes = options.parts, options.small_parts, options.large_parts
        large, small, killed, stored = measured(options.workers, *sizes, Path(folder))
    computed = costs(large, small, stored)
    return "\n\n".join([
        f"Measured on {datetime.now(UTC):%d %B %Y}, {options.machine}, by `python -m tests.benchmarks.scaling`.",
        f"The campaign `{CAMPAIGN}`, {options.parts} parts of {PART:,} cases each. Two workers have a core each, more "
        "share two:",
        tables.throughput(large, PART),
        f"Seconds for 1000 parts of {SMALL_PART} cases ({options.small_parts} were flown): wall time, and processor "
        "time of workers, writer and scheduler:",
        tables.per_thousand_parts(small),
        f"Half of the workers killed after half of {options.parts} parts of {PART:,} cases, none begun in their place:",
        tables.recovered([killed]),
        "Two shards, published to an S3 server on the same machine, fetched and merged:",
        tables.stored_parts(stored),
        "What the times of many nodes are computed from:",
        tables.cost_table(computed),
        *tables.extrapolated(computed),
    ])  # fmt: skip


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.scaling")
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2, 4, 8])
    parser.add_argument("--parts", type=int, default=40, help=f"of {PART} cases; more than twice the workers")
    parser.add_argument("--small-parts", type=int, default=200, help=f"of {SMALL_PART} cases")
    parser.add_argument("--large-parts", type=int, default=4, help=f"of {LARGEST_CHUNK} cases, on the object store")
    parser.add_argument("--machine", default="two shared cores of an AMD EPYC", help="in words")
    parser.add_argument("--write", action="store_true", help=f"into {tables.PAGE.name}")
    options = parser.parse_args()
    if min(options.parts, options.small_parts) <= 2 * max(options.workers):
        parser.error("measuring begins after two parts a worker; more parts, or fewer workers")
    text = report(options)
    if options.write:
        tables.written_into(tables.PAGE, text)
    else:
        print(text)
