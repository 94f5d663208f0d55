"""Dates of settings: text in campaign files and case tables, modified Julian dates inside."""

import erfa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mc_engine.campaign.inputs import check_value
from mc_engine.campaign.reading import Findings
from mc_engine.dates import date_text, modified_julian_date
from mc_engine.model import Setting

EPOCH = Setting("2019-01-01T12:00:00", "start", low=33282.0, high=88068.0, date=True, name="epoch_utc", unit="")


def test_a_date_is_the_modified_julian_date_of_the_standard_library_of_astronomy():
    day, hours = erfa.dtf2d("UTC", 2019, 12, 11, 6, 30, 15.25)
    assert modified_julian_date("2019-12-11T06:30:15.25") == pytest.approx(day - 2_400_000.5 + hours, abs=1e-10)
    assert modified_julian_date("2019-01-01T12:00:00") == 58484.5


@given(st.floats(33282.0, 88068.0))
def test_text_and_number_are_the_same_to_a_microsecond(mjd):
    assert modified_julian_date(date_text(mjd)) == pytest.approx(mjd, abs=1e-6 / 86_400.0)


@pytest.mark.parametrize("value", ["2019-01-01T12:00:00", "2019-01-01T12:00Z", 58484.5])
def test_a_setting_takes_a_date_as_text_or_as_a_modified_julian_date(value):
    found = Findings()
    assert check_value(value, EPOCH, found, "") == "2019-01-01T12:00:00"
    assert found.problems == []
    assert EPOCH.code(value) == 58484.5


NO_DATE = 'is not a date; write it in UTC as "2019-01-01T12:00:00"'
OUTSIDE = "is not allowed; the model accepts 1950-01-01T00:00:00 to 2099-12-31T00:00:00"


@pytest.mark.parametrize(
    ("value", "words"),
    [*((value, NO_DATE) for value in ("1 January", "2019-13-01", True, "0001-01-01T00:00:00+05:00", "")),
     *((value, OUTSIDE) for value in ("1899-12-31T00:00:00", 99999))],
)  # fmt: skip
def test_what_is_no_date_or_outside_the_range_of_the_model_is_refused(value, words):
    found = Findings()
    assert check_value(value, EPOCH, found, "here") is None
    assert words in found.problems[0].message
