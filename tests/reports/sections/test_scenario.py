"""What a report says was flown; and what it draws where the model asks for no figure."""

import numpy as np
import pytest
from figure_marks import FORMS, marks_of
from synthetic_run import synthetic_run

from mc_engine.campaign.loading import load_campaign
from mc_engine.model import time_of
from mc_engine.runner.manifest import manifest_of
from reports.contents import build
from reports.document.blocks import FigureBlock, Table, Text
from reports.drawing.marks import Limit, Points
from reports.run.flown import Flown


def section(run, anchor):
    return next(one for one in build(run, "run").sections if one.anchor == anchor)


def test_the_timeline_tells_when_and_what_else_is_known_of_the_event():
    run = synthetic_run(50, failed=0)
    columns = run.manifest["columns"]
    columns += [
        {"name": "peak_load_time_s", "unit": "s", "role": "metric", "description": "when"},
        {"name": "peak_load_altitude_km", "unit": "km", "role": "metric", "description": "where"},
    ]
    run.table = run.table.assign(peak_load_time_s=120.0 + run.table["case_id"], peak_load_altitude_km=40.0)
    run.nominal_row |= {"peak_load_time_s": 100.0, "peak_load_altitude_km": 41.5}
    table = next(one for one in section(run, "scenario").blocks if isinstance(one, Table))
    assert [row[0].text for row in table.rows] == ["Peak load", "Settling"]  # in the order of their times
    assert table.rows[0][1].text == "100\u202fs"
    assert table.rows[0][3].text == "altitude 41.5\u202fkm"


def test_what_is_known_of_an_event_is_not_told_of_another_whose_name_is_the_beginning_of_its_own():
    run = synthetic_run(50, failed=0)
    told = {"exit_time_s": 20.0, "exit_speed_m_s": 90.0, "exit_burn_time_s": 80.0, "exit_burn_size_m_s": 3.0}
    run.manifest["columns"] += [
        {"name": name, "unit": "s" if name.endswith("time_s") else "m/s", "role": "metric", "description": "x"}
        for name in told
    ]
    run.table = run.table.assign(**told)
    run.nominal_row |= told
    table = next(one for one in section(run, "scenario").blocks if isinstance(one, Table))
    rows = {row[0].text: row[3].text for row in table.rows}
    assert rows["Exit"] == "speed 90\u202fm/s"
    assert rows["Exit burn"] == "size 3\u202fm/s"


@pytest.mark.parametrize("meaning", ["end of the second burn", time_of("burn_out").meaning("time")])
def test_a_time_whose_meaning_is_an_event_is_in_the_timeline(meaning):
    run = synthetic_run(50, failed=0)
    run.manifest["columns"] += [
        {"name": "burn_out_2_s", "unit": "s", "role": "metric", "description": meaning},
        {"name": "on_time_x_s", "unit": "s", "role": "metric", "description": "time that the x thrusters fired"},
    ]
    run.table = run.table.assign(burn_out_2_s=90.0 + run.table["case_id"], on_time_x_s=3.0)
    run.nominal_row |= {"burn_out_2_s": 90.0, "on_time_x_s": 3.0}
    table = next(one for one in section(run, "scenario").blocks if isinstance(one, Table))
    assert [row[0].text for row in table.rows] == ["Burn out 2", "Settling"]


def test_a_metric_that_the_model_declares_as_a_time_is_in_the_timeline_whatever_its_name():
    run = synthetic_run(50, failed=0)
    run.manifest["columns"] += [
        {"name": "first_within_s", "unit": "s", "role": "metric", "description": "inside 5 deg"}
    ]
    run.manifest["event_times"] = ["first_within_s"]
    run.table = run.table.assign(first_within_s=90.0 + run.table["case_id"])
    run.nominal_row |= {"first_within_s": 90.0}
    table = next(one for one in section(run, "scenario").blocks if isinstance(one, Table))
    assert [row[0].text for row in table.rows] == ["First within", "Settling"]


def test_phases_of_the_nominal_case_are_in_the_timeline_and_marked_in_the_histories():
    run = synthetic_run(50, failed=0)
    t = run.history["t_s"]
    run.history = run.history.assign(phase=np.where(t < 60.0, "rail", np.where(t < 150.0, "burn", "coast")))
    nominal = run.history[run.history["case_id"] == -1]
    begins = {name: nominal["t_s"][nominal["phase"] == name].min() for name in ("burn", "coast")}
    table = next(one for one in section(run, "scenario").blocks if isinstance(one, Table))
    phases = [row for row in table.rows if row[0].text.startswith("Phase ")]
    assert [row[0].text for row in phases] == ["Phase rail begins", "Phase burn begins", "Phase coast begins"]
    assert [row[1].value for row in phases] == pytest.approx([0.0, *begins.values()])
    histories = [one for one in section(run, "histories").blocks if isinstance(one, FigureBlock)]
    lines = [mark for mark in marks_of(histories[0].drawing, Limit) if mark.axis == "x"]
    assert {mark.name: mark.at for mark in lines} == {f"{name} begins": at for name, at in begins.items()}
    assert {mark.key.split(",")[0] for mark in lines} == {"phases of the nominal case: rail"}
    assert "phase" not in {plot.quantity for one in histories for plot in one.drawing.plots}


def test_phases_in_the_first_minutes_of_days_are_told_in_seconds_as_the_metrics_are():
    run = synthetic_run(50, failed=0)
    t = 1000.0 * run.history["t_s"]
    run.history = run.history.assign(t_s=t, phase=np.where(t < t.max() / 100.0, "wait", "transfer"))
    table = next(one for one in section(run, "scenario").blocks if isinstance(one, Table))
    told = {row[0].text: row[1] for row in table.rows}["Phase transfer begins"]
    assert told.text.endswith("\u202fs")
    assert float(told.text.removesuffix("\u202fs").replace("\u202f", "")) == pytest.approx(told.value, rel=1e-4)


def test_an_output_is_not_labelled_with_the_meaning_of_the_input_of_the_same_name():
    run = synthetic_run(50, failed=0)
    run.manifest["quantities"].append({"name": "x_m", "unit": "m", "description": "radial position"})
    run.manifest["inputs"] = [
        {"name": "x_m", "unit": "m", "description": "initial radial position"},
        {"name": "ve_pct", "unit": "%", "description": "error of the burn's size, VE"},
    ]
    flown = Flown(run, "run")
    assert flown.axis("x_m") == "x [m]"
    assert flown.axis("ve_pct") == "ve: error of the burn's size [%]"


def test_assumptions_are_what_the_campaign_file_sets_and_the_rest_is_in_the_appendix():
    run = synthetic_run(50, failed=0)
    scenario = {one.caption: one for one in section(run, "scenario").blocks if isinstance(one, Table)}
    assert [row[0].text for row in scenario["Assumptions: values set by the campaign file"].rows] == ["isp_s"]
    assert [row[0].text for row in scenario["Dispersed inputs"].rows] == ["ve_pct [%]", "oe_pct [%]"]
    assert "Correlated inputs" not in scenario
    (fixed,) = section(run, "inputs").blocks
    assert [row[0].text for row in fixed.rows] == ["gain_1_s", "control"]


def test_the_remark_of_the_campaign_file_is_in_the_report():
    note = r'note = "Flown with the tanks of May.\n\n\nNot weighed since.\n"'
    text = load_campaign("deorbit").text.replace("[campaign]", f"[campaign]\n{note}", 1)
    run = synthetic_run(50, failed=0)
    run.manifest["campaign"] |= manifest_of(load_campaign("deorbit", text=text))["campaign"]
    told = [block for block in section(run, "scenario").blocks if isinstance(block, Text)]
    assert told[1:3] == [Text(("Flown with the tanks of May.",)), Text(("Not weighed since.",))]


def test_inputs_that_the_campaign_correlates_are_named_with_rank_and_source():
    run = synthetic_run(50, failed=0)
    pairs = manifest_of(load_campaign("geo_injection/parking_orbit_errors"))["correlations"]
    run.manifest["correlations"] = [*pairs, {**pairs[0], "rank": 0.9689549735054895}]  # as a covariance has it
    (table,) = [one for one in section(run, "scenario").blocks if getattr(one, "caption", "") == "Correlated inputs"]
    pair, rank, source = (cell.text for cell in table.rows[0])
    assert (pair, rank) == ("initial_position_t_m, initial_velocity_r_m_s", "−0.8915")
    assert source == "not stated"
    assert table.rows[-1][1].text == "0.96895"


def test_without_figures_of_its_own_a_model_gets_histories_and_scatters_of_what_matters():
    run = synthetic_run(200, failed=0, figures=[])
    histories = [one for one in section(run, "histories").blocks if isinstance(one, FigureBlock)]
    assert {plot.quantity for plot in histories[0].drawing.plots} == {
        "semi_major_axis_error_km", "eccentricity_error", "force_n", "position_error_m",
    }  # fmt: skip
    scatters = [one for one in section(run, "scatter").blocks if isinstance(one, FigureBlock)]
    assert [marks_of(one.drawing, Points)[0].columns for one in scatters if one.drawing.form == FORMS["scatter"]] == [
        ("ve_pct", "propellant_kg"), ("ve_pct", "peak_force_n"), ("ve_pct", "settling_time_s"),
    ]  # fmt: skip


def test_the_margin_figure_has_a_row_a_requirement_with_bound_and_worst_case():
    run = synthetic_run(3000, failed=0)
    document = build(run, "run")
    drawing = next(one.drawing for one in document.sections[0].blocks if isinstance(one, FigureBlock))
    assert drawing.form == FORMS["margins"]
    (plot,) = drawing.plots
    assert [text.split(",")[0] for _, text in plot.y.ticks].index("fuel") == 0
    worst, demonstrated_bound = (marks_of(drawing, Points, words)[0] for words in ("worst", "demonstrated"))
    assert worst.x[0] == pytest.approx(100.0 * (1.0 - run.table["propellant_kg"].max() / 2.5))
    demonstrated = next(one for one in document.data["requirements"] if one.name == "fuel")
    assert demonstrated_bound.x[0] == pytest.approx(100.0 * demonstrated.margin / 2.5)
    assert len(plot.y.ticks) == 3
    low, high = plot.x.reach
    assert low >= -105.0
    assert high <= 105.0


def test_the_worst_cases_of_requirements_not_met_come_first():
    blocks = section(synthetic_run(3000, failed=0), "worst").blocks  # all but the fuel are not met
    assert [one.caption.removeprefix("Cases with the largest ") for one in blocks[:3]] == [
        "peak force", "settling time", "propellant",
    ]  # fmt: skip


def test_what_is_at_the_start_of_the_nominal_case_is_no_event_of_its_timeline():
    run = synthetic_run(50, failed=0)
    run.manifest["columns"] += [{"name": "peak_load_time_s", "unit": "s", "role": "metric", "description": "when"}]
    run.table = run.table.assign(peak_load_time_s=100.0 + run.table["case_id"])
    run.nominal_row |= {"peak_load_time_s": 100.0, "settling_time_s": 0.0}
    table = next(one for one in section(run, "scenario").blocks if isinstance(one, Table))
    assert [row[0].text for row in table.rows] == ["Peak load"]
    assert table.note.endswith("not listed: settling.")
