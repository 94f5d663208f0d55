"""What a source says of many cases, beside the same of a run with these dispersions."""

import numpy as np
import pytest
from synthetic_run import synthetic_run

from reports.document.blocks import FigureBlock
from reports.drawing.marks import Bar, Line
from reports.run.flown import Flown
from reports.sections.figure_blocks import distribution_blocks
from reports.sections.published import own_statistic, published_blocks, published_law
from reports.sections.published_statistics import statistics_tables

BOTH = ["ve_pct", "oe_pct"]


def record(statistic, published, **more):
    record = {"quantity": f"{statistic} of fuel", "published": published, "unit": "kg", "source": "Table 12, fuel"}
    return record | {"statistic": statistic, "of": "propellant_kg", "over": BOTH, **more}


@pytest.fixture(scope="module")
def fuel():
    return synthetic_run(400, failed=3).table


def flown(*records, design="mc"):
    run = synthetic_run(400, failed=3)
    run.manifest["published"] = list(records)
    run.manifest["campaign"]["design"] = design
    return Flown(run, "run")


def test_mean_deviation_and_farthest_are_those_of_the_cases_that_flew(fuel):
    values = fuel["propellant_kg"][fuel["status"] == "ok"]
    run = flown()
    assert own_statistic(run, record("mean", 1.0)) == pytest.approx(values.mean(), rel=1e-12)
    assert own_statistic(run, record("standard deviation", 1.0)) == pytest.approx(values.std(ddof=1), rel=1e-12)
    first = fuel["propellant_kg"][:50].dropna()
    farthest = first.loc[(first - first.mean()).abs().idxmax()]
    assert own_statistic(run, record("farthest", 1.0, cases=50)) == farthest


def test_the_table_has_a_row_a_quantity_and_says_what_is_reached(fuel):
    mean = fuel["propellant_kg"].mean()
    good = record("mean", mean * 1.1, tolerance=mean)
    bad = record("standard deviation", 1e6, tolerance=1.0, status="restored")
    (table,) = statistics_tables(flown(good, bad))
    assert table.caption == "Table 12 of the source compared with this run"
    (row,) = table.rows
    assert row[0].text == "propellant_kg [kg]"
    assert [row[2].tone, row[4].tone] == ["good", "open"]
    assert row[2].small == "−9.1 %, reached"
    assert row[4].small.endswith(" %, not reached")
    assert row[3].small == "restored"


def test_such_a_record_then_leaves_the_other_table():
    shown = record("mean", 1.0)
    assert list(published_blocks(flown(shown))) == []
    other = {"quantity": "other", "published": 3.0, "column": "propellant_kg"}
    assert len(next(published_blocks(flown(shown, other))).rows) == 1


@pytest.mark.parametrize(
    "elsewhere",
    [{"over": ["ve_pct"]}, {"over": [*BOTH, "isp_s"]}, {"at": {"control": "pulsed"}}, {"at": {"isp_s": 200.0}}],
)
def test_a_run_of_other_dispersions_or_settings_is_not_compared(elsewhere):
    run = flown(record("mean", 1.0, **elsewhere))
    assert list(statistics_tables(run)) == []
    assert next(published_blocks(run)).startswith("1 published value of the model is not computed")


def test_a_run_of_chosen_cases_is_not_compared():
    assert list(statistics_tables(flown(record("mean", 1.0), design="grid"))) == []


def test_inputs_that_are_shared_and_agree_are_compared():
    assert len(list(statistics_tables(flown(record("mean", 1.0, at={"control": "continuous", "isp_s": 246.0}))))) == 1


def test_a_printed_mean_and_deviation_are_drawn_as_a_normal_distribution_over_the_cases(fuel):
    """The curve holds as many cases as the bars, and its middle and width are the printed ones."""
    run = flown(record("mean", 3.0), record("standard deviation", 0.5))
    drawn = [block for block in distribution_blocks(run) if isinstance(block, FigureBlock)]
    plots = [plot for block in drawn for plot in block.drawing.plots]
    (plot,) = [one for one in plots if any(isinstance(mark, Line) for mark in one.marks)]
    (curve,) = [mark for mark in plot.marks if isinstance(mark, Line)]
    (bars,) = [mark for mark in plot.marks if isinstance(mark, Bar) and mark.key == "cases"]
    x, y = curve.x, curve.y
    shares = y / (bars.top.sum() * (bars.right[0] - bars.left[0]))
    assert np.trapezoid(shares, x) == pytest.approx(1.0, abs=1e-3)
    assert np.trapezoid(shares * x, x) == pytest.approx(3.0, abs=1e-3)
    assert np.trapezoid(shares * (x - 3.0) ** 2, x) == pytest.approx(0.25, rel=1e-2)
    assert bars.top.sum() == np.isfinite(fuel["propellant_kg"]).sum()


@pytest.mark.parametrize("records", [[record("mean", 3.0)], [record("standard deviation", 0.5)], []])
def test_half_a_law_is_not_drawn(records):
    run = flown(*records)
    assert published_law(run, "propellant_kg") is None


def test_a_law_of_other_dispersions_is_not_drawn():
    other = {"over": ["ve_pct"]}
    assert (
        published_law(flown(record("mean", 3.0, **other), record("standard deviation", 0.5, **other)), "propellant_kg")
        is None
    )
