"""What a report says of columns that it does not draw, and the words, units and digits of its tables."""

import re

import numpy as np
import pandas as pd
import pytest
from synthetic_run import synthetic_run

from mc_engine.model.figures import HistoryFigure, MapFigure, ProfileFigure, ScatterFigure, to_record
from reports.contents import build
from reports.document.blocks import FigureBlock, Table, Text, blocks_of
from reports.run.chosen_units import ShownRun
from reports.run.flown import Flown
from reports.run.history_limits import history_limits
from reports.sections.tables import distribution_text, input_table


def narrow(sigma, requirement=None):
    """A run whose entry speed is 7800 m/s with this σ."""
    run = synthetic_run(400, failed=0)
    draws = np.random.Generator(np.random.Philox(key=3)).normal(size=400)
    run.table["entry_speed_m_s"] = 7800.0 + sigma * draws
    run.manifest["figures"] = [to_record(ScatterFigure("entry_speed_m_s", "entry_flight_path_angle_deg", "Entry"))]
    if requirement:
        run.manifest["requirements"] = [
            {"name": "speed", "metric": "entry_speed_m_s", "at_least": None, "share": 0.9, "confidence": 0.9}
            | {"at_most": requirement}
        ]
    return run


def drawn_labels(document):
    return {plot.x.label for one in blocks_of(document, FigureBlock) for plot in one.drawing.plots}


def sentences(document):
    return [one for text in blocks_of(document, Text) for one in text.paragraphs]


def test_a_spread_below_a_ten_millionth_of_the_value_is_named_and_not_drawn():
    document = build(narrow(1e-4), "run")
    assert "entry speed [m/s]" not in drawn_labels(document)
    said = "standard deviation below a ten-millionth of the value: entry speed."
    assert f"Not drawn, {said}" in sentences(document)
    assert f"Entry: not drawn, {said}" in sentences(document)
    assert "entry_speed_m_s" not in Flown(narrow(1e-4), "run").key_metrics
    rows = next(one for one in blocks_of(document, Table) if one.caption == "Statistics of the metrics").rows
    assert any(row[0].text == "entry speed [m/s]" and row[4].value > 0.0 for row in rows)  # told all the same


def test_a_zero_but_for_rounding_is_no_key_result_and_not_drawn():
    """The crossrange of a planar flight: its 1e-17 km were a card on the first page, a scatter plot and a history."""
    run = synthetic_run(400, failed=0)
    names = ("downrange_km", "crossrange_km")
    for name, size in zip(names, (1.0, 1e-19), strict=True):
        run.table[name], run.history[name] = size * run.table["max_position_error_m"], size * run.history["force_n"]
        run.manifest["columns"].append({"name": name, "unit": "km", "role": "metric", "description": ""})
    run.manifest["figures"] = [to_record(ScatterFigure(*names, "End")), to_record(HistoryFigure(names, "Way"))]
    document = build(run, "run")
    assert Flown(run, "run").key_metrics[-1] == "downrange_km"
    assert "crossrange [km]" not in drawn_labels(document)
    for said in (": crossrange.", " in all saved cases: crossrange."):
        assert f"Not drawn, zero but for rounding{said}" in sentences(document)


def test_zeros_are_found_by_the_units_of_the_columns_and_not_beside_infinities_and_marks():
    """A range told in m had hidden the crossrange in km, and the report ended with a KeyError; 1e30 for never made all
    metrics in its unit zeros, and an infinite distance all histories."""
    run = synthetic_run(400, failed=0)
    sizes = {"range_km": 1e-5, "cross_km": 1e-40, "never_s": 1e30, "miss_s": 1.0}
    for name, size in sizes.items():
        run.table[name], run.history[name] = size * run.table["max_position_error_m"], size * run.history["force_n"]
        run.manifest["columns"].append({"name": name, "unit": name[-2:].strip("_"), "role": "metric"})
    run.history.loc[::7, "never_s"] = np.inf
    run.manifest["figures"] = [to_record(HistoryFigure(("miss_s", "never_s"), "Way"))]
    run.manifest["requirements"] = []
    document = build(run, "run")
    assert not any("zero but for rounding in all saved cases" in one for one in sentences(document))
    shown, own = ShownRun(Flown(run, "run")), Flown(run, "run")
    assert shown.unit("range_km") != shown.unit("cross_km")
    for flown in (shown, own):
        assert [name for name in sizes if flown.undrawn(name)] == ["cross_km"]


@pytest.mark.parametrize(("low", "high", "told"), [(355.0, 365.0, True), (0.0, 360.0, False), (100.0, 260.0, False)])
def test_an_angle_that_jumps_by_a_turn_between_cases_is_a_warning(low, high, told):
    """Of a longitude of 0 deg ± 5 deg the report gave a mean of 182 deg, a σ of 178 deg, and a verdict on them."""
    run = synthetic_run(400, failed=3)
    run.table["entry_flight_path_angle_deg"] = np.linspace(low, high, 400) % 360.0
    warnings = " ".join(build(run, "run").warnings)
    assert ("entry flight path angle: the cases lie near both ends of a full turn, none between" in warnings) is told


@pytest.mark.parametrize("run", [narrow(0.1), narrow(1e-4, 7800.001)])
def test_a_larger_spread_and_one_that_a_limit_is_on_are_drawn(run):
    assert "entry speed [m/s]" in drawn_labels(build(run, "run"))


def test_the_meaning_of_a_status_has_no_marks_of_code():
    assert "the column “reason” says which" in Flown(synthetic_run(20, failed=0), "run").status_text("crashed")


def test_what_is_not_drawn_is_named_in_words():
    run = synthetic_run(200, failed=0)
    run.table["max_position_error_m"] = np.nan
    run.table["pulse_count"] = 4.0
    run.history["position_error_m"] = np.nan
    run.history["force_n"] = 7.0
    run.manifest["figures"] = [
        HistoryFigure(("semi_major_axis_error_km", "force_n", "position_error_m"), "Errors"),
        ProfileFigure("force_n", "position_error_m", "Profile"),
        ScatterFigure("max_position_error_m", "propellant_kg", "Plane"),
        MapFigure("max_position_error_m", "ve_pct", "oe_pct", "Map"),
        MapFigure("propellant_kg", "isp_s", "oe_pct", "Other map"),
    ]
    run.manifest["figures"] = [to_record(figure) for figure in run.manifest["figures"]]
    said = sentences(build(run, "run"))
    assert "Not drawn, the same in all cases that have it: pulse count." in said
    assert "Not drawn, no case has a number: max position error." in said
    assert "Not drawn, the same in all saved cases at all times: force." in said
    assert "Not drawn, no saved case has a number: position error." in said
    assert "Profile: not drawn; no saved case has both force and position error." in said
    assert "Plane: not drawn; no case has both max position error and propellant." in said
    assert "Map: not drawn; no case has a number for all of max position error, ve, oe." in said
    assert "Not drawn: Other map (the run does not disperse the isp)." in said
    names = [column["name"] for column in run.manifest["columns"] if column["role"] in ("metric", "dispersion")]
    assert not [(name, one) for name in names if "_" in name for one in said if name in one]


def approaching(at_most):
    """A run whose saved position errors fall to the metric at the end, on which there is an upper limit."""
    run = synthetic_run(300, failed=0)
    ends = np.linspace(0.1, 0.5, 40)
    run.table.loc[:39, "max_position_error_m"] = ends
    run.manifest["columns"] = [
        column | ({"name": "final_position_error_m"} if column["name"] == "max_position_error_m" else {})
        for column in run.manifest["columns"]
    ]
    run.table = run.table.rename(columns={"max_position_error_m": "final_position_error_m"})
    run.nominal_row["final_position_error_m"] = 0.1
    t = np.linspace(0.0, 10.0, 51)
    frames = [
        pd.DataFrame({"case_id": case, "t_s": t, "position_error_m": end + 900.0 * (1.0 - t / 10.0)})
        for case, end in enumerate(ends)
    ]
    run.history = pd.concat(frames, ignore_index=True)
    record = {"name": "end", "metric": "final_position_error_m", "at_least": None, "share": 0.9, "confidence": 0.9}
    run.manifest["requirements"] = [record | {"at_most": at_most}]
    return run


def with_first(y):
    """`approaching` with this position error at the first sample of every flight."""
    run = approaching(1.0)
    run.history.loc[run.history["t_s"] == 0.0, "position_error_m"] = y
    return run


def climbing_away():
    """`approaching`, whose flights come nearest in the middle of the flight."""
    run = approaching(1.0)
    t = run.history["t_s"].to_numpy()
    nearest = run.table["final_position_error_m"].to_numpy()[run.history["case_id"].to_numpy()]
    run.history["position_error_m"] = nearest + 180.0 * np.abs(t - 5.0)
    return run


@pytest.mark.parametrize(
    ("run", "words"),
    [
        (approaching(1.0), "limit at the end of the flight"),
        (with_first(0.0), "limit at the end of the flight"),
        (climbing_away(), "limit to reach once"),
    ],
)
def test_a_limit_on_the_other_end_of_a_history_says_when_it_holds(run, words):
    """All flights are 900 m off at some time: none must stay below the line."""
    (limit,) = history_limits(Flown(run, "run"), ["position_error_m"])["position_error_m"]
    assert limit.name == f"{words}: final position error ≤ 1\u202fm"
    assert (limit.at, limit.axis, limit.key) == (1.0, "y", words)


def test_a_limit_that_flights_meet_as_they_begin_is_not_drawn():
    run = approaching(1.0)
    run.history["position_error_m"] = run.history["position_error_m"].to_numpy()[::-1]
    run.history["case_id"] = run.history["case_id"].to_numpy()[::-1]
    assert history_limits(Flown(run, "run"), ["position_error_m"]) == {}


@pytest.mark.parametrize(
    ("distribution", "told"),
    [
        ("normal, 3σ = 0.5 deg/day", "normal, 3σ\xa0=\xa00.5\u202fdeg/day"),
        ("uniform, up to 1 day", "uniform, up to 1\u202fday"),
        ("values of winds_1e3.csv, dv^2_m", "values of winds_1e3.csv, dv^2_m"),
    ],
)
def test_names_and_rates_of_a_distribution_stay_as_they_are(distribution, told):
    assert distribution_text({"distribution": distribution, "bounds": ""}) == told


def test_the_table_of_inputs_has_bounds_powers_and_ends_that_differ():
    assert (
        distribution_text({"distribution": "uniform", "bounds": "-0.02 to 0.02 day"})
        == "uniform, −0.02 to 0.02\u202fdays"
    )
    assert (
        distribution_text({"distribution": "normal, 3σ = 1e-05 kg m^2", "bounds": ""})
        == "normal, 3σ\xa0=\xa01·10⁻⁵\u202fkg m²"
    )
    run = synthetic_run(300, failed=0)
    run.table["ve_pct"] = 54.99 + 1e-5 * np.linspace(-1.0, 1.0, 300)
    low, high = input_table(Flown(run, "run")).rows[0][3].text.split(" to ")
    assert low != high
    assert float(low) == pytest.approx(54.98999, abs=1e-7)


@pytest.mark.parametrize(("switches", "told"), [([True, False, True], "no, yes"), ([False, False, False], "no")])
def test_the_drawn_values_of_a_switch_have_the_words_of_its_nominal_value(switches, told):
    run = synthetic_run(300, failed=0)
    run.table["backup"] = np.resize(switches, 300)
    fact = {"name": "backup", "unit": "", "description": "a switch"}
    run.manifest["columns"].append({**fact, "role": "dispersion"})
    run.manifest["inputs"].append({**fact, "nominal": True, "distribution": "discrete", "source": ""})
    row = input_table(Flown(run, "run")).rows[-1]
    assert (row[1].text, row[3].text) == ("yes", told)


def test_the_spread_of_an_event_has_a_unit_of_its_own():
    """A transfer of days with σ of seconds: 55 s, not 6.4·10⁻⁴ days."""
    run = synthetic_run(400, failed=0)
    draws = np.random.Generator(np.random.Philox(key=5)).normal(size=400)
    run.table["settling_time_s"] = 172_800.0 + 55.0 * draws
    run.nominal_row["settling_time_s"] = 172_800.0
    settling = run.manifest["requirements"][2]
    run.manifest["requirements"][2] = {**settling, "at_most": 864_000.0}
    tables = {one.caption: one for one in blocks_of(build(run, "run"), Table)}
    (row,) = [row for row in tables["Timeline of the nominal case"].rows if row[0].text == "Settling"]
    assert row[1].text == "2\u202fdays"
    assert re.fullmatch(r"5\d\.\d\u202fs", row[2].text)


def test_a_time_that_spreads_by_seconds_stays_in_seconds():
    run = synthetic_run(400, failed=0)
    draws = np.random.Generator(np.random.Philox(key=6)).normal(size=400)
    run.table["settling_time_s"] = 20_788.0 + draws
    run.nominal_row["settling_time_s"] = 20_788.0
    run.manifest["requirements"] = run.manifest["requirements"][:1]
    tables = {one.caption: one for one in blocks_of(build(run, "run"), Table)}
    assert any(row[0].text == "settling time [s]" for row in tables["Statistics of the metrics"].rows)


def test_two_requirements_that_are_met_are_both_met():
    record = {"metric": "propellant_kg", "at_least": None, "at_most": 1e3, "share": 0.9, "confidence": 0.9}
    run = synthetic_run(200, failed=0, requirements=[record | {"name": name} for name in ("a", "b")])
    assert build(run, "run").subtitle == "Both requirements are met."


def test_scatter_plots_without_a_footprint_are_called_so():
    titles = [section.title for section in build(synthetic_run(200), "run").sections]
    assert "Scatter plots" in titles
    assert not any("ootprint" in title for title in titles)
