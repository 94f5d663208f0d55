"""Outcomes of cases: each is inside all limits, outside one of them, or failed, and counted once."""

import numpy as np
import pytest
from synthetic_run import synthetic_run

from reports.run.flown import Flown
from reports.run.outcomes import COMPLETED, case_outcomes, failures, inside, inside_words, outcome_sentence
from reports.sections.case_tables import worst_tables
from reports.sections.single_cases import case_axes, case_blocks, case_data


def flown(failed, outside):
    """300 cases, the last ones failed, the largest of the others outside the limit of the propellant."""
    run = synthetic_run(300, failed, requirements=[])
    limits = [float(np.sort(run.table["propellant_kg"].dropna())[-1 - outside]), 1e9]
    run.manifest["requirements"] = [
        {"name": name, "metric": metric, "at_most": limit, "share": 0.9, "confidence": 0.9}
        for name, metric, limit in zip(("fuel", "speed"), ("propellant_kg", "entry_speed_m_s"), limits, strict=True)
    ]
    return Flown(run, "run")


@pytest.mark.parametrize(
    ("failed", "outside", "sentence"),
    [
        (3, 5, "292 inside all limits, 5 outside a limit, 3 failed, of 300 cases"),
        (0, 5, "295 inside all limits, 5 outside a limit, of 300 cases"),
        (3, 0, "297 inside all limits, 3 failed, of 300 cases"),
        (300, 0, "0 inside all limits, 300 failed, of 300 cases"),
    ],
)
def test_every_case_is_counted_once(failed, outside, sentence):
    run = flown(failed, outside) if failed < 300 else Flown(synthetic_run(300, 300), "run")
    assert outcome_sentence(run) == sentence
    counts = [300 - failed - outside, outside, failed]
    assert np.bincount(case_outcomes(run), minlength=3).tolist() == counts


def test_cases_are_named_by_the_requirements_that_they_are_inside_of():
    run = flown(3, 5)
    fuel, speed = run.verdicts
    assert [inside(run, [one]).sum() for one in (fuel, speed)] == [292, 297]
    assert {name: int(lost.sum()) for name, lost in failures(run).items()} == {
        "fuel": 8,
        f"speed, {COMPLETED}": 3,  # the same cases
    }
    assert (inside_words(run), inside_words(run, [speed])) == ("inside all limits", "inside the limit of speed")
    bare = Flown(synthetic_run(300, 3, requirements=[]), "run")
    assert outcome_sentence(bare) == "297 completed, 3 failed, of 300 cases"


def test_the_levels_of_a_grid_that_change_no_outcome_are_no_axis_of_the_figure_by_outcome():
    """Of the cases with one level of it, those come first that have the lowest level of another input."""
    run = synthetic_run(80, 0)
    first, second, third = (level.ravel() for level in np.meshgrid(*map(np.arange, (8, 5, 2)), indexing="ij"))
    run.table = run.table.assign(ve_pct=1.0 * first, oe_pct=1.0 * second, idle_pct=1.0 * third)
    run.table["propellant_kg"] = 1.0 * first + 0.5 * second
    run.manifest["columns"].append({**run.manifest["columns"][3], "name": "idle_pct"})
    run.manifest["requirements"] = [{**run.manifest["requirements"][0], "at_most": 6.5}]
    assert case_axes(Flown(run, "run")) == ("ve_pct", "oe_pct")


def test_a_switch_in_the_figure_by_outcome_has_its_levels_on_its_axis():
    """It ran from 0.0 to 1.0."""
    run = synthetic_run(80, 0)
    run.table["oe_pct"] = run.table["case_id"] % 2 == 0
    run.table["propellant_kg"] = 1.0 * run.table["oe_pct"] + run.table["ve_pct"] * 1e-3
    flown = Flown(run, "run")
    (figure,) = case_blocks(flown)
    axes = dict(zip(case_axes(flown), (figure.drawing.plots[0].x, figure.drawing.plots[0].y), strict=True))
    assert (axes["oe_pct"].ticks, axes["ve_pct"].ticks) == (((0, "no"), (1, "yes")), None)
    column = next(column for column in case_data(flown, ()).columns if column.name == "oe_pct")
    assert column.values[:2] == ("yes", "no")


def test_failed_cases_are_listed_with_inputs_that_they_have():
    """What they would have taken from the run upstream, where they failed, was shown as "not a number" alone."""
    run = synthetic_run(300, 30)
    run.table["reach_km"] = np.where(run.table["status"] == "ok", run.table["ve_pct"], np.nan)
    run.manifest["columns"].insert(3, {**run.manifest["columns"][3], "name": "reach_km", "unit": "km"})
    (table,) = [table for table in worst_tables(Flown(run, "run")) if table.caption.startswith("Failed cases")]
    assert {column.title for column in table.columns[2:-1]} == {"ve [%]", "oe [%]"}
