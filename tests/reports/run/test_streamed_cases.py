"""A run that is too large to be held: its numbers are those of the whole table, to the last bit."""

import json
from dataclasses import replace

import numpy as np
import pytest
from synthetic_run import COLUMNS, kept, manifest, synthetic_run

from mc_engine.runner.summary import judgement, summaries
from mc_engine.statistics import selection
from mc_engine.statistics.worst import Limits
from reports.cli import write_reports
from reports.contents import build
from reports.run import all_cases
from reports.run.flown import Flown
from reports.sections.diagnostics import normal_probability_blocks
from reports.sections.tables import range_table

CASES, PART, FEW_CASES = 100_000, 7919, 4000
BUDGET, SMALL_BUDGET = 1 << 16, 1 << 13  # cells
REQUIREMENTS = [
    ("fuel", "propellant_kg", 2.0, None, 0.9, 0.9),
    ("fuel twice", "propellant_kg", 1.9, None, 0.5, 0.95),
    ("angle", "entry_flight_path_angle_deg", -1.9999, -2.0001, 0.9, 0.9),
    ("pulses", "pulse_count", None, 4.0, 0.8, 0.9),
    ("speed", "entry_speed_m_s", 7800.0001, None, 0.9973, 0.9),
]


def kept_run(folder, n=CASES):
    """A synthetic run on the disk: parts with and without failed cases, ties, numbers that are none."""
    made = synthetic_run(n, failed=40)
    table = made.table
    scattered = np.arange(500, n // 2, 997)
    table.loc[scattered, "status"] = "no-stop"
    table.loc[scattered, "reason"] = "too long"
    table.loc[np.arange(3, n, 5003), "propellant_kg"] = np.nan
    table.loc[np.arange(4, n, 3001), "entry_speed_m_s"] = np.inf
    table["settling_time_s"] = -0.0
    requirements = [
        dict(zip(("name", "metric", "at_most", "at_least", "share", "confidence"), one, strict=True))
        for one in REQUIREMENTS
    ]
    record = manifest(requirements=requirements)
    record["campaign"]["cases"] = n
    return kept(folder, record, table, PART)


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return kept_run(tmp_path_factory.mktemp("large") / "run")


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    return kept_run(tmp_path_factory.mktemp("small") / "run", FEW_CASES)


@pytest.fixture
def pair(store, monkeypatch):
    """The same run held and streamed; values are never few, so that order statistics take all passes."""
    held = Flown(store, "run")
    monkeypatch.setattr(all_cases, "MOST_CELLS", BUDGET)
    monkeypatch.setattr(selection, "FEW", 50)
    streamed = Flown(store, "run")
    assert streamed.sampled
    assert not held.sampled
    return held, streamed


def test_every_number_of_all_cases_is_that_of_the_whole_table(pair):
    held, streamed = pair
    assert (
        (streamed.n_tried, streamed.every.completed) == (held.n_tried, held.every.completed) == (CASES, CASES - 40 - 50)
    )
    assert streamed.every.statuses == held.every.statuses
    assert streamed.every.reasons == held.every.reasons
    assert streamed.every.inside_all == held.every.inside_all
    assert streamed.summaries == held.summaries
    assert streamed.verdicts == held.verdicts
    assert streamed.joint == held.joint
    assert streamed.every.summary("propellant_kg", 0.3) == held.every.summary("propellant_kg", 0.3)
    assert np.array_equal(
        streamed.every.first_values("propellant_kg", 9000), held.every.first_values("propellant_kg", 9000), True
    )
    for name in held.inputs:
        assert streamed.every.ends(name) == held.every.ends(name)
    for which in (0, 3, -1):
        assert streamed.every.limit_counts.outside(which) == held.every.limit_counts.outside(which)
        assert streamed.every.limit_counts.without_number(which) == held.every.limit_counts.without_number(which)


def test_order_statistics_are_those_of_numpy(pair):
    held, streamed = pair
    for name, summary in streamed.summaries.items():
        ordered = np.sort(held.values(name)[np.isfinite(held.values(name))])
        assert (summary.minimum, summary.maximum) == (ordered[0], ordered[-1])
        assert summary.mean == pytest.approx(ordered.mean(), rel=1e-12)
        for one in summary.quantiles:
            assert one.lower in ordered
            assert one.upper in ordered
            assert one.value == pytest.approx(
                np.quantile(ordered, one.probability, method="median_unbiased"), rel=1e-13
            )


def test_worst_and_failed_cases_are_those_of_the_whole_table(pair):
    held, streamed = pair
    assert streamed.every.failed(10).equals(held.every.failed(10).reset_index(drop=True))
    for name in held.key_metrics:
        assert streamed.worst(name, 10).equals(held.worst(name, 10).reset_index(drop=True))
        assert streamed.largest_is_worst(name) == held.largest_is_worst(name)
    other = Limits(at_most=1.9)
    assert streamed.every.worst("propellant_kg", 7, other).equals(
        held.every.worst("propellant_kg", 7, other).reset_index(drop=True)
    )


def test_the_sample_is_even_over_the_case_numbers_and_the_same_every_time(store, pair):
    _, streamed = pair
    ids = streamed.case_ids
    assert ids.size == BUDGET // len(COLUMNS) == streamed.n_held
    steps = np.diff(ids)
    assert (steps > 0).all()
    assert steps.max() < 2 * CASES / ids.size + 2
    assert len(set(steps.tolist())) > 10  # not every k-th: a design may have such a pattern
    assert np.array_equal(Flown(store, "run").case_ids, ids)


def test_reports_say_the_same_of_a_streamed_run_and_name_the_sample(small, monkeypatch):
    whole = build(small, "run")
    monkeypatch.setattr(all_cases, "MOST_CELLS", SMALL_BUDGET)
    sampled = build(small, "run")
    assert sampled.verdicts == whole.verdicts
    assert sampled.costs == whole.costs
    assert {k: v for k, v in sampled.data.items() if k != "contributors"} == {
        k: v for k, v in whole.data.items() if k != "contributors"
    }
    assert any("show 630 of them" in one.replace("\u202f", " ") for one in sampled.warnings)
    assert not any("equal stretches" in one for one in whole.warnings)
    same = ("Requirements and their verdicts", "Statistics of the metrics", "Percentiles of the metrics",
            "Completion of the cases", "Dispersed inputs", "Risks of the verdicts")  # fmt: skip
    for caption in same:
        assert [replace(one, number=0) for one in tables(sampled, caption)] == [
            replace(one, number=0) for one in tables(whole, caption)
        ]


def tables(document, caption):
    return [
        block for one in document.sections for block in one.blocks if getattr(block, "caption", "").startswith(caption)
    ]


def test_the_ranges_of_a_sample_of_a_grid_are_those_of_all_cases(small, monkeypatch):
    monkeypatch.setitem(small.manifest["campaign"], "design", "grid")
    monkeypatch.setattr(all_cases, "MOST_CELLS", SMALL_BUDGET)
    sampled = Flown(small, "run")
    ends = [[cell.value for cell in row[-2:]] for row in range_table(sampled).rows]
    assert ends == [[one.minimum, one.maximum] for one in sampled.summaries.values()]
    held = np.nanmax(sampled.values("propellant_kg"))
    assert held < sampled.summaries["propellant_kg"].maximum  # the sample has not the largest


def test_the_shape_of_a_sample_with_failed_cases_is_a_number(small, monkeypatch):
    monkeypatch.setattr(all_cases, "MOST_CELLS", SMALL_BUDGET)
    sampled = Flown(small, "run")
    (block,) = normal_probability_blocks(sampled)
    assert not any("not a number" in plot.title for plot in block.drawing.plots)


def test_a_streamed_run_has_all_its_reports(small, monkeypatch):
    monkeypatch.setattr(all_cases, "MOST_CELLS", SMALL_BUDGET)
    written = write_reports(small.path, ("html", "pdf", "md"))
    assert all(path.stat().st_size > 10_000 for path in written)
    counts = json.loads((small.path / "report.json").read_text())["counts"]
    assert (counts["flown"], counts["completed"]) == (FEW_CASES, FEW_CASES - 42)


def test_summary_and_status_read_a_run_part_by_part(store, monkeypatch):
    held = Flown(store, "run")
    monkeypatch.setattr(type(store), "cases", lambda *_: pytest.fail("the whole table is read"))
    assert judgement(store) == (held.verdicts, held.joint)
    assert summaries(store)["pulse_count"].n_used == held.summaries["pulse_count"].n_used
