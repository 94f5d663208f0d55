"""Published values beside ours."""

import pytest
from synthetic_run import synthetic_run

from reports.run.flown import Flown
from reports.sections.published import our_value, published_blocks


@pytest.fixture(scope="module")
def flown():
    run = synthetic_run(100, failed=0)
    run.table.loc[17, ["ve_pct", "oe_pct"]] = -20.0, 10.0
    return Flown(run, "run")


def test_without_a_case_ours_is_the_nominal(flown):
    value, where = our_value(flown, {"column": "settling_time_s"})
    assert (value, where) == (350.0, "nominal case")


def test_the_nominal_case_has_the_inputs_that_all_cases_share(flown):
    record = {"column": "settling_time_s", "at": {"control": "continuous"}}
    assert our_value(flown, record) == (350.0, "nominal case")


def test_a_named_case_is_found_by_its_inputs(flown):
    value, where = our_value(flown, {"column": "propellant_kg", "at": {"ve_pct": -20.0, "oe_pct": 10.0}})
    assert where == "case 17"
    assert value == flown.values("propellant_kg")[17]


def test_inputs_that_all_cases_share_must_agree_too(flown):
    at = {"ve_pct": -20.0, "oe_pct": 10.0, "control": "pulsed"}
    assert our_value(flown, {"column": "propellant_kg", "at": at}) == (None, "not flown in this run")
    assert our_value(flown, {"column": "propellant_kg", "at": {**at, "control": "continuous"}})[1] == "case 17"


def test_only_what_the_run_computes_has_a_row():
    column = {"unit": "s", "column": "settling_time_s"}
    run = synthetic_run(100, failed=0)
    run.manifest["published"] = [
        {"quantity": "not flown", "published": 3.8, "unit": "kg", "column": "propellant_kg", "at": {"ve_pct": 40.0}},
        {"quantity": "of a function", "published": 7.8, "unit": "km/s", "compute": "campaigns.a.published:f"},
        {"quantity": "far", "published": 360.61, "reason": "a cause", "note": "a note", **column},
        {"quantity": "close", "published": 351.61, "status": "restored", "reason": "a cause", **column},
        {"quantity": "near", "published": 350.01, "tolerance": 0.05, "note": "a note", **column},
        {"quantity": "better", "published": 400.0, "better": "less", **column},
        {"quantity": "in words", "published": "about six minutes", "at_most": 360.0, **column},
        {"quantity": "lost", "published": "lost", "status": "lost", **column},
    ]
    table, sentence, command = published_blocks(Flown(run, "run"))
    assert [row[0].text for row in table.rows] == ["far", "close", "near", "better", "in words", "lost"]
    verdicts = ["not reached", "close", "reached", "improved", "reached", "unknown"]
    assert [row[4].text for row in table.rows] == verdicts
    assert [row[4].small for row in table.rows[:3]] == ["a cause", "a cause", "a note"]
    assert table.rows[1][3].text == "−1.61\u202fs"
    assert table.rows[1][1].small == "restored"
    assert sentence.startswith("2 further published values of the model are not computed by the cases of this run")
    assert command.paragraphs == (f"mc-engine published {run.manifest['model']['name']} --compute",)
