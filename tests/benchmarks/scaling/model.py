"""How long a campaign takes on many nodes, from what was measured on one machine, and where it stops scaling.

A run takes as long as the busiest of those that take part in it, and its start.  Processors of the nodes are taken to
be as fast as those that were measured.  Nodes that fail and the queue of a batch system are not in it.  More cases than
a run may have are several runs, one after the other.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import ceil
from typing import Any

from mc_engine.flight.chunks import LARGEST_CHUNK, chunk_size
from mc_engine.status import MOST_CASES
from mc_engine.store.object_store import AT_ONCE

ASSUMED, MEASURED = "assumed", "measured"


def _cost(what: str, unit: str, source: str = MEASURED) -> Any:
    return field(metadata={"what": what, "unit": unit, "source": source})


@dataclass(frozen=True)
class Costs:
    """What the model computes from; each field's metadata have its meaning, unit and source."""

    case_us: float = _cost("processor time of a worker for a case", "µs")
    part_idle_ms: float = _cost("a worker waits between two parts, for disk and next part", "ms")
    writer_ms: float = _cost("the writer commits a part", "ms")
    scheduler_ms: float = _cost("processor time of the scheduler for a part", "ms")
    start_s: float = _cost("a worker loads the campaign", "s")
    case_bytes: float = _cost("a case in Parquet", "B")
    publish_requests: float = _cost("requests to publish a small part, to check it and to publish it again", "1")
    publish_more_requests: float = _cost("further requests of these for each 1000 cases of a part", "1")
    publish_case_us: float = _cost("processor time to publish a case", "µs")
    check_case_us: float = _cost("time to check a published case in flight", "µs")
    again_case_us: float = _cost("processor time to publish a case again, which is there", "µs")
    fetch_requests: float = _cost("requests to fetch a small part", "1")
    fetch_more_requests: float = _cost("further requests to fetch for each 1000 cases of a part", "1")
    fetch_case_us: float = _cost("processor time to fetch a case", "µs")
    merge_case_us: float = _cost("merging a case", "µs")
    node_cores: float = _cost("cores of a node, a worker each", "1", ASSUMED)
    shared_gb_s: float = _cost("file system that all nodes of a cluster share", "GB/s", ASSUMED)
    link_gb_s: float = _cost("link of a machine to the object store", "GB/s", ASSUMED)
    request_ms: float = _cost("a request to the object store", "ms", ASSUMED)
    fetches: float = _cost("shards that are fetched at a time", "1", ASSUMED)


ASSUMPTIONS = {"node_cores": 64.0, "shared_gb_s": 10.0, "link_gb_s": 1.0, "request_ms": 30.0, "fetches": 8.0}


def part_s(costs: Costs, part_cases: int) -> float:
    """Seconds that one worker takes for a part of so many cases, with what it waits."""
    return 1e-6 * part_cases * costs.case_us + 1e-3 * costs.part_idle_ms


def on_one_scheduler(costs: Costs, cases: float, nodes: int, part_cases: int = LARGEST_CHUNK) -> dict[str, float]:
    """Seconds that each is busy with a run on one Dask scheduler, by name."""
    parts = ceil(cases / part_cases)
    return {
        "workers": ceil(parts / (nodes * costs.node_cores)) * part_s(costs, part_cases),
        "writer": 1e-3 * parts * costs.writer_ms,
        "scheduler": 1e-3 * parts * costs.scheduler_ms,
        "file system": 1e-9 * cases * costs.case_bytes / costs.shared_gb_s,
    }


def as_shards(costs: Costs, cases: float, nodes: int) -> dict[str, float]:
    """Seconds that each is busy with one shard a node, which publishes its parts while it flies, by name."""
    shard_cases = ceil(cases / nodes)
    part_cases = chunk_size(shard_cases, int(costs.node_cores))
    parts = ceil(shard_cases / part_cases)
    return {
        "workers": ceil(parts / costs.node_cores) * part_s(costs, part_cases),
        "writer": 1e-3 * parts * costs.writer_ms,
        "publishing": _publishing_s(costs, shard_cases, parts),
    }


def _publishing_s(costs: Costs, cases: int, parts: int) -> float:
    """Every part is sent and read back, checked by the last copy in flight, and read back again by the command's."""
    requests = 1e-3 * _requests(costs.publish_requests, costs.publish_more_requests, cases, parts) * costs.request_ms
    requests /= AT_ONCE
    processor = 1e-6 * cases * (costs.publish_case_us + costs.check_case_us + costs.again_case_us)
    return requests + processor + 3.0 * 1e-9 * cases * costs.case_bytes / costs.link_gb_s


def _requests(of_a_part: float, of_1000_cases: float, cases: float, parts: int) -> float:
    """Requests for all parts: some for each, and more for larger ones, whose bytes go in several pieces."""
    return parts * of_a_part + 1e-3 * cases * of_1000_cases


def merging(costs: Costs, cases: float, nodes: int) -> dict[str, float]:
    """Seconds of one machine that fetches the shards, some at a time, and then merges them, by name.

    Each of the processes that fetch has several requests under way.
    """
    shard_cases = ceil(cases / nodes)
    parts = nodes * ceil(shard_cases / chunk_size(shard_cases, int(costs.node_cores)))
    requests = _requests(costs.fetch_requests, costs.fetch_more_requests, cases, parts)
    one_by_one = 1e-3 * requests * costs.request_ms / AT_ONCE + 1e-6 * cases * costs.fetch_case_us
    return {
        "fetching": max(one_by_one / costs.fetches, 1e-9 * cases * costs.case_bytes / costs.link_gb_s),
        "merging": 1e-6 * cases * costs.merge_case_us,
    }


def longest(costs: Costs, busy: Mapping[str, float]) -> tuple[float, str]:
    """Seconds of a run, its start among them, and who is busy all the time."""
    limit = max(busy, key=lambda name: busy[name])
    return costs.start_s + busy[limit], limit


def runs_of(cases: float) -> tuple[int, float]:
    """Number of runs that so many cases are, and the cases of each."""
    runs = ceil(cases / MOST_CASES)
    return runs, cases / runs


def most_workers(costs: Costs, part_cases: int = LARGEST_CHUNK) -> int:
    """Workers that keep the writer or the scheduler, whoever takes longer for a part, busy all the time."""
    return int(part_s(costs, part_cases) / (1e-3 * max(costs.writer_ms, costs.scheduler_ms)))
