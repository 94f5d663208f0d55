"""The convergence section of a report, and reports of runs with next to nothing in them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from synthetic_run import synthetic_run

from reports.document.blocks import FigureBlock, Table
from reports.drawing.ticks import log_ticks
from reports.run.flown import Flown
from reports.sections import convergence
from reports.sections.convergence import convergence_blocks, integration_table
from reports.sections.headline import warnings


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


def test_the_error_of_integration_is_told_in_standard_deviations_and_a_large_one_is_a_warning():
    run = synthetic_run(2000, failed=3)
    sigma = run.table[["propellant_kg", "peak_force_n", "settling_time_s"]].std(ddof=1)
    changes = dict(zip(sigma.index, (0.5 * sigma.iloc[0], 1e-4 * sigma.iloc[1], 0.05 * sigma.iloc[2]), strict=True))
    facts = {"by": "half of the step", "tried": 16, "used": 15, "changes": {**changes, "no_such_metric_m": 1.0}}
    run.notes = lambda event=None: [
        SimpleNamespace(event="finished", facts={"integration": facts}),
        SimpleNamespace(event="finished", facts={}),  # of `rerun --failed`
        SimpleNamespace(event="finished", facts={"integration": {"by": 1, "changes": "?"}}),  # of another program
    ]
    flown = Flown(run, "run")
    table = integration_table(flown)
    assert [[cell.text for cell in row[2:]] for row in table.rows] == [
        ["0.5 σ", "not small"], ["0.05 σ", "small"], ["0.0001 σ", "negligible"],
    ]  # fmt: skip
    assert "15 of 16 cases" in table.note
    [warning] = [sentence for sentence in warnings(flown) if "half of the step" in sentence]
    assert "propellant would change by more than 0.1 standard deviations" in warning
    assert integration_table(Flown(synthetic_run(100), "run")) is None


def test_a_metric_that_is_rounding_beside_others_in_its_unit_has_no_error_of_integration():
    run, changes = synthetic_run(200), {"correction_impulse_m_s": 1e-10, "entry_speed_m_s": 1e-3}
    facts = {"by": "half of the step", "tried": 2, "used": 2, "changes": changes}
    run.notes = lambda event=None: [SimpleNamespace(event="finished", facts={"integration": facts})]
    assert Flown(run, "run").integration_share("correction_impulse_m_s") > 0.0
    run.table["correction_impulse_m_s"] = np.resize([1e-10, -1e-10], len(run.table))  # of 7800 m/s
    flown = Flown(run, "run")
    assert flown.integration_share("correction_impulse_m_s") is None
    assert flown.integration_share("entry_speed_m_s") > 0.0
    run.table["exit_speed_m_s"] = 1e30  # a mark of what never happens: it hid the warning of coarse steps
    run.manifest["columns"].append({"name": "exit_speed_m_s", "unit": "m/s", "role": "metric", "description": ""})
    assert Flown(run, "run").integration_share("entry_speed_m_s") > 0.0


def test_a_probability_beside_one_has_no_digits_of_rounding(monkeypatch):
    """Fisher's test gave 0.9999999999 for halves that are the same, which stood there as 99.99999999 %."""
    estimate = convergence.running_quantile
    same = lambda *given: replace(estimate(*given), halves_p=1.0 - 1e-10)  # noqa: E731
    monkeypatch.setattr(convergence, "running_quantile", same)
    assert blocks(synthetic_run(2000))[1].rows[1][5].text == "100\u202f%"
