"""Short forms of the measurements on scaling, the model that goes on from them, and the tables of the page."""

from collections import Counter
from dataclasses import fields, replace

import pytest

from mc_engine.flight.chunks import LARGEST_CHUNK
from mc_engine.runner import runner
from tests.benchmarks.scaling import tables
from tests.benchmarks.scaling.model import Costs, as_shards, longest, merging, most_workers, on_one_scheduler, runs_of

pytest.importorskip("moto.server")
from tests.benchmarks.scaling.__main__ import SMALL_PART, more_requests
from tests.benchmarks.scaling.cluster import cluster_of, fly, plain, recovery
from tests.benchmarks.scaling.storage import Step, Stored, s3_server, shards_by_store

CASES, CHUNK = 960, 16
COSTS = Costs(
    case_us=1000.0, part_idle_ms=10.0, writer_ms=5.0, scheduler_ms=2.0, start_s=3.0, case_bytes=200.0,
    publish_requests=7.0, publish_more_requests=0.5, publish_case_us=4.0, check_case_us=1.0, again_case_us=3.0,
    fetch_requests=2.0, fetch_more_requests=0.2, fetch_case_us=2.0, merge_case_us=10.0,
    node_cores=10.0, shared_gb_s=10.0, link_gb_s=1.0, request_ms=30.0, fetches=8.0,
)  # fmt: skip


def test_with_few_workers_a_run_takes_the_time_of_its_cases_and_pauses():
    time, limit = longest(COSTS, on_one_scheduler(COSTS, cases=1e6, nodes=2, part_cases=1000))
    assert limit == "workers"
    assert time == pytest.approx(3.0 + 1000 * (1.0 + 0.010) / 20)


def test_on_one_scheduler_nothing_is_gained_once_the_writer_is_always_busy():
    enough = most_workers(COSTS, part_cases=1000)
    assert enough == 202  # 1.01 s for a part, 5 ms for its commit
    fewer, more = (on_one_scheduler(COSTS, 1e8, nodes, 1000) for nodes in (20, 21))  # of ten workers each
    assert longest(COSTS, fewer)[1] == "workers"
    assert longest(COSTS, more) == (pytest.approx(3.0 + 1e5 * 0.005), "writer")
    assert longest(COSTS, on_one_scheduler(COSTS, 1e8, 1000, 1000)) == longest(COSTS, more)
    busier = replace(COSTS, scheduler_ms=7.0)
    assert longest(busier, on_one_scheduler(busier, 1e8, 1000, 1000))[1] == "scheduler"


def test_a_part_is_flown_by_one_worker():
    """More workers than parts gain nothing."""
    assert on_one_scheduler(COSTS, 1e4, nodes=100, part_cases=1000)["workers"] == pytest.approx(1.01)


def test_shards_fly_ten_times_as_fast_on_ten_times_the_nodes_and_merging_takes_as_long_as_before():
    few, many = (as_shards(COSTS, 1e9, nodes) for nodes in (10, 100))
    for name in few:
        assert few[name] == pytest.approx(10.0 * many[name], rel=0.02)  # whole parts
    assert merging(COSTS, 1e9, 10) == pytest.approx(merging(COSTS, 1e9, 100), rel=0.02)
    assert merging(COSTS, 1e9, 10)["merging"] == pytest.approx(1e4)
    assert merging(COSTS, 1e9, 10)["fetching"] == pytest.approx(
        ((10 * 3060 * 2 + 1e9 * 0.2e-3) * 0.030 / 8 + 1e9 * 2e-6) / 8
    )


def test_publishing_takes_what_its_requests_bytes_and_processor_take():
    published = as_shards(replace(COSTS, request_ms=0.0), 1e9, 10)["publishing"]
    assert published == pytest.approx(1e8 * (4e-6 + 1e-6 + 3e-6 + 3 * 200e-9))
    assert as_shards(COSTS, 1e9, 10)["publishing"] - published == pytest.approx((3060 * 7 + 1e8 * 0.5e-3) * 0.030 / 8)


def test_each_size_of_part_that_was_measured_gives_its_own_requests_back():
    small, large = (Stored(10, 1, {"fetched": Step(1.0, 1.0, Counter(GetObject=n))}) for n in (22, 75))
    more = more_requests(("fetched",), small, large)
    for stored, cases in ((small, SMALL_PART), (large, LARGEST_CHUNK)):
        assert 2.2 + 1e-3 * more * (cases - SMALL_PART) == pytest.approx(stored.requests(["fetched"]))


def test_more_cases_than_a_run_may_have_are_several_runs():
    assert runs_of(1e9) == (1, 1e9)
    assert runs_of(1.5e9) == (2, 0.75e9)
    assert runs_of(1e11) == (100, 1e9)


@pytest.mark.parametrize(
    ("seconds", "words"), [(7.04, "7 s"), (119.0, "120 s"), (600.0, "10 min"), (86_400.0, "24 h"), (1e7, "120 days")]
)
def test_durations_have_the_unit_that_a_person_would_choose(seconds, words):
    assert tables.duration(seconds) == words


def test_the_times_on_the_page_are_computed_from_the_costs_on_the_page():
    text = tables.PAGE.read_text(encoding="utf-8")
    shown = tables.costs_of(text)
    assert tables.cost_table(shown) in text
    for computed in tables.extrapolated(shown):
        assert computed in text
    slower = replace(shown, writer_ms=2.0 * shown.writer_ms + shown.scheduler_ms)
    assert any(computed not in text for computed in tables.extrapolated(slower))


def test_every_cost_is_read_back_from_its_table():
    assert tables.costs_of(tables.cost_table(COSTS)) == COSTS
    assert all(entry.metadata["source"] in ("measured", "assumed") for entry in fields(Costs))
    with pytest.raises(ValueError, match="no line on the writer commits a part"):
        tables.costs_of(tables.cost_table(COSTS).replace("the writer", "who"))


def test_tables_are_written_between_the_marks_only(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- scaling -->\nold\n<!-- end -->\nafter\n")
    tables.written_into(page, "| new |")
    assert page.read_text() == "before\n<!-- scaling -->\n\n| new |\n\n<!-- end -->\nafter\n"
    page.write_text("without marks\n")
    with pytest.raises(ValueError, match="between a line <!-- scaling -->"):
        tables.written_into(page, "| new |")


@pytest.mark.slow
def test_the_processes_of_a_cluster_are_told_apart_and_every_part_is_counted(tmp_path):
    campaign = plain("minimal", CASES)
    with cluster_of(2) as cluster:
        flown = fly(cluster, campaign, tmp_path / "run", CHUNK)
    assert flown.clocks.committed == CASES // CHUNK - 4
    assert min(flown.clocks.wall, flown.clocks.writer, flown.clocks.scheduler, flown.clocks.workers) > 0.0
    assert flown.begun_cases == CASES
    assert flown.start_s > 0.0
    assert not any(process.is_running() for process in (*cluster.workers, cluster.scheduler))


@pytest.mark.slow  # tests/faults/test_backends.py has a cluster lose a worker
def test_a_run_that_loses_half_of_its_workers_loses_no_row_and_flies_one_part_a_worker_again(tmp_path):
    result = recovery(4, plain("minimal", CASES), tmp_path, CHUNK)
    assert (result.killed, result.lost, result.doubled, result.equal) == (2, 0, 0, True)
    assert result.again_cases in (0, CHUNK, 2 * CHUNK)
    assert result.first_part_s > 0.0


def test_requests_for_a_part_are_counted_and_merged_shards_have_the_parts_of_one_run(tmp_path):
    campaign = plain("minimal", 160)
    with s3_server():
        stored = shards_by_store(campaign, tmp_path, CHUNK)
    assert stored.parts == 10
    assert stored.steps["published"].requests["PutObject"] >= stored.parts
    assert stored.steps["checked in flight"].requests["GetObject"] < stored.parts
    assert stored.steps["published again"].requests["GetObject"] >= stored.parts
    assert stored.steps["published again"].requests["PutObject"] == 0
    assert stored.steps["fetched"].requests["GetObject"] >= stored.parts
    assert not stored.steps["merged"].requests
    whole = runner.run(campaign, tmp_path / "whole", chunk=CHUNK)
    merged = runner.open_store(tmp_path / "merged-160")
    assert {part.file: part.sha256 for part in merged.parts} == {part.file: part.sha256 for part in whole.parts}
    assert stored.part_bytes == sum((whole.path / part.file).stat().st_size for part in whole.parts)
