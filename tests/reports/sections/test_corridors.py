"""The corridor: violated limits in colour, limits as lines."""

import json

import numpy as np
import pytest
from figure_marks import FORMS, classes, marks_of
from landing_run import REQUIREMENTS, landing_run

from reports.contents import build
from reports.document.blocks import FigureBlock, blocks_of
from reports.drawing import paper, screen
from reports.drawing.marks import Line, Points
from reports.formats.json_data import render_json


def corridor(document):
    section = next(one for one in document.sections if one.anchor == "corridor")
    return next(block for block in section.blocks if isinstance(block, FigureBlock))


@pytest.fixture(scope="module")
def drawn():
    return corridor(build(landing_run(3000, failed=20), "run"))


def test_each_case_has_the_class_of_the_limits_that_it_violates(drawn):
    drawing = drawn.drawing
    assert drawing.form == FORMS["corridor"]
    table = landing_run(3000, failed=20).table.set_index("case_id")
    load, out, failed = table["peak_load_g"] > 9.0, table["exits"] > 0.0, table["status"] != "ok"
    words = {"inside all limits": ~load & ~out & ~failed, "beyond load": load & ~out, "beyond inside": out & ~load,
             "beyond load and inside": load & out, "failed": failed}  # fmt: skip
    assert classes(drawing) == {word: int(rows.sum()) for word, rows in words.items() if rows.any()}
    clouds = [mark for mark in marks_of(drawing, Points) if mark.cases is not None]
    assert len(clouds) > 1
    for cloud in clouds:
        assert words[cloud.name].loc[cloud.cases].all()


def test_the_limit_runs_where_the_closed_form_puts_it(drawn):
    (limit,) = marks_of(drawn.drawing, Line)  # of the load; exits are counts
    assert limit.text.startswith("peak load at most 9")
    points = np.column_stack([limit.x, limit.y])[np.isfinite(limit.x)]
    assert len(points) > 20
    load = 8.7 - 4.0 * (points[:, 1] + 2.0) + 0.02 * (points[:, 0] - 7800.0)
    assert load == pytest.approx(np.full(len(points), 9.0), abs=1e-3)


def test_both_limits_of_one_requirement_are_lines_of_the_same_kind():
    """The legend has one entry for their common words: two kinds of line would leave one of them unexplained."""
    between = {**REQUIREMENTS[0], "at_least": 8.5}
    run = landing_run(3000, failed=20, requirements=[between, *REQUIREMENTS[1:]])
    (limit,) = marks_of(corridor(build(run, "run")).drawing, Line)
    points = np.column_stack([limit.x, limit.y])[np.isfinite(limit.x)]
    load = 8.7 - 4.0 * (points[:, 1] + 2.0) + 0.02 * (points[:, 0] - 7800.0)
    assert set(np.round(load, 2)) == {8.5, 9.0}


def test_a_limit_that_the_two_columns_do_not_decide_is_not_drawn():
    run = landing_run(3000, failed=0)
    draw = np.random.Generator(np.random.Philox(key=6))
    run.table["peak_load_g"] = draw.normal(8.7, 0.3, 3000)
    assert not marks_of(corridor(build(run, "run")).drawing, Line)


def test_without_a_violation_a_sentence_says_that_all_cases_are_inside():
    run = landing_run(1000, failed=0)
    run.table = run.table.assign(peak_load_g=8.0 + 1e-3 * run.table["angle_deg"], exits=0.0)
    (section,) = [one for one in build(run, "run").sections if one.anchor == "corridor"]
    (said,) = section.blocks
    assert said.paragraphs == ("Entry corridor: not drawn; all cases are inside all limits.",)


def test_only_a_count_over_all_requirements_is_said_to_be_inside_all_limits():
    """The corridor has two of the three requirements: its cases are inside these two, the other counts inside all."""
    far = {"name": "far", "metric": "latitude_deg", "at_most": 54.1, "at_least": None, "share": 0.9, "confidence": 0.9}
    run = landing_run(300, failed=5, requirements=[*REQUIREMENTS, far])
    table = run.table
    two = (table["peak_load_g"] <= 9.0) & (table["exits"] <= 0.0)
    inside_all = int((two & (table["latitude_deg"] <= 54.1)).sum())
    assert 0 < inside_all < two.sum() < 295
    document = build(run, "run")
    in_corridor = classes(corridor(document).drawing)
    assert in_corridor["inside the limits of load, inside"] == int(two.sum())
    assert "inside all limits" not in in_corridor
    others = [classes(block.drawing) for block in blocks_of(document, FigureBlock)]
    said = [found["inside all limits"] for found in others if "inside all limits" in found]
    assert json.loads(render_json(document))["counts"]["inside_all_limits"] == inside_all
    assert set(said) == {inside_all}
    run = landing_run(300, failed=0, requirements=[*REQUIREMENTS, far])
    run.table = run.table.assign(peak_load_g=8.0 + 1e-3 * table["angle_deg"], exits=0.0)
    (section,) = [one for one in build(run, "run").sections if one.anchor == "corridor"]
    assert section.blocks[0].paragraphs == (
        "Entry corridor: not drawn; all cases are inside the limits of load, inside.",
    )


@pytest.mark.parametrize("cases", [0, 1, pytest.param(2, marks=pytest.mark.slow), 60])
def test_few_failed_and_equal_cases_are_drawn_or_said(cases):
    for change in ({}, {"status": "not-finite"}, {"angle_deg": -2.0, "speed_m_s": 7800.0}, {"peak_load_g": np.nan}):
        run = landing_run(60, failed=0)
        run.table = run.table.assign(**change).head(cases)
        document = build(run, "run")
        for section in document.sections:
            for block in section.blocks:
                if isinstance(block, FigureBlock):
                    json.dumps(screen.specifications(block.drawing), allow_nan=False)
                    assert "<svg" in paper.svg(block.drawing)


def test_without_a_requirement_there_is_no_corridor():
    assert "corridor" not in [section.anchor for section in build(landing_run(60, requirements=[]), "run").sections]


def test_violations_that_are_too_many_to_draw_are_drawn_evenly_over_the_cases():
    """The first two thousand of them were drawn, and of a sorted table a tenth of those at its end."""
    run = landing_run(30_000, failed=0, requirements=[{**REQUIREMENTS[0], "at_most": 8.8}, REQUIREMENTS[1]])
    clouds = marks_of(corridor(build(run, "run")).drawing, Points)
    (cases,) = [mark.cases for mark in clouds if mark.name == "beyond load"]
    beyond = run.table["case_id"][(run.table["peak_load_g"] > 8.8) & ~(run.table["exits"] > 0.0)]
    assert len(beyond) > 4000 > len(cases)
    assert np.quantile(cases, (0.25, 0.5, 0.75)) == pytest.approx(np.quantile(beyond, (0.25, 0.5, 0.75)), rel=0.1)
