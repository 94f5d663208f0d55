"""What drives it: a section for random designs, with sentences where there is nothing to show."""

import json

import numpy as np
import pytest
from synthetic_run import synthetic_run

from reports.contents import build
from reports.contributors.sensitivity import sensitivity_blocks
from reports.document.blocks import FigureBlock, Table, Text, blocks_of
from reports.drawing import paper, screen
from reports.formats.json_data import render_json
from reports.run.flown import Flown


def section(run):
    return next((one for one in build(run, "run").sections if one.anchor == "drivers"), None)


def said(found):
    return " ".join(text for block in found.blocks if isinstance(block, Text) for text in block.paragraphs)


def block(found, kind, caption=""):
    return next(one for one in found.blocks if isinstance(one, kind) and one.caption.startswith(caption))


@pytest.fixture(scope="module")
def drawn():
    return section(synthetic_run(4000, failed=12))


def test_the_settling_time_is_shared_as_its_closed_form_says(drawn):
    # settling = 350 + 0.4 VE + 0.2 OE, VE of 20/3 % and OE of 5 %: variances 7.111 and 1
    panel = next(one for one in block(drawn, FigureBlock).drawing.plots if one.title == "settling time")
    first = next(mark for mark in panel.marks if getattr(mark, "key", "") == "first-order effect")
    shares = dict(zip((text for _, text in panel.y.ticks), first.right, strict=True))
    assert shares["ve"] == pytest.approx(7.111 / 8.111, abs=0.02)
    assert shares["oe"] == pytest.approx(1.0 / 8.111, abs=0.02)


def test_what_no_input_explains_is_a_row_of_its_own():
    """Half of the variance of the settling time is noise that no input has."""
    run = synthetic_run(2000, failed=0)
    noise = np.random.Generator(np.random.Philox(key=7)).normal(0.0, np.sqrt(8.111), 2000)
    run.table["settling_time_s"] += noise
    document = build(run, "run")
    records = json.loads(render_json(document))["contributors"]
    (left,) = [one for one in records if one["metric"] == "settling_time_s" and one["input"] == "unexplained"]
    assert left["total"] == pytest.approx(0.5, abs=0.05)
    found = next(one for one in document.sections if one.anchor == "drivers")
    rows = block(found, Table, "Contributors to each metric").rows
    (row,) = [one for one in rows if one[0].text == "settling time" and one[1].text == "unexplained by the inputs"]
    assert row[3].value == left["total"]
    panel = next(one for one in block(found, FigureBlock).drawing.plots if one.title == "settling time")
    assert "unexplained by the inputs" in [text for _, text in panel.y.ticks]


def test_an_input_that_only_names_a_draw_has_no_effect_of_its_own_in_page_and_data():
    """The settling time is noise by half, which the draw names: nothing in the order of its values tells so."""
    run = synthetic_run(2000, failed=0)
    rng = np.random.Generator(np.random.Philox(key=8))
    run.table["day"] = rng.uniform(size=2000)
    run.table["settling_time_s"] += rng.normal(0.0, np.sqrt(8.111), 2000)
    run.manifest["columns"].append({"name": "day", "unit": "", "role": "dispersion", "description": "weather"})
    run.manifest["inputs"].append({"name": "day", "unit": "", "description": "weather", "random_draw": True})
    document = build(run, "run")
    records = [one for one in json.loads(render_json(document))["contributors"] if one["metric"] == "settling_time_s"]
    shares = {one["input"]: one["total"] for one in records}
    assert shares.keys() == {"ve_pct", "oe_pct", "unexplained"}
    assert shares["unexplained"] == pytest.approx(0.5, abs=0.05)
    found = next(one for one in document.sections if one.anchor == "drivers")
    table = block(found, Table, "Contributors to each metric")
    assert "day" not in {row[1].text for row in table.rows}
    assert "[sensitivity]" in table.note


def test_a_note_says_that_first_order_effects_of_jumps_are_found_too_small():
    """The settling time is one where the burn is among the largest twentieth: this input explains all of it."""
    run = synthetic_run(1000, failed=0)
    ve = run.table["ve_pct"]
    run.table["settling_time_s"] = np.where(ve > np.quantile(ve, 0.95), 1.0, 0.0)
    document = build(run, "run")
    records = json.loads(render_json(document))["contributors"]
    (jump,) = [one for one in records if one["metric"] == "settling_time_s" and one["input"] == "ve_pct"]
    assert jump["first_interval"][1] < 1.0
    assert jump["total_interval"][1] == 1.0
    found = next(one for one in document.sections if one.anchor == "drivers")
    assert "too small, beyond its interval" in block(found, Table, "Contributors to each metric").note
    assert "intervals of means and of the effects of inputs are approximate" in str(document)


def test_without_a_dispersed_input_a_sentence_says_why_there_are_no_contributors():
    for inputs in ([], [{"name": "ve_pct", "random_draw": True}, {"name": "oe_pct", "random_draw": True}]):
        run = synthetic_run(200, failed=0)
        run.manifest["inputs"] = inputs
        for column in run.manifest["columns"]:
            column["role"] = "case" if column["role"] == "dispersion" and not inputs else column["role"]
        sentence, *others = sensitivity_blocks(Flown(run, "run"))
        assert "Contributors to each metric" not in str(others)
        assert "random draws alone" in sentence
        assert "[sensitivity]" in sentence
        metrics = [column["name"] for column in run.manifest["columns"] if column["role"] == "metric"]
        run.table = run.table.assign(**dict.fromkeys(metrics, 1.0))
        assert sentence not in sensitivity_blocks(Flown(run, "run"))


def test_the_table_says_how_many_cases_each_index_rests_on(drawn):
    rows = block(drawn, Table, "Contributors to each metric").rows
    by_metric = {row[0].text: row[0].small for row in rows}
    assert by_metric["propellant"].startswith("3\u202f988 / 4\u202f000 cases; R² 0.0")
    assert by_metric["settling time"].startswith("3\u202f988 / 4\u202f000 cases; R² 1.00; σ ")


def test_the_driver_of_the_force_is_the_burns_size_at_both_ends(drawn):
    rows = block(drawn, Table, "What separates failed").rows
    force = next(row for row in rows if row[0].text == "force")
    assert [cell.text for cell in force[1:3]] == ["ve", "at both ends"]
    assert force[3].value > 0.7
    assert force[4].value < 1e-6
    panel = block(drawn, FigureBlock, "Success probability").drawing.plots[0]
    assert panel.title == "force"
    *_, overall, bins = panel.marks
    tried = [int(text.split(" of ")[1].split(" cases")[0].replace("\u202f", "")) for text in bins.texts]
    assert sum(tried) == 4000
    assert bins.y[0] < overall.at < bins.y[5]


def test_chosen_cases_have_a_sentence_and_no_index():
    run = synthetic_run(400, failed=0)
    run.manifest["campaign"]["design"] = "grid"
    found = section(run)
    assert len(found.blocks) == 1
    assert "were chosen, not drawn" in said(found)


def test_words_and_switches_have_names_in_the_figures():
    run = synthetic_run(2000, failed=0)
    run.table["mode"] = np.array(["aim", "coast", "burn"], dtype=object)[np.arange(2000) % 3]
    run.table["backup"] = np.arange(2000) % 2 == 0
    luck = np.random.Generator(np.random.Philox(key=3)).random(2000)
    run.table["peak_force_n"] = np.where((run.table["mode"] == "coast") & (luck < 0.3), 200.0, 50.0 + luck)
    for name in ("mode", "backup"):
        run.manifest["columns"].append({"name": name, "unit": "", "role": "dispersion", "description": f"the {name}"})
    found = section(run)
    row = block(found, Table, "What separates failed").rows[0]
    assert [cell.text for cell in row[:3]] == ["force", "mode", "coast"]
    panel = block(found, FigureBlock, "Success probability").drawing.plots[0]
    assert [text for _, text in panel.x.ticks] == ["aim", "burn", "coast"]
    drawable(found)


def drawable(found):
    for one in found.blocks:
        if isinstance(one, FigureBlock):
            assert one.drawing.key
            assert len(one.drawing.alternative) > 40
            json.dumps(screen.specifications(one.drawing), allow_nan=False)
            assert "<svg" in paper.svg(one.drawing)


def test_both_drawings_hold_what_the_table_says(drawn):
    drawable(drawn)
    words = block(drawn, FigureBlock, "Success probability").drawing.alternative
    assert words.startswith("Success probability in bins of single inputs. force: ")


@pytest.mark.parametrize("cases", [0, 1, pytest.param(2, marks=pytest.mark.slow), 60])
def test_few_failed_and_equal_cases_are_drawn_or_said(cases):
    lost = {"status": "not-finite", **{name: np.nan for name in ("propellant_kg", "peak_force_n", "settling_time_s")}}
    for change in ({}, lost, {"ve_pct": 0.0, "oe_pct": 0.0}, {"propellant_kg": np.nan}, {"propellant_kg": 2.0}):
        run = synthetic_run(60, failed=0)
        run.table = run.table.assign(**change).head(cases)
        found = section(run)
        if cases == 0:
            assert found.blocks == ()  # its part with the maps says why there are none
            continue
        assert found.blocks
        drawable(found)
        if change == lost or cases < 20:
            assert "No contributors for propellant" in said(found)
            assert "Not tested for contributors to failures" in said(found)


def test_a_single_test_for_contributors_to_failures_is_one_test():
    run = synthetic_run(500, failed=0)
    run.manifest["requirements"] = [
        {"name": "force", "metric": "peak_force_n", "at_most": 60.0, "share": 0.9, "confidence": 0.9}
    ]
    run.table["oe_pct"] = 0.0
    note = block(section(run), Table, "What separates failed").note
    assert note.startswith("1 test of single inputs and 0 of pairs;")


def test_without_a_driver_the_report_says_how_many_tests_found_none():
    run = synthetic_run(1000, failed=0)
    luck = np.random.Generator(np.random.Philox(key=4)).random(1000)
    run.table = run.table.assign(
        propellant_kg=1.0 + 2.0 * (luck < 0.02), peak_force_n=50.0 + luck, settling_time_s=300.0
    )
    assert "No input, and no pair of inputs, separates failed from passed cases beyond chance (2 tests" in said(
        section(run)
    )


def test_names_with_markup_stay_text():
    run = synthetic_run(500, failed=0)
    for column in run.manifest["columns"]:
        if column["name"] == "ve_pct":
            column["description"] = "<b>$x$</b>"
    panel = screen.specifications(block(section(run), FigureBlock, "Success probability").drawing)[0]
    assert "<b>" not in json.dumps(panel)


def test_1_sigma_contributions_of_correlated_inputs_are_not_added_up():
    run = synthetic_run(2000, failed=0)
    run.table["oe_pct"] = run.table["ve_pct"] + run.table["oe_pct"] / 2.0
    run.table["settling_time_s"] = run.table["ve_pct"] + run.table["oe_pct"]
    table = block(section(run), Table, "Contributors to each metric")
    assert not any("root sum square" in row[0].small for row in table.rows)
    assert any("σ" in row[0].small for row in table.rows)
    assert "do not add up to σ" in table.note


def test_a_scatter_plot_names_a_strongest_contributor_only_where_an_input_surely_contributes():
    run = synthetic_run(300, failed=0)
    run.manifest["figures"] = []
    run.table["settling_time_s"] = np.random.Generator(np.random.Philox(key=7)).standard_cauchy(300)
    captions = {one.caption for one in blocks_of(build(run, "run"), FigureBlock)}
    assert "Propellant over its strongest contributor, ve." in captions
    assert captions & {"Settling time over ve.", "Settling time over oe."}


def test_of_sobol_points_no_pair_is_tested_for_failures_and_the_page_says_so():
    run = synthetic_run(4000, failed=30)
    assert "Pairs of inputs are not tested" not in said(section(run))
    run.manifest["campaign"]["design"] = "sobol"
    found = said(section(run))
    assert "Pairs of inputs are not tested for contributors to failures: Sobol’ points are not independent" in found
    assert "no pair of inputs" not in found


def test_the_figure_and_the_table_say_that_contributors_come_from_a_selection_of_the_cases(monkeypatch, drawn):
    monkeypatch.setattr("reports.run.contributions.MOST_ROWS", 1000)
    found = section(synthetic_run(4000, failed=12))
    selected = "1\u202f000 cases, selected evenly from the 4\u202f000"
    assert selected in block(found, FigureBlock).caption
    assert "selected evenly" in block(found, Table, "Contributors to each metric").note
    assert "selected evenly" not in block(drawn, FigureBlock).caption
