"""Published values beside ours."""

import pytest
from synthetic_run import synthetic_run

from reports.flown import Flown
from reports.published import our_value, published_table


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


def test_a_fixed_number_stands_in_for_a_case_that_was_not_flown(flown):
    record = {"column": "propellant_kg", "at": {"ve_pct": 40.0}, "ours": 3.759}
    assert our_value(flown, record) == (3.759, "fixed")


def test_a_gap_is_inside_or_outside_the_printed_digits(flown):
    rows = published_table(flown).rows
    assert [row[3].small for row in rows] == ["outside", "inside", ""]
    assert rows[0][3].text == "−1.61\u202fkg"
    assert rows[2][1].text == "zero"
