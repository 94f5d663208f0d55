"""What the report says of requirements."""

import json

import numpy as np
import pytest
from synthetic_run import synthetic_run

from mc_engine.runner.summary import verdict_line
from mc_engine.statistics.binomial import smallest_sample
from mc_engine.statistics.worst import Limits
from reports.contents import build
from reports.formats.json_data import render_json
from reports.run.flown import Flown
from reports.sections.headline import cost_cards, verdict_cards, warnings
from reports.sections.requirement_tables import margin_block, requirement_table, risk_table
from reports.sections.tables import quantile_table
from reports.text.numbers import count

FUEL = {"name": "fuel", "metric": "propellant_kg", "at_most": 2.5, "at_least": None, "share": 0.9973, "confidence": 0.9}
FORCE = {**FUEL, "name": "force", "metric": "peak_force_n", "at_most": 1000.0}


def flown(n=1000, failed=0, **changes):
    changes.setdefault("requirements", [FUEL, FORCE])
    return Flown(synthetic_run(n, failed, **changes), "run")


def texts(table):
    return [[" ".join(filter(None, (cell.text, cell.small))).replace("\u202f", " ") for cell in row]
            for row in table.rows]  # fmt: skip


def mc(cases=1000):
    return {"name": "deorbit", "design": "mc", "seed": 1, "cases": cases}


def test_the_last_row_is_all_at_once_with_the_joint_share_asked_for():
    row = texts(requirement_table(flown(campaign=mc())))[-1]
    assert row[:2] == ["all at once", "all limits for 99.46 % with 90 % confidence"]
    assert row[4] == "1 000 / 1 000"
    assert row[-1] == "pass"


def test_a_single_requirement_has_neither_a_joint_row_nor_a_shared_confidence():
    one = flown(campaign=mc(), requirements=[FUEL])
    assert len(requirement_table(one).rows) == 1
    assert [column.title for column in risk_table(one).columns][-1] == "Producer’s risk"
    assert all(len(row) == len(risk_table(one).columns) for row in risk_table(one).rows)
    assert "Bonferroni" not in risk_table(one).note


def test_requirements_that_may_all_be_missed_at_once_have_no_joint_row_and_the_note_says_why():
    halves = [{**FUEL, "share": 0.5}, {**FORCE, "share": 0.5}]
    table = requirement_table(flown(campaign=mc(), requirements=halves))
    assert len(table.rows) == 2
    assert "what the requirements may miss adds up to 100 % or more" in table.note
    assert "adds up" not in requirement_table(flown(campaign=mc(), requirements=[FUEL])).note
    assert "adds up" not in requirement_table(flown(campaign=mc())).note


def test_risks_stand_beside_the_failures_seen_and_allowed():
    fuel, _, joint = texts(risk_table(flown(campaign=mc())))
    # 1000 cases, no failure allowed: 0.9973^1000 = 6.696 %, and 1 - 0.99865^1000 = 74.098 %, rounded up
    assert fuel == ["fuel propellant_kg", "0", "0", "6.7 %", "74.1 %", "not demonstrable with 96.66 % each"]
    assert joint[-1] == "not demonstrable with 96.66 % each"  # its own fraction is demonstrated, that of fuel is not


def test_a_run_by_looks_says_its_schedule_and_which_bounds_these_are():
    looked = flown(campaign=mc(100), looks=[100, 500, 1000, 2000])
    assert "Robbins" in requirement_table(looked).note
    assert "Clopper" not in requirement_table(looked).note
    assert "fixed in advance" in quantile_table(looked).note
    assert "fixed in advance" not in quantile_table(flown(campaign=mc())).note
    warned = " ".join(warnings(looked)).replace("\u202f", " ")
    assert "with interim analyses after 100, 500, 1 000, 2 000 cases; it ended after 1 000" in warned
    fuel = texts(risk_table(looked))[0]
    assert fuel[3:5] == ["below 10 %", "–"]
    assert texts(requirement_table(looked))[0][-1] == "not demonstrable needs 1 104 cases"


def test_a_run_extended_by_hand_says_so():
    warned = " ".join(warnings(flown(campaign=mc(500)))).replace("\u202f", " ")
    assert "began with 500 cases and was extended to 1 000" in warned
    assert "extended" not in " ".join(warnings(flown(campaign=mc())))
    beyond = " ".join(warnings(flown(campaign=mc(100), looks=[100, 500, 800]))).replace("\u202f", " ")
    assert "with interim analyses after 100, 500, 800 cases; it was then extended to 1 000." in beyond


def test_a_run_that_is_not_complete_has_the_bounds_that_hold_at_every_number_of_cases():
    run = synthetic_run(1000, 0, requirements=[FUEL], campaign=mc(2000))
    run.wanted = 2000
    cut = Flown(run, "run")
    assert cut.verdicts[0].looked
    assert "Robbins" in requirement_table(cut).note
    warned = " ".join(warnings(cut)).replace("\u202f", " ")
    assert "The run has 1 000 of 2 000 cases so far. The bounds on probabilities hold at every number" in warned


@pytest.mark.parametrize("flown_cases", [1000, 400])
def test_a_shard_asks_for_its_own_missing_cases_only_and_for_a_merge(flown_cases):
    """A complete shard was told to `resume`, which flies nothing; a cut one had the bounds of a fixed number."""
    shard = {"number": 1, "of": 3, "first": 0, "stop": 1000}
    run = synthetic_run(flown_cases, 0, requirements=[FUEL], campaign=mc(3000), shard=shard)
    run.wanted = 3000
    part, missing = Flown(run, "run"), flown_cases < 1000
    warned = " ".join(warnings(part)).replace("\u202f", " ")
    assert "This is shard 1 of 3, with 1 000 of 3 000 cases; “mc-engine merge RUN SHARD...”" in warned
    assert ("The shard is not complete: 600 of 1 000 cases are missing; “mc-engine resume .”" in warned) == missing
    assert ("not complete" in warned) == missing == part.verdicts[0].looked


def test_a_nominal_case_that_failed_is_told():
    run = synthetic_run(500, failed=0)
    assert "nominal case failed" not in " ".join(warnings(Flown(run, "run")))
    run.nominal_row |= {"status": "step-limit", "reason": 'in the phase "hover"'}
    sentence = 'The nominal case failed with the status step-limit, in the phase "hover": it has no metrics.'
    assert sentence in warnings(Flown(run, "run"))


def test_two_limits_show_the_interval_and_its_margin():
    band = {**FUEL, "at_least": -1.0}
    row = texts(requirement_table(flown(2000, campaign=mc(2000), requirements=[band])))[0]
    low, high = (float(word.replace("−", "-")) for word in row[2].split(" kg")[0].split(" to "))
    assert -1.0 <= low < high <= 2.5
    assert low + 1.0 == pytest.approx(2.5 - high, abs=1e-3)
    margin, share = (float(word) for word in row[3].replace(" %)", "").split(" kg ("))
    assert margin == pytest.approx(min(2.5 - high, low + 1.0), abs=1e-3)
    assert share == pytest.approx(100.0 * margin / 1.75, abs=0.1)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("limits", [{}, {"at_most": None, "at_least": 0.01}, {"at_least": -1.0}])
def test_printed_bounds_and_margins_claim_no_more_than_the_cases_show(seed, limits):
    """With limits to either side, bounds of six samples each: to nearest, half of them would be on the wrong side."""
    run = synthetic_run(2000, 0, seed, campaign=mc(2000), requirements=[{**FUEL, **limits}])
    built = Flown(run, "run")
    (verdict,) = built.verdicts
    row = texts(requirement_table(built))[0]
    low, high = verdict.enclosed or 2 * (verdict.demonstrated,)
    *lower, upper = (float(word.replace("−", "-")) for word in row[2].removesuffix(" kg").split(" to "))
    assert all(end <= low for end in lower)
    assert upper <= low if verdict.at_most is None else upper >= high
    margin, share = (float(word) for word in row[3].replace(" %)", "").split(" kg ("))
    assert margin <= verdict.margin
    assert share <= 100.0 * verdict.margin / Limits(verdict.at_most, verdict.at_least).reach
    (words,) = [told for _, told in margin_block(built).drawing.plots[0].y.ticks]
    assert words.replace("\u202f", " ") == f"fuel, {share:g} %"


@pytest.mark.parametrize("failed", [0, 100])
def test_a_figure_of_margins_says_that_cases_without_a_number_are_outside_and_not_drawn(failed):
    """A worst case far inside its limit was drawn for a requirement that a tenth of the cases missed by failing."""
    built = flown(1000, failed, campaign=mc())
    assert (built.verdicts[0].no_number > 0) == (failed > 0)
    assert ("cases without one are outside, and not drawn" in margin_block(built).caption) == (failed > 0)


@pytest.mark.parametrize("lowest", [None, -1.0])
def test_a_key_result_is_what_the_matrix_says_is_demonstrated(lowest):
    band = flown(2000, campaign=mc(2000), requirements=[{**FUEL, "at_least": lowest}])
    demonstrated = requirement_table(band).rows[0][2].text
    card = next(card for card in cost_cards(band) if card.label == "propellant")
    told = card.answer if lowest is None else card.detail
    assert f"{demonstrated} in 99.73\u202f% of cases, 90\u202f% confidence" in told


def test_a_key_result_is_of_the_requirement_whose_limit_it_shows():
    loose = {**FUEL, "name": "loose", "at_most": 4.0, "share": 0.5}
    flight = flown(2000, campaign=mc(2000), requirements=[loose, FUEL])
    card = next(card for card in cost_cards(flight) if card.label == "propellant")
    assert f"{requirement_table(flight).rows[1][2].text} in 99.73\u202f% of cases" in card.answer
    assert card.answer.endswith("limit 2.5\u202fkg")


def test_a_required_share_is_printed_with_the_digits_that_it_was_given():
    flight = flown(requirements=[{**FUEL, "share": 0.99996833}])
    assert "for 99.996833 % with 90 % confidence" in texts(requirement_table(flight))[0][1]
    assert "99.996833\u202f% of cases" in verdict_cards(flight)[0].detail


@pytest.mark.parametrize("n", [0, 1, 2, 40])
@pytest.mark.parametrize("kind", ["good", "all failed", "constant", "not a number"])
@pytest.mark.parametrize("looks", [[], [1, 2, 40, 100]])
def test_hardly_any_cases_are_reported_without_a_warning(n, kind, looks):
    run = synthetic_run(n, n if kind == "all failed" else 0, requirements=[FUEL, FORCE], campaign=mc(n), looks=looks)
    if kind in ("constant", "not a number"):
        run.table["propellant_kg"] = 1.0 if kind == "constant" else np.nan
    built = Flown(run, "run")
    rows = texts(requirement_table(built))
    assert len(rows) == 3
    bad = kind in ("all failed", "not a number") and n > 0
    assert rows[0][-1].startswith("fail" if bad else "not demonstrable")
    assert rows[2][-1].startswith("fail" if bad else "not demonstrable")
    assert (risk_table(built) is None) == (n == 0)
    assert verdict_cards(built)[-1].label == "all at once"


def test_a_grid_has_no_risks():
    assert risk_table(flown(campaign={**mc(), "design": "grid"})) is None


def test_both_tables_stand_in_the_section_of_requirements():
    document = build(synthetic_run(300, 0, campaign=mc(300)), "run")
    section = next(section for section in document.sections if section.anchor == "requirements")
    captions = [getattr(block, "caption", "").split(",")[0] for block in section.blocks]
    assert captions == ["Verification matrix", "Margins of the requirements", "Risks of the verdicts"]


def test_a_joint_verdict_that_waits_for_a_requirement_alone_says_so():
    strict, loose = ({**FUEL, "name": str(share), "at_most": 1e3, "share": share} for share in (0.9973, 0.9))
    built = flown(400, campaign=mc(400), requirements=[strict, loose])
    *_, joint = verdict_cards(built)
    assert built.joint.lower > built.joint.share
    assert joint.answer == "not demonstrable"
    assert (
        "but not every requirement is demonstrated by itself; 1\u202f104 cases without a further failure"
        in joint.detail
    )
    assert verdict_line(built.joint, {}).endswith("confidence); not every requirement is demonstrated by itself")
    assert risk_table(built).rows[0][2].text == "too few cases"


@pytest.mark.parametrize("changes", [{"campaign": {**mc(400), "design": "lhs"}}, {"upstream": {"name": "deorbit"}}])
def test_a_run_that_cannot_be_extended_needs_a_new_one_with_the_cases_of_the_plan(changes):
    built = flown(400, requirements=[FUEL], **{"campaign": mc(400), **changes})
    (verdict,) = built.verdicts
    cases = count(smallest_sample(FUEL["share"], FUEL["confidence"], verdict.tried - verdict.passed))
    (card,) = verdict_cards(built)
    assert card.detail.endswith(f"; a new run of {cases} cases with no more failures would demonstrate it.")


def test_a_key_result_stands_beside_its_limit():
    for limit, words in (({}, ", limit 2.5"), ({"at_least": -1.0}, ", limits −1 to 2.5")):
        built = flown(2000, campaign=mc(2000), requirements=[{**FUEL, **limit}])
        card = next(card for card in cost_cards(built) if card.label == "propellant")
        assert card.answer.endswith(f"{words}\u202fkg")


def test_the_joint_card_names_the_requirement_that_fails_it():
    draw = Flown(synthetic_run(3000, 0, campaign=mc(3000)), "run")
    at_most = float(np.sort(draw.values("propellant_kg"))[-27])  # 26 of 3000 are outside
    found = flown(
        3000, campaign=mc(3000), requirements=[{**FUEL, "at_most": at_most}, FORCE, {**FORCE, "name": "more"}]
    )
    card = verdict_cards(found)[-1]
    assert (card.label, card.answer) == ("all at once", "fail")
    assert card.detail.endswith("inside; fuel fails with confidence shared.")
    assert verdict_line(found.joint, {}).endswith("confidence); fuel fails with confidence shared")


@pytest.mark.parametrize(
    ("design", "looks", "bounds"),
    [("mc", [], "fixed number of cases"), ("mc", [100, 1000], "every number of cases"), ("grid", [], None)],
)
def test_the_data_have_the_joint_verdict_and_the_kind_of_bounds(design, looks, bounds):
    run = synthetic_run(1000, 0, campaign={**mc(1000), "design": design}, looks=looks)
    built = Flown(run, "run")
    record = json.loads(render_json(build(run, "run")))
    assert [one["bounds"] for one in (*record["requirements"], record["joint"])] == 4 * [bounds]
    joint, told = built.joint, record["joint"]
    assert (told["name"], told["metric"], told["verdict"]) == ("all at once", "", joint.outcome)
    assert (told["passed"], told["tried"], told["required_probability"]) == (joint.passed, 1000, joint.share)
    assert (told["demonstrated_probability"], told["failing"]) == (joint.lower, list(joint.failing))


def test_the_data_of_a_single_requirement_have_no_joint_verdict():
    alone = build(synthetic_run(100, 0, campaign=mc(100), requirements=[FUEL]), "run")
    assert json.loads(render_json(alone))["joint"] is None


def test_margins_of_a_limit_of_zero_have_no_width():
    spare = {**FUEL, "name": "spare", "metric": "propellant_kg", "at_most": None, "at_least": 0.0}
    one = flown(campaign=mc(), requirements=[spare, FORCE])
    cells = [row[3].small for row in requirement_table(one).rows]
    assert cells[0] == ""
    assert cells[1].endswith("\u202f%)")
    figure = margin_block(one)
    assert [text.split(",")[0] for _, text in figure.drawing.plots[0].y.ticks] == ["force"]
    assert figure.caption.endswith("Not drawn, the limit is 0: spare.")
