"""The report of a tuning: front, published points, and a plain word where nothing is feasible."""

import json
from dataclasses import replace

import numpy as np
import pytest
from figure_marks import drawings, marks_of
from synthetic_tuning import synthetic_tuning

import reports
from mc_engine.studies.tuning_folder import UNFINISHED, tuning_lines
from reports.document.blocks import FigureBlock, Table, Text, blocks_of
from reports.drawing import paper, screen
from reports.drawing.marks import Points
from reports.formats.html import render_html
from reports.formats.pdf import render_pdf
from reports.studies.tuning import build_tuning
from reports.text.numbers import SPACE


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    return synthetic_tuning(tmp_path_factory.mktemp("tuning") / "out")


@pytest.fixture(scope="module")
def document(record):
    return build_tuning(record, "out")


@pytest.fixture(scope="module")
def infeasible(tmp_path_factory):
    return build_tuning(synthetic_tuning(tmp_path_factory.mktemp("tuning") / "out", limit=-1.0), "out")


@pytest.fixture(scope="module")
def without_numbers(tmp_path_factory):
    return build_tuning(synthetic_tuning(tmp_path_factory.mktemp("tuning") / "out", limit=-1.0, failed=10), "out")


def table(document, caption):
    (found,) = [block for block in blocks_of(document, Table) if block.caption.startswith(caption)]
    return found


def front_of(document):
    return drawings(document, "front")[0]


def test_the_front_is_drawn_with_every_candidate_and_the_published_points(record, document):
    drawing = front_of(document)
    (front,) = marks_of(drawing, Points, "front")
    np.testing.assert_array_equal(np.column_stack([front.x, front.y]), record.front[["cost", "error"]])
    keys = [mark.key for mark in drawing.key]
    kinds = [text for text in keys if text.startswith(("feasible: ", "outside a constraint: "))]
    assert sum(int(text.split()[-2]) for text in kinds) == 300
    assert {"Table 8 of the source", "Table 9 of the source"} <= set(keys)
    assert any("front: " in mark.key for mark in drawing.key)
    low, high = drawing.plots[0].x.reach
    assert low < -0.9 < 0.9 < high


def test_a_published_point_is_beaten_or_not(document):
    rows = table(document, "Published points").rows
    said = {row[0].text: row[-2] for row in rows}
    assert said["Table 8 of the source"].text == "no worse in any objective"
    assert said["Table 8 of the source"].tone == "good"
    assert said["Table 9 of the source"].text.endswith("worse in one")


def test_no_table_of_the_source_reads_like_a_table_of_the_report(document):
    constraint = table(document, "Objectives and constraints").rows[-1]
    parameter = table(document, "Tuned parameters").rows[0]
    assert (constraint[-1].text, parameter[-1].text) == ("Table 5 of the source", "Table 2 of the source")


def test_the_ends_of_a_narrow_front_are_told_apart(record):
    """7827.2131 and 7827.2141 m/s both read 7827 on the page and 7827.21 on the command line."""
    front = record.front.assign(cost=7827.2131 + 0.001 * record.front["cost"], gain=100.0 + 1e-3 * record.front["gain"])
    front.attrs = record.front.attrs
    narrow = replace(record, front=front)
    document = build_tuning(narrow, "out")
    best, other = (f"{end:.6f}" for end in (front["cost"].min(), front["cost"].max()))
    assert float(document.costs[0].answer.split(SPACE)[0]) == pytest.approx(float(best), abs=2e-6)
    assert float(document.costs[0].detail.split(" to ")[1].split(SPACE)[0]) == pytest.approx(float(other), abs=2e-6)
    low, high = table(document, "Tuned parameters").rows[0][3].text.split(" to ")
    assert float(low) < float(high)
    (line,) = [line for line in tuning_lines(narrow) if line.startswith("  cost")]
    assert float(line.split()[1]) == pytest.approx(float(best), abs=2e-6)
    assert float(line.split()[3]) == pytest.approx(float(other), abs=2e-6)


def test_a_limit_that_is_just_missed_is_told_apart_from_what_was_found(tmp_path):
    """2836.424 s where at most 2836.42 s is allowed read 2836 s, which would have been allowed."""
    record = synthetic_tuning(tmp_path / "out", limit=-1.0)
    record.evaluations["limited"] = 2836.424
    (constraint,) = record.manifest["tuning"]["constraints"]
    constraint["at_most"] = 2836.42
    document = build_tuning(record, "out")
    told = "limited 2836.424 s where at most 2836.42 is allowed"
    assert told in "\n".join(tuning_lines(record))
    assert told in document.subtitle
    assert "smallest found is 2836.424" in document.verdicts[0].detail


def test_the_table_of_the_front_is_the_front(record, document):
    rows = table(document, "The front").rows
    shown = [row[0].value for row in rows]
    assert set(shown) <= set(record.front["candidate"])
    assert shown[0] == record.front["candidate"].iloc[0]
    assert shown[-1] == record.front["candidate"].iloc[-1]


def test_infeasibility_is_stated_with_the_least_violation_and_never_hidden(infeasible):
    assert infeasible.subtitle.startswith("No feasible point among 300 candidates; the least violation found is")
    assert "where at most −1 is allowed" in infeasible.subtitle
    assert infeasible.warnings[0].startswith("There is no front")
    assert infeasible.verdicts[0].answer == "not reached"  # by a search that ended, not by any design
    assert infeasible.verdicts[0].tone == "bad"
    assert not infeasible.costs  # what a forbidden candidate reaches is no key result
    drawing = front_of(infeasible)
    assert not any(mark.key.startswith("feasible") for mark in drawing.key)
    assert any("constraints are left out" in mark.key for mark in drawing.key)
    assert len(table(infeasible, "The least violation found").rows) == 1
    assert table(infeasible, "Published points").rows[0][-2].small == "outside a constraint"


def test_a_feasible_search_has_no_such_warning(document):
    assert document.warnings == ()
    assert document.verdicts[0].answer == "reached"
    assert "beaten by no other" in document.subtitle


def test_three_objectives_have_a_panel_for_each_pair(tmp_path):
    drawing = front_of(build_tuning(synthetic_tuning(tmp_path / "out", third=True), "out"))
    assert len(screen.specifications(drawing)) == 3
    assert paper.svg(drawing).count("<clipPath") == 3


def test_failed_cases_are_told(tmp_path):
    found = build_tuning(synthetic_tuning(tmp_path / "out", failed=3), "out")
    assert found.warnings == (
        "90 candidates had cases that failed; each of these takes the worst rank. Most often, with 90 candidates: "
        "refused: too far.",
    )


def test_the_note_of_the_campaign_is_told_with_the_problem(record):
    campaign = {**record.manifest["campaign"], "note": "Wheels of May.\n\nNot weighed.\n"}
    document = build_tuning(replace(record, manifest={**record.manifest, "campaign": campaign}), "out")
    (problem,) = [section for section in document.sections if section.anchor == "question"]
    assert problem.blocks[:2] == (Text(("Wheels of May.",)), Text(("Not weighed.",)))


def test_one_candidate_is_counted_as_one(tmp_path):
    found = build_tuning(synthetic_tuning(tmp_path / "out", n=10, failed=1), "out")
    assert found.warnings[0].startswith("1 candidate had cases that failed; each of these takes the worst rank. Most")
    assert "with 1 candidate: refused" in found.warnings[0]


@pytest.mark.parametrize(("goal", "word"), [("minimise", "up"), ("maximise", "down")])
def test_the_other_end_of_the_front_is_worse(record, goal, word):
    plan = record.manifest["tuning"]
    objectives = [{**objective, "goal": goal} for objective in plan["objectives"]]
    found = build_tuning(
        replace(record, manifest={**record.manifest, "tuning": {**plan, "objectives": objectives}}), "out"
    )
    assert f"; {word} to " in found.costs[0].detail


def test_a_search_that_was_killed_is_reported_with_what_it_has(tmp_path):
    found = build_tuning(synthetic_tuning(tmp_path / "out", end=UNFINISHED), "out")
    assert found.warnings == ("The search had not ended, or was killed, after 30 of 30 generations.",)
    progress = [block.drawing for block in blocks_of(found, FigureBlock) if block.caption == "Progress of the search"]
    assert [[plot.title for plot in one.plots] for one in progress] == [["feasible candidates so far"]]
    assert render_pdf(found).startswith(b"%PDF")


def test_both_renderers_take_it_and_give_the_same_bytes_twice(document, infeasible, without_numbers):
    for one in (document, infeasible, without_numbers):
        page = render_html(one)
        assert b"Tuning report" in page
        assert page == render_html(one)
        assert render_pdf(one) == render_pdf(one)
        for block in blocks_of(one, FigureBlock):
            json.dumps(screen.specifications(block.drawing), allow_nan=False)
            assert paper.svg(block.drawing) == paper.svg(block.drawing)


def test_reports_of_a_tuning_are_written_beside_its_tables(record):
    assert [path.name for path in reports.write_reports(record.path)] == ["report.html", "report.pdf"]
    assert (record.path / "report.pdf").read_bytes().startswith(b"%PDF")


def test_a_search_without_constraints_does_not_claim_limits_and_names_the_requirements_left_out(record):
    assert build_tuning(record, "out").subtitle.endswith("inside all constraints and beaten by no other.")
    free = {**record.manifest, "tuning": {**record.manifest["tuning"], "constraints": []},
            "requirements": [{"name": "soft", "metric": "speed_m_s"}]}  # fmt: skip
    made = build_tuning(replace(record, manifest=free), "out")
    assert made.subtitle.endswith("beaten by no other; the search has no constraint.")
    assert any("fail them" in warning and warning.endswith("requirements soft.") for warning in made.warnings)
    assert any("requirements soft" in line for line in tuning_lines(replace(record, manifest=free)))
