"""Numbers are told in units that a person would choose, one per column in all of a report; its data keep their own."""

import dataclasses
import json
import re
from base64 import b64decode

import numpy as np
import pytest
from synthetic_run import synthetic_run

from reports.contents import build
from reports.document.blocks import FigureBlock, blocks_of
from reports.formats.html import case_record, render_html
from reports.formats.json_data import render_json
from reports.formats.markdown import render_markdown
from reports.run.chosen_units import ShownRun, chosen_unit, spread_text
from reports.run.flown import Flown
from reports.sections.requirement_tables import requirement_table
from reports.sections.tables import value_table
from reports.text.numbers import number


@pytest.mark.parametrize(
    ("unit", "numbers", "told"),
    [
        ("s", [8e5], "day"),
        ("s", [5000.0], "s"),
        ("s", [2e4], "h"),
        ("J/m^2", [9.4e7, 1.2e8], "MJ/m^2"),
        ("W/m^2", [5.8e5, 8e5], "kW/m^2"),
        ("m", [6.5e6], "km"),
        ("m", [1e307], "km"),
        ("km", [35786.0], "km"),  # there is no larger one
        ("deg", [0.004, 0.05], "deg"),
        ("deg", [0.0004], "arcsec"),
        ("m/s", [0.0, None, float("nan")], "m/s"),
        ("furlong", [1e9], "furlong"),
        ("", [1e9], ""),
    ],
)
def test_a_unit_is_changed_only_where_its_numbers_are_awkward(unit, numbers, told):
    assert chosen_unit(unit, numbers) == told


@pytest.mark.parametrize(
    ("value", "unit", "told"),
    [
        (12345.678901234567, "m", "12.3456789012 km"),
        (-9.441339751580646e-07, "m", "−0.94413398 µm"),
        (5.4, "km", "5.4 km"),
    ],
)
def test_a_parameter_that_is_rounded_is_rounded_in_the_unit_that_it_is_told_in(value, unit, told):
    table = value_table([{"name": "size_m", "unit": unit, "value": value, "description": "size"}], "Parameters")
    assert table.rows[0][1].text.replace("\u202f", " ") == told


@pytest.fixture(scope="module")
def slow():
    """A run whose settling takes days, and whose limit says so in seconds."""
    run = synthetic_run(400, failed=3)
    run.table["settling_time_s"] = 800_000.0 + 1000.0 * run.table["ve_pct"]
    run.nominal_row["settling_time_s"] = 800_000.0
    settling = run.manifest["requirements"][2]
    run.manifest["requirements"][2] = {**settling, "at_most": 820_000.0}
    run.history["t_s"] *= 1000.0
    return run


def test_a_grid_is_told_in_the_units_of_its_values_though_it_has_no_percentiles():
    run = synthetic_run(400, failed=0)
    run.manifest["requirements"], run.nominal_row["settling_time_s"] = [], 1e-9
    for design in ("mc", "grid"):
        run.manifest["campaign"]["design"] = design
        assert ShownRun(Flown(run, "run")).unit("settling_time_s") == "s"


def test_a_metric_has_one_unit_on_all_pages_and_on_the_axes(slow):
    document = build(slow, "run")
    text = render_markdown(document).decode().replace("\\", "")
    assert "settling time [days]" in text
    assert "at most 9.4907407\u202fdays" in text
    assert not re.search(r"settling time [^.|]*\[s\]|8[0-9]{5}|8\.[0-9]+·10⁵", text)
    assert "settling time [s]" not in render_html(document).decode()
    axes = [plot.x.label for one in blocks_of(document, FigureBlock) for plot in one.drawing.plots]
    assert "settling time [days]" in axes
    assert "time [days]" in axes


def test_a_small_metric_keeps_its_unit_though_the_output_of_its_name_is_large_in_flight(slow):
    run = dataclasses.replace(slow, history=slow.history.assign(settling_time_s=9e5))
    assert ShownRun(Flown(run, "run")).unit("settling_time_s") == "day"  # both ask for it
    run.history["settling_time_s"] = 9.0
    assert ShownRun(Flown(run, "run")).unit("settling_time_s") == "s"


def test_a_limit_close_to_large_values_keeps_its_digits():
    """A range of 1e9 m that may be exceeded by 4 mm: in km, limit and values would all read 1 000 000 km."""
    run = synthetic_run(2000, failed=0)
    run.table["max_position_error_m"] = 1e9 + 1e-3 * np.sin(np.arange(2000.0))
    run.manifest["requirements"] = [
        {"name": "range", "metric": "max_position_error_m", "at_most": 1e9 + 0.004, "share": 0.9, "confidence": 0.9}
    ]
    told = ShownRun(Flown(run, "run"))
    assert told.unit("max_position_error_m") == "m"
    (row,) = requirement_table(told).rows
    assert "1.000000000004·10⁹" in row[1].text
    low, high = (number(end, 4, told.summaries["max_position_error_m"].spread) for end in (1e9 - 1e-3, 1e9 + 1e-3))
    assert (low, high) == ("9.99999999999·10⁸", "1.000000000001·10⁹")


def test_a_spread_is_told_in_the_unit_of_its_metric_or_in_its_own():
    run = synthetic_run(200, failed=0)
    column = next(one for one in run.manifest["columns"] if one["name"] == "settling_time_s")
    run.table["settling_time_s"] = 800_000.0 + run.table["ve_pct"]
    run.nominal_row["settling_time_s"] = 800_000.0
    long = ShownRun(Flown(run, "run"))
    assert (long.unit("settling_time_s"), spread_text(long, "settling_time_s", 0.0)[-1]) == ("day", "s")
    column["unit"] = "deg"
    run.table["settling_time_s"] = 2.0 + 1e-7 * run.table["ve_pct"]
    run.nominal_row["settling_time_s"] = 2.0
    assert spread_text(ShownRun(Flown(run, "run")), "settling_time_s", 1e-6).endswith("\u202fdeg")


def test_verdicts_and_counts_are_those_of_the_columns_own_units(slow):
    own = Flown(slow, "run")
    told = ShownRun(own)
    assert [(one.passed, one.tried, one.outcome) for one in told.verdicts] == [
        (one.passed, one.tried, one.outcome) for one in own.verdicts
    ]
    limit = next(one for one in told.verdicts if one.name == "settling")
    assert limit.at_most == pytest.approx(820_000.0 / 86_400.0)
    summary = told.summaries["settling_time_s"]
    values = slow.table["settling_time_s"][: 400 - 3] / 86_400.0
    assert summary.mean == pytest.approx(values.mean())
    assert summary.sd == pytest.approx(values.std())
    assert summary.at(0.5).value == pytest.approx(np.quantile(values, 0.5, method="median_unbiased"))
    assert dataclasses.replace(own.summaries["propellant_kg"]) == told.summaries["propellant_kg"]


def test_the_data_of_a_report_stay_in_the_columns_own_units(slow):
    record = json.loads(render_json(build(slow, "run")))
    settling = next(one for one in record["requirements"] if one["name"] == "settling")
    assert (settling["unit"], settling["at_most"]) == ("s", 820_000.0)
    metric = next(one for one in record["metrics"] if one["name"] == "settling_time_s")
    assert metric["unit"] == "s"
    assert metric["mean"] == pytest.approx(slow.table["settling_time_s"][:397].mean(), rel=1e-12)


def test_a_single_case_is_drawn_over_time_in_the_unit_of_its_label(slow):
    record = case_record(build(slow, "run"))
    assert record["panel"]["xaxis"]["title"]["text"] == "time [days]"
    times = record["histories"]["-1"]["force_n"][0]
    own = slow.history.loc[slow.history["case_id"] == -1, "t_s"].max()
    assert max(np.frombuffer(b64decode(times["bdata"]), times["dtype"])) == pytest.approx(own / 86400.0, rel=1e-6)


def test_two_runs_over_one_another_have_the_units_of_the_first():
    first, second = (Flown(synthetic_run(50), name) for name in "ab")
    metric = next(fact.name for fact in first.with_role("metric") if fact.unit == "m")
    second.every.table[metric] *= 1e6
    assert ShownRun(second).unit(metric) == "km"
    shown = ShownRun(first)
    assert ShownRun(second, like=shown).unit(metric) == shown.unit(metric) != "km"
