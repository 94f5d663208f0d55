"""The convergence section of a report, and reports of runs with next to nothing in them."""

import pytest
from synthetic_run import synthetic_run

from reports.document.blocks import FigureBlock, Table
from reports.drawing.ticks import log_ticks
from reports.run.flown import Flown
from reports.sections.convergence import convergence_blocks


def blocks(run):
    return list(convergence_blocks(Flown(run, "run")))


def test_every_metric_that_matters_has_a_mean_and_an_outer_quantile():
    figure, table = blocks(synthetic_run(2000, failed=3))
    assert isinstance(figure, FigureBlock)
    assert isinstance(table, Table)
    names = [row[0].text.split(" [")[0] for row in table.rows]
    assert names[:4] == ["propellant"] * 2 + ["peak force"] * 2
    assert [row[1].text for row in table.rows[:2]] == ["mean", "99.73rd percentile"]
    assert {row[6].text for row in table.rows} == {"converged", "not yet"}
    assert "1\u202f997 of 2\u202f000 cases" in table.rows[0][1].small


def test_cases_in_a_wrong_order_are_found_out():
    run = synthetic_run(3000, failed=0)
    assert "no" not in {row[6].text for row in blocks(run)[1].rows}
    metrics = [name for name in run.table.columns if name.endswith(("_kg", "_n"))]
    run.table[metrics] = run.table.sort_values("propellant_kg")[metrics].to_numpy()
    assert blocks(run)[1].rows[0][6].text == "no"


@pytest.mark.parametrize("design", ["grid", "one_at_a_time"])
def test_chosen_cases_do_not_converge(design):
    run = synthetic_run(100)
    run.manifest["campaign"]["design"] = design
    assert blocks(run) == []


def test_the_axis_of_cases_has_numbers_that_fit():
    assert log_ticks(20, 300) == [20, 50, 100, 200]
    assert log_ticks(20, 1_000_000) == [100, 1000, 10_000, 100_000, 1_000_000]
