"""Choices compared on the same cases."""

import json

import numpy as np
import pytest
from landing_run import landing_run

from reports.contents import build
from reports.document.blocks import FigureBlock, Table
from reports.drawing import paper, screen
from reports.drawing.marks import Points
from reports.figures.rows import level_panel
from reports.text.numbers import SPACE

LAWS = ("none", "one", "two")


def choices(document):
    section = next(one for one in document.sections if one.anchor == "levels")
    tables = {block.caption: block for block in section.blocks if isinstance(block, Table)}
    return next(block for block in section.blocks if isinstance(block, FigureBlock)), tables


def flown(n=200, **changes):
    run = landing_run(n, failed=0, laws=LAWS, **changes)
    offset = run.table["law"].map({"none": 0.0, "one": 0.5, "two": -0.25})
    run.table["peak_load_g"] += offset
    run.manifest["campaign"]["design"] = "table"
    return run


def test_pairs_bring_out_the_shift_of_each_level():
    _, tables = choices(build(flown(), "run"))
    rows = {row[0].text: row for row in tables["Peak load [g] by law"].rows}
    assert list(rows) == list(LAWS)  # the nominal level first
    assert rows["one"][5].value == pytest.approx(0.5, abs=1e-9)
    assert rows["two"][5].value == pytest.approx(-0.25, abs=1e-9)
    assert rows["two"][6].text == "200 of 200"
    assert rows["none"][5].text == "–"
    assert {row[1].text for row in rows.values()} == {"200 / 200"}


def test_levels_stand_in_the_order_of_the_models_choices_after_the_nominal_one():
    run = flown(inputs=[{"name": "law", "choices": ["two", "none", "not flown", "one"]}])
    _, tables = choices(build(run, "run"))
    assert [row[0].text for row in tables["Peak load [g] by law"].rows] == ["none", "two", "one"]


def test_the_figure_holds_the_quantiles_of_each_level():
    run = flown()
    figure, _ = choices(build(run, "run"))
    drawing = figure.drawing
    assert "200 sets of cases differ in it alone" in figure.caption
    panel = next(one for one in drawing.plots if one.title == "peak load [g]")
    values = run.table[run.table["law"] == "two"]["peak_load_g"]
    (medians,) = [mark for mark in panel.marks if isinstance(mark, Points)]
    (spread,) = [mark for mark in panel.marks if mark.key == "5 % to 95 %" and mark.y[0] == 2]
    assert spread.x == pytest.approx(values.quantile([0.05, 0.95]).to_numpy(), rel=1e-12)
    assert medians.x[2] == pytest.approx(values.median(), rel=1e-12)
    json.dumps(screen.specifications(drawing), allow_nan=False)
    assert "<svg" in paper.svg(drawing)


def test_medians_that_differ_never_print_alike():
    quantiles = 2460000.5 + 0.01 * np.array([np.linspace(-3.0, 3.0, 7), np.linspace(-2.9, 3.1, 7)])
    (*_, medians) = level_panel("day", ["a", "b"], quantiles, [100, 100]).marks
    told = [text.rpartition("median ")[2].replace(SPACE, "") for text in medians.texts]
    assert told == ["2460000.5", "2460000.501"]


def test_few_cases_of_a_level_have_no_percentiles():
    """A box from 5 % to 95 % of three cases was drawn between them, where no case is."""
    quantiles = np.sort(np.random.Generator(np.random.Philox(key=6)).normal(size=(3, 7)), axis=1)
    drawn = [mark.key for mark in level_panel("load", ["a", "b", "c"], quantiles, [3, 19, 20]).marks[:-1]]
    ends, wide, half = "all cases", "5 % to 95 %", "middle half of the cases"
    assert drawn == [ends, ends, half, ends, wide, half]


@pytest.mark.parametrize(("side", "percent", "end"), [("at_most", 0.9, "Largest"), ("at_least", 0.1, "Smallest")])
def test_the_outer_percentile_and_the_end_are_those_on_the_side_of_the_limit(side, percent, end):
    limit = {"name": "load", "metric": "peak_load_g", "share": 0.9, "confidence": 0.9, side: 5.0}
    run = flown(requirements=[limit])
    run.manifest["report"] = {"probability": 0.9, "confidence": 0.9}
    _, tables = choices(build(run, "run"))
    table = tables["Peak load [g] by law"]
    assert [column.title for column in table.columns[2:5]] == ["Median", f"{100 * percent:g}\u202f%", end]
    loads = run.table[run.table["law"] == "two"]["peak_load_g"]
    (row,) = [row for row in table.rows if row[0].text == "two"]
    assert row[3].value == pytest.approx(loads.quantile(percent), abs=0.05 * loads.std())
    assert row[4].value == (loads.max() if side == "at_most" else loads.min())


def test_chosen_cases_have_ranges_in_place_of_intervals():
    run = flown()
    run.manifest["campaign"]["design"] = "grid"
    _, tables = choices(build(run, "run"))
    table = tables["Peak load [g] by law"]
    assert [column.title for column in table.columns[2:5]] == ["Smallest", "Median", "Largest"]
    assert table.rows[1][2].value == run.table[run.table["law"] == table.rows[1][0].text]["peak_load_g"].min()
    assert table.rows[1][5].small == "0.5 to 0.5"
    assert "there is no interval" in table.note


def test_levels_on_different_draws_are_not_paired():
    run = flown()
    draw = np.random.Generator(np.random.Philox(key=7))
    run.table["speed_m_s"] = draw.normal(7800.0, 5.0, 600)
    figure, tables = choices(build(run, "run"))
    assert "on different cases" in figure.caption
    assert {row[5].text for row in tables["Peak load [g] by law"].rows} == {"–"}


def test_a_level_whose_cases_all_failed_is_said_and_drawn_empty():
    run = flown()
    run.table.loc[run.table["law"] == "two", "status"] = "not-finite"
    figure, tables = choices(build(run, "run"))
    row = tables["Peak load [g] by law"].rows[2]
    assert (row[1].text, row[2].text, row[5].small) == ("0 / 200", "–", "0 of 200 pairs")
    json.dumps(screen.specifications(figure.drawing), allow_nan=False)
    assert "<svg" in paper.svg(figure.drawing)


def test_all_failed_is_a_sentence():
    run = flown()
    run.table["status"] = "not-finite"
    assert "law: no metric differs between its levels." in repr(build(run, "run").sections)


def test_one_level_or_numbers_are_no_choice():
    assert "levels" not in [section.anchor for section in build(landing_run(60), "run").sections]


def test_levels_far_apart_stand_on_a_logarithmic_axis():
    apart = np.outer([1.0, 100.0], np.linspace(1.0, 2.0, 7))
    assert level_panel("miss", ["a", "b"], apart, (9, 9)).x.log
    assert not level_panel("miss", ["a", "b"], apart - 2.0, (9, 9)).x.log
    assert not level_panel("miss", ["a"], apart[:1], (9,)).x.log
