"""The report of a rare event: verdict, failures, levels and cost, on the screen and on paper."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from figure_marks import classes

import reports
from mc_engine.store.parts import Column
from mc_engine.store.result_folder import write_result
from mc_engine.store.run_files import RARE_EVENT
from mc_engine.studies.rare_event_folder import open_rare_event, probability_words, rare_event_lines
from reports.document.blocks import FigureBlock, Table, Text, blocks_of
from reports.drawing import screen
from reports.studies.rare_events import build_rare_event

MANIFEST = {
    "created_utc": "2026-01-02T03:04:05.000Z",
    "engine": "0.2.0",
    "seed_contract": 1,
    "campaign": {"name": "toy", "title": "Toy <b>", "model": "toy", "digest": "d", "seed": 7, "cases": 9},
    "model": {"title": "A toy", "source": "", "digest": "m"},
    "inputs": [
        {"name": "a_pct", "unit": "%", "description": "a", "distribution": "normal", "bounds": "", "source": ""}
    ],
    "provenance": {},
}


def level(margin, probability, cases=9_000):
    return {"margin": margin, "probability": probability, "runs": 10, "cases": cases, "accepted": 0.44}


def estimated(path, **changes):
    one = {"name": "a_pct", "unit": "%", "description": "a", "mean_sigma": 4.3, "spread_sigma": 0.2}
    result = {
        "asked": {"method": "subset", "cases_per_level": 10_000},
        "requirement": {
            "name": "fuel", "metric": "fuel_kg", "at_most": 2.5, "at_least": None, "share": 0.9973, "confidence": 0.9,
            "source": "tank",
        },
        "metric": {"name": "fuel_kg", "unit": "kg", "description": "fuel"},
        "method": "subset", "probability": 2e-5, "lower": 1.5e-5, "upper": 2.7e-5, "confidence": 0.95,
        "relative_error": 0.13, "plain_cases": 2.96e6, "cases": 46_000, "failed": 3_000, "no_number": 0,
        "levels": [level(None, 1.0, 10_000), level(1.4, 0.1), level(0.6, 1e-2), level(0.2, 1e-3), level(0.05, 1e-4)],
        "inputs": [{**one, "likeliest": 27.0, "likeliest_sigma": 4.1}],
        "remarks": [],
    }  # fmt: skip
    result.update(changes)
    columns = [Column("case_id", "", "case", "number", "integer"), Column("weight", "", "case", "weight")]
    arrays = {"case_id": np.arange(3), "weight": np.array([0.5, 0.5, 2e-5])}
    record = {**MANIFEST, "rare_event": result}
    write_result(path, RARE_EVENT, "[campaign]\n", record, {"cases": (columns, arrays)})
    return open_rare_event(path)


def table(document, caption):
    (found,) = [block for block in blocks_of(document, Table) if block.caption == caption]
    return [[cell.text for cell in row] for row in found.rows]


def test_the_headline_is_the_probability_against_what_is_allowed(tmp_path):
    document = build_rare_event(estimated(tmp_path), "out")
    interval = "95\u202f% confidence interval 1.5·10⁻⁵ to 2.7·10⁻⁵"
    assert document.subtitle == f"P(fuel > 2.5\u202fkg) = 2·10⁻⁵ ({interval}). Requirement met."
    (card,) = document.verdicts
    assert (card.answer, card.tone) == ("met", "good")
    assert f"{interval}; allowed: 0.0027 with 90\u202f% confidence. Source: tank." in card.detail
    wider = "the interval is a fifth wider than the scatter of the runs gives (log-normal, Student’s t)."
    assert document.costs[0].detail.endswith(
        wider
    )  # "than this error gives" before: of ten runs it is up to twice as wide
    assert document.costs[1].detail.startswith("Plain Monte Carlo needs 2\u202f960\u202f000 for the same")


@pytest.mark.parametrize(
    ("lower", "upper", "answer"), [(1e-3, 2e-3, "met"), (1e-3, 4e-3, "open"), (3e-3, 4e-3, "not met")]
)
def test_the_verdict_is_where_the_interval_lies(tmp_path, lower, upper, answer):
    record = estimated(tmp_path, probability=0.5 * (lower + upper), lower=lower, upper=upper)
    assert build_rare_event(record, "out").verdicts[0].answer == answer


def test_the_printed_interval_holds_the_one_that_was_found(tmp_path):
    record = estimated(tmp_path, lower=1.4996e-5, upper=2.7001e-5)
    assert "interval 1.49·10⁻⁵ to 2.71·10⁻⁵" in build_rare_event(record, "out").subtitle
    assert "interval 1.49e-05 to 2.71e-05" in probability_words(record.result)
    none = {**record.result, "probability": 0.0, "lower": 0.0, "upper": 2.9956e-4}  # 1 - 0.05**(1/10000)
    assert probability_words(none).startswith("below 0.0003, the upper end of the 95 % interval;")


def test_levels_and_failed_inputs_are_listed_and_drawn(tmp_path):
    document = build_rare_event(estimated(tmp_path), "out")
    assert [row[1] for row in table(document, "Levels")] == ["all", "1.4", "0.6", "0.2", "0.05"]
    assert table(document, "Failed cases by input") == [["a_pct [%]", "4.3", "0.2", "27"]]
    (figure,) = blocks_of(document, FigureBlock)
    _, levels, *_ = figure.drawing.plots[0].marks
    np.testing.assert_array_equal(levels.y, [0.1, 1e-2, 1e-3, 1e-4])
    interval, point = screen.specifications(figure.drawing)[0]["data"][-2:]
    assert interval["y"] == [pytest.approx(1.5e-5), pytest.approx(2.7e-5), None]
    assert interval["x"][:2] == 2 * point["x"]
    assert "2·10⁻⁵ (95\u202f% confidence interval 1.5·10⁻⁵ to 2.7·10⁻⁵)" in figure.drawing.alternative


def test_without_a_failed_case_the_report_says_below(tmp_path):
    nothing = {"probability": 0.0, "lower": 0.0, "upper": 3e-4, "failed": 0, "inputs": [], "method": "plain"}
    record = estimated(
        tmp_path,
        **nothing,
        relative_error=None,
        plain_cases=None,
        levels=[level(None, 1.0)],
        remarks=["The probability is smaller than 1.2e-14."],
    )
    document = build_rare_event(record, "out")
    bound = "0.0003 (upper end of the 95\u202f% confidence interval)"
    assert document.subtitle == f"No case failed: P(fuel > 2.5\u202fkg) < {bound}. Requirement met."
    assert document.warnings == ("The probability is smaller than 1.2·10⁻¹⁴.",)
    assert document.verdicts[0].detail.startswith(
        f"No case failed: probability of failure below {bound}; allowed: 0.0027 with 90\u202f% confidence."
    )
    assert document.costs == ()  # there is no standard error of nothing
    assert "add up" not in repr(document.sections[0])
    assert not list(blocks_of(document, FigureBlock))


def test_the_note_of_the_campaign_is_told_with_the_inputs(tmp_path):
    record = estimated(tmp_path)
    campaign = {**record.record["campaign"], "note": "Tanks of May.\n\nNot weighed.\n"}
    document = build_rare_event(replace(record, record={**record.record, "campaign": campaign}), "toy")
    (inputs,) = [section for section in document.sections if section.anchor == "inputs"]
    assert inputs.blocks[:2] == (Text(("Tanks of May.",)), Text(("Not weighed.",)))


def test_page_and_paper_are_written_and_names_stay_text(tmp_path):
    estimated(tmp_path)
    pages = {path.name: path.read_bytes() for path in reports.write_reports(tmp_path)}
    assert b"Toy &lt;b&gt;" in pages["report.html"]
    assert b"Toy <b>" not in pages["report.html"]
    assert pages["report.pdf"].startswith(b"%PDF")


def test_failed_cases_are_a_scatter_of_the_two_inputs_they_lie_farthest_in(tmp_path):
    draw = np.random.Generator(np.random.Philox(key=4))
    record = estimated(tmp_path, failed=300)
    one = record.result["inputs"][0]
    record.result["inputs"][:] = [
        {**one, "name": name, "likeliest_sigma": sigma, "likeliest": sigma}
        for name, sigma in zip("abc", (1, -5, 3), strict=True)
    ]
    cases = pd.DataFrame({name: draw.normal(size=1000) for name in "abc"})
    cases["failed"], cases["level"] = np.arange(1000) >= 700, np.arange(1000) // 500
    figure = next(blocks_of(build_rare_event(replace(record, cases=cases), "out"), FigureBlock))
    ordinary, failed, likeliest = figure.drawing.plots[0].marks
    np.testing.assert_array_equal(failed.x, cases["b"][700:])
    np.testing.assert_array_equal(failed.y, cases["c"][700:])
    assert (failed.size, failed.opacity) == (ordinary.size, ordinary.opacity)
    assert (failed.colour, failed.sign) != (ordinary.colour, ordinary.sign)
    assert (ordinary.x.size, likeliest.x[0], likeliest.y[0]) == (500, -5.0, 3.0)
    assert classes(figure.drawing) == {"drawn from the dispersions, not failed": 500, "failed": 300}


def test_command_line_and_report_round_the_accepted_fraction_alike(tmp_path):
    accepted = {1.0: "100", 0.996: "> 99", 0.568: "57", 4e-3: "< 1", 0.0: "0"}
    levels = [{**level(None, 1.0), "accepted": fraction} for fraction in accepted]
    record = estimated(tmp_path / "out", levels=levels)
    (table,) = [one for one in blocks_of(build_rare_event(record, "out"), Table) if one.caption == "Levels"]
    assert [row[-1].text for row in table.rows] == [f"{percent}\u202f%" for percent in accepted.values()]
    for percent in accepted.values():
        assert any(line.endswith(f" {percent} %") for line in rare_event_lines(record.result))
