import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mc_engine.units import UNITS, compatible, convert


@pytest.mark.parametrize(
    ("value", "unit", "to", "expected"),
    [
        (250.0, "m", "km", 0.25),
        (1.0, "km/s", "m/s", 1000.0),
        (180.0, "deg", "rad", np.pi),
        (2.0, "h", "min", 120.0),
        (1.0, "g", "m/s^2", 9.80665),
        (20.0, "%", "", 0.2),
    ],
)
def test_a_number_in_one_unit_becomes_the_number_in_another(value, unit, to, expected):
    assert convert(value, unit, to) == expected


@given(value=st.floats(-1e9, 1e9), unit=st.sampled_from(sorted(UNITS)), data=st.data())
def test_there_and_back_is_the_same_number(value, unit, data):
    to = data.draw(st.sampled_from(compatible(unit)))
    assert convert(convert(value, unit, to), to, unit) == pytest.approx(value, rel=1e-15)


def test_only_units_of_the_same_quantity_are_compatible():
    assert compatible("km/s") == ["m/s", "km/s"]
    assert set(compatible("deg")) == {"rad", "deg"}


def test_a_whole_column_is_converted():
    assert convert(np.array([1.0, 2.0]), "km", "m").tolist() == [1000.0, 2000.0]
