import pytest
from toy import MODEL

from mc_engine.campaign.inputs import accepted_range, check_value, inputs_of, number
from mc_engine.campaign.reading import Findings
from mc_engine.model import Setting


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("mass_kg", 3.0, 3.0),
        ("mass_kg", 0.0, 0.0),
        ("angle_deg", 90.0, 90.0),
        ("control", "off", "off"),
        ("drag", False, False),
        ("step_s", 0.1, 0.1),
    ],
)
def test_a_fitting_value_is_returned(name, value, expected):
    found = Findings()
    assert check_value(value, MODEL.input(name), found, "") == expected
    assert found.problems == []


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("mass_kg", -0.001),
        ("angle_deg", 90.001),
        ("mass_kg", True),
        ("mass_kg", "3"),
        ("control", "Off"),
        ("control", 1.0),
        ("drag", 1.0),
        ("drag", "true"),
        ("step_s", False),
        ("mass_kg", float("nan")),
    ],
)
def test_a_value_of_the_wrong_kind_or_size_is_noted(name, value):
    found = Findings()
    assert check_value(value, MODEL.input(name), found, "here") is None
    assert [problem.place for problem in found.problems] == ["here"]


def test_a_count_is_a_whole_number():
    count = Setting("steps_per_fix", "", "steps from fix to fix", 1.0, low=1.0, whole=True)
    found = Findings()
    assert check_value(2.0, count, found, "") == 2.0
    assert check_value(1.5, count, found, "here") is None
    assert found.problems[0].message == "1.5 is not a whole number; steps_per_fix is steps from fix to fix"


def test_ranges_are_said_with_their_unit():
    words = {name: accepted_range(item) for name, item in inputs_of(MODEL).items() if name != "control"}
    assert words["mass_kg"] == "0 kg and above"
    assert words["angle_deg"] == "0 to 90 deg"
    assert words["height_km"] == "any finite number"


def test_numbers_are_written_without_needless_digits():
    assert [number(value) for value in (20.0, 0.1 + 0.2, 1e-7, 123456789.0)] == ["20", "0.3", "1e-07", "123456789"]
