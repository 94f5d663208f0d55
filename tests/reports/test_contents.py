"""What a report says, before it is drawn."""

import numpy as np
import pytest
from figure_marks import drawings
from synthetic_run import synthetic_run

from mc_engine.model.figures import (
    CorridorFigure,
    HistoryFigure,
    MapFigure,
    ProfileFigure,
    ScatterFigure,
    to_record,
)
from reports.contents import build
from reports.document.blocks import FigureBlock, Table, blocks_of

RUN = "deorbit-20260421-101500"


@pytest.fixture(scope="module")
def document():
    return build(synthetic_run(), RUN)


def tables(document):
    return {block.caption: block for block in blocks_of(document, Table)}


def cells(table):
    return [[cell.text for cell in row] for row in table.rows]


def said(document):
    """Every text of the tables, headline and terms."""
    return repr(document)


def test_chapters_have_numbers_appendices_letters_and_parts_neither(document):
    numbers = {section.anchor: section.number for section in document.sections}
    assert [numbers[name] for name in ("requirements", "scenario", "worst")] == ["1", "2", "7"]
    assert [numbers[name] for name in ("metrics", "convergence", "reading")] == ["A", "D", "I"]
    assert numbers["maps"] == numbers["cases"] == ""


def test_figures_and_tables_are_numbered_in_reading_order(document):
    for kind in (FigureBlock, Table):
        numbers = [block.number for block in blocks_of(document, kind)]
        assert numbers == list(range(1, len(numbers) + 1))


def test_failed_requirements_come_first_in_the_headline(document):
    assert [(card.label, card.answer) for card in document.verdicts] == [
        ("force", "fail"), ("settling", "fail"), ("fuel", "pass"), ("all at once", "fail"),
    ]  # fmt: skip
    assert document.subtitle == "Of 3 requirements: 1 met, 2 failed."


def test_the_cost_comes_with_its_limit_and_the_cases_it_rests_on(document):
    (fuel,) = [card for card in document.costs if card.label == "propellant"]
    assert fuel.answer.startswith("at most 2.")
    assert "9\u202f988 of 10\u202f000 cases" in fuel.detail


def test_every_metric_says_how_many_cases_it_used_of_how_many_tried(document):
    for row in cells(tables(document)["Statistics of the metrics"]):
        assert row[1] == "9\u202f988 / 10\u202f000"


def test_failed_cases_are_listed_with_their_status_and_its_meaning(document):
    ended = cells(tables(document)["Completion of the cases"])
    assert ended[0][:2] == ["ok", "9\u202f988"]
    assert ended[1][:2] == ["not-finite", "12"]
    assert "infinite" in ended[1][3]
    assert "the guidance lost its way" in ended[2][3]
    assert "Failed cases: the first 10 of 12" in tables(document)


def test_the_worst_case_comes_with_the_command_that_repeats_it(document):
    run = synthetic_run()
    worst = int(run.table["propellant_kg"].idxmax())
    row = cells(tables(document)["Cases with the largest propellant"])[0]
    assert row[0].replace("\u202f", "") == str(worst)
    assert row[-1] == f"mc-engine replay . {worst}"


def test_the_map_says_that_it_is_smoothed_and_from_how_many_cases(document):
    drawing = drawings(document, "map")[0]
    key = " ".join(mark.key for mark in drawing.key)
    assert "local quadratic regression on the 24 nearest of 9\u202f988 of 10\u202f000 cases" in key
    assert "; error 3.98·10⁻⁵ (median) to 0.013\u202fkg (largest)" in key
    assert "of 9\u202f988 shown" in key


def test_a_map_of_what_is_the_same_in_all_cases_is_a_sentence():
    run = synthetic_run(n=200)
    run.table["propellant_kg"] = 1.5
    assert "not drawn; propellant is 1.5\\u202fkg in all cases" in said(build(run, RUN))


def test_a_metric_that_differs_by_rounding_is_one_short_number_that_is_the_same_in_all_cases():
    run = synthetic_run(n=200, failed=5)
    run.table["propellant_kg"] = np.where(run.table["status"] == "ok", 1.5 + 2e-16 * run.table["case_id"] % 2, np.nan)
    run.nominal_row["propellant_kg"] = 1.5 - 2**-52
    document = build(run, RUN)
    (card,) = [one for one in document.costs if one.label == "propellant"]
    assert (card.answer, card.detail) == (
        "1.5\u202fkg in all cases with a number", "nominal 1.5; the same in 195 of 200 cases.",
    )  # fmt: skip
    row = next(row for row in cells(tables(document)["Statistics of the metrics"]) if "propellant" in row[0])
    assert row[2:] == ["1.5", "1.5", "0", "1.5", "1.5", "constant"]
    assert "Cases with the largest propellant" not in tables(document)


@pytest.mark.parametrize(
    ("figure", "sentence"),
    [
        (MapFigure("apogee_km", "ve_pct", "oe_pct", "T"), "T: not drawn; the run has no column apogee_km."),
        (MapFigure("propellant_kg", "ve_pct", "isp_s", "T"), "Not drawn: T (the run does not disperse the isp)."),
        (MapFigure("propellant_kg", "ve_pct", "oe", "T"), "Not drawn: T (the run has no column oe)."),
        (
            MapFigure("propellant_kg", "ve_pct", "pulse_count", "T"),
            "T: not drawn; pulse count is the same in all cases.",
        ),
        (
            MapFigure("settling_time_s", "ve_pct", "oe_pct", "T"),
            "no case has a number for all of settling time, ve, oe.",
        ),
        (
            MapFigure("entry_speed_m_s", "ve_pct", "oe_pct", "T"),
            "% of the variance of entry speed, and no two inputs more",
        ),
        (ScatterFigure("isp_s", "ve_pct", "T"), "T: not drawn; the run does not disperse the isp."),
        (CorridorFigure("ve", "oe_pct", ("propellant_kg",), "T"), "T: not drawn; the run has no column ve."),
        (HistoryFigure(("force_n", "force"), "T"), "Not drawn, the histories have no such output: force."),
        (ProfileFigure("force", "force_n", "T"), "T: not drawn; the histories have no output force."),
    ],
)
def test_a_figure_that_is_not_drawn_says_the_true_reason(figure, sentence):
    run = synthetic_run(n=60, failed=0, figures=[to_record(figure)])
    run.table["settling_time_s"] = np.nan
    run.table["pulse_count"] = 3.0
    run.table["entry_speed_m_s"] = np.random.Generator(np.random.Philox(key=2)).normal(7800.0, 5.0, 60)
    assert sentence in said(build(run, RUN))


def test_a_figure_over_the_columns_of_another_run_is_left_out_without_that_run():
    figures = [
        MapFigure("propellant_kg", "a_km", "oe_pct", "T", upstream=True),
        ScatterFigure("a_km", "b", "T", upstream=True),
    ]
    document = build(synthetic_run(n=60, figures=[to_record(one) for one in figures]), RUN)
    assert "maps" not in {section.anchor for section in document.sections}
    assert next(section for section in document.sections if section.anchor == "scatter").blocks == ()


def test_every_figure_has_an_alternative_text_a_key_and_units_on_its_axes(document):
    for block in blocks_of(document, FigureBlock):
        assert len(block.drawing.alternative) > 40
        assert block.drawing.key
    assert "propellant [kg]" in said(document)


def test_inputs_stand_with_their_distribution_and_source(document):
    row = cells(tables(document)["Dispersed inputs"])[0]
    assert row[0] == "ve_pct [%]"
    assert "normal, 3σ\xa0=\xa020\u202f%" in row
    assert "abstract: 20 % in size" in row


def test_provenance_holds_seed_digests_and_versions(document):
    rows = dict(cells(tables(document)["Provenance of the run"]))
    assert rows["seed"] == "20160421"
    assert rows["campaign digest"] == "3b1f" * 16
    assert rows["packages"] == "numpy 2.3.0, scipy 1.16.0"
    assert "uncommitted" in rows["git"]


def test_a_few_failed_cases_of_very_many_are_not_said_to_be_none():
    table = tables(build(synthetic_run(30_000, failed=1), RUN))["Completion of the cases"]
    fractions = {row[0]: row[2].replace("\u202f", " ") for row in cells(table)}
    assert fractions == {"ok": "99.996 %", "not-finite": "0.01 %", "": "0.01 %", "all": "100 %"}


def test_an_unfinished_run_says_so_and_how_to_finish_it():
    run = synthetic_run(500, failed=0)
    run.wanted = 2000
    warnings = " ".join(build(run, RUN).warnings)
    assert "1\u202f500 of 2\u202f000 cases are missing" in warnings
    assert "“mc-engine resume .”, typed in the run’s folder" in warnings


def test_cases_of_a_grid_are_not_sold_as_probabilities():
    run = synthetic_run(400, failed=0)
    run.manifest["campaign"]["design"] = "grid"
    document = build(run, RUN)
    assert {card.answer for card in document.verdicts} == {"not demonstrable"}
    assert "do not estimate probabilities" in " ".join(document.warnings)
    assert "in the cases flown" in document.costs[0].answer
    assert "median" not in document.costs[0].detail
    matrix = tables(document)["Verification matrix"]
    assert [column.title for column in matrix.columns] == [
        "Requirement", "Limit", "Inside / tried", "Fraction of these cases", "Verdict",
    ]  # fmt: skip
    assert "emonstrated prob" not in matrix.note
    assert {len(row) for row in matrix.rows} == {5}
    for record in [*document.data["requirements"], document.data["joint"]]:
        assert (record.observed_probability, record.demonstrated_probability, record.margin) == (None, None, None)
    assert not {"Percentiles of the metrics", "Statistics of the metrics"} & {*tables(document)}
    keys = [mark.key for block in blocks_of(document, FigureBlock) for mark in block.drawing.key]
    assert [key for key in keys if "percentile" in key or key == "median"] == []
    captions = [block.caption for block in blocks_of(document, FigureBlock)]
    assert [caption for caption in captions if caption.startswith("Distributions")] == []
    (section,) = [section for section in document.sections if section.anchor == "distributions"]
    (sentence,) = section.blocks
    assert "were chosen, not drawn at random, so their metrics have no distribution" in sentence.paragraphs[0]


def test_the_metrics_of_a_grid_have_their_ends_and_the_cases_there():
    run = synthetic_run(400, failed=0)
    run.manifest["campaign"]["design"] = "grid"
    rows = {row[0].small: row for row in tables(build(run, RUN))["Ranges of the metrics"].rows}
    force = run.table["peak_force_n"]
    *_, smallest, largest = next(row for row in rows.values() if row[0].text.startswith("peak force"))
    for cell, case in ((smallest, force.idxmin()), (largest, force.idxmax())):
        assert cell.value == force[case]
        assert cell.small.startswith(f"case {case}: ve ")
    *_, fewest, most = next(row for row in rows.values() if row[0].text.startswith("pulse count"))
    pulses = run.table["pulse_count"]
    for cell, at in ((fewest, pulses == pulses.min()), (most, pulses == pulses.max())):
        assert cell.small.startswith(f"{at.sum()} cases, first case {at.idxmax()}: ve ")


@pytest.mark.parametrize(("n", "told"), [(3, False), (400, False), (900, True)])
def test_a_percentile_that_is_only_the_worst_of_few_cases_is_no_key_result(n, told):
    details = [card.detail for card in build(synthetic_run(n, failed=0), RUN).costs]
    assert any("99.73rd percentile" in detail for detail in details) == told


@pytest.mark.parametrize("n", [0, 1, 2])
def test_hardly_any_cases_make_a_report_that_says_so(n):
    document = build(synthetic_run(n, failed=0), RUN)
    assert {card.answer for card in document.verdicts} == {"not demonstrable"}
    wanted = "too few cases" if n else "not drawn; no case has a number for all of propellant, ve, oe."
    assert any(wanted in text for text in _sentences(document))


def test_all_failed_is_said_first():
    document = build(synthetic_run(40, failed=40), RUN)
    assert document.warnings[0] == "All 40 cases failed: no metric has a number."
    assert all(card.answer == "no number" for card in document.costs)


@pytest.mark.parametrize("design", ["mc", "grid"])
def test_metrics_without_a_number_are_in_the_table_of_all_metrics(design):
    run = synthetic_run(40, failed=40)
    run.manifest["campaign"]["design"] = design
    table = tables(build(run, RUN))["Statistics of the metrics" if design == "mc" else "Ranges of the metrics"]
    assert [row[1].text for row in table.rows] == ["0 / 40"] * 8
    assert {cell.text for row in table.rows for cell in row[3:]} == {"–"}


def test_percentiles_of_completed_cases_are_said_to_be_of_them_alone():
    for failed, said in ((0, False), (3, True)):
        note = tables(build(synthetic_run(400, failed=failed), RUN))["Percentiles of the metrics"].note
        assert note.endswith("they are of the cases with a number alone.") == said


def test_a_campaign_without_requirements_figures_or_dispersions_still_reports():
    run = synthetic_run(50, failed=0, requirements=[], figures=[], inputs=[], published=[], parameters=[], settings=[])
    document = build(run, RUN)
    assert "sets no requirement" in document.subtitle
    # not that all cases are the nominal one: noise made in flight differs
    assert "No input is dispersed: all cases have the nominal inputs." in _sentences(document)
    assert "published" not in [section.anchor for section in document.sections]


def test_failed_cases_are_said_to_count_only_against_requirements_that_there_are():
    """Without one, "they count against every requirement" hid that the statistics are of the other cases alone."""
    for asked, said in (
        ([], "the statistics of the metrics are of the other cases"),
        (None, "they count against every"),
    ):
        run = synthetic_run(50, failed=3, **({} if asked is None else {"requirements": asked}))
        assert f"3 of 50 cases failed; {said}" in build(run, RUN).warnings[0]


def test_constant_and_empty_metrics_are_named_and_not_drawn():
    run = synthetic_run(200, failed=0)
    run.table["pulse_count"] = 3.0
    run.table["entry_speed_m_s"] = float("nan")
    sentences = " ".join(_sentences(build(run, RUN)))
    assert "the same in all cases that have it: pulse count." in sentences
    assert "no case has a number: entry speed." in sentences


def test_a_handful_of_cases_is_shown_case_by_case_and_named_by_what_sets_them_apart():
    run = synthetic_run(4, failed=1)
    run.manifest["columns"].insert(5, {"name": "control", "unit": "", "role": "dispersion", "description": "mode"})
    run.table["ve_pct"], run.table["oe_pct"] = -20.0, 10.0
    run.table["control"] = ["continuous", "clipped", "pulsed", "off"]
    document = build(run, RUN)
    rows = cells(tables(document)["Case by case"])
    assert [row[1] for row in rows] == ["continuous", "clipped", "pulsed", "off"]
    assert [row[-1] for row in rows] == ["ok", "ok", "ok", "not-finite"]
    keys = [mark.key for block in blocks_of(document, FigureBlock) for mark in block.drawing.key]
    assert "case 1: control clipped" in keys


def test_sources_of_requirements_and_notes_of_inputs_are_kept():
    run = synthetic_run(20, failed=0)
    run.manifest["requirements"][0]["source"] = "tank of this study"
    run.manifest["inputs"][0]["note"] = "read as three sigma"
    document = build(run, RUN)
    assert "tank of this study" in said(document)
    assert "read as three sigma" in said(document)


def test_infinite_metrics_are_not_used():
    run = synthetic_run(200, failed=0)
    run.table.loc[7, "propellant_kg"] = float("inf")
    row = cells(tables(build(run, RUN))["Statistics of the metrics"])[1]
    assert row[1] == "199 / 200"


def _sentences(document):
    return [
        sentence
        for section in document.sections
        for block in section.blocks
        for sentence in getattr(block, "paragraphs", ())
    ]
