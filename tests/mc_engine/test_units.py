import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from mc_engine.command_line.commands import app
from mc_engine.errors import ModelError
from mc_engine.units import UNITS, compatible, convert, nearest_unit, unit_hint, unit_of


@pytest.mark.parametrize(
    ("value", "unit", "to", "expected"),
    [
        (250.0, "m", "km", 0.25),
        (1.0, "km/s", "m/s", 1000.0),
        (180.0, "deg", "rad", np.pi),
        (2.0, "h", "min", 120.0),
        (1.0, "g", "m/s^2", 9.80665),
        (20.0, "%", "", 0.2),
        (3600.0, "arcsec", "deg", 1.0),
        (2.5, "mg/s", "kg/s", 2.5e-6),
        (1.0, "keV", "J", 1.602176634e-16),
        (60.0, "mN/kW", "N/W", 6e-5),
        (60.0, "rpm", "rad/s", 2.0 * np.pi),
        (1.0, "W h", "kJ", 3.6),
        (1.0, "deg/h", "arcsec/s", 1.0),
        (1.0, "deg/sqrt(h)", "deg/sqrt(s)", 1.0 / 60.0),
        (398600.4418, "km^3/s^2", "m^3/s^2", 3.986004418e14),
    ],
)
def test_a_number_in_one_unit_becomes_the_number_in_another(value, unit, to, expected):
    assert convert(value, unit, to) == pytest.approx(expected, rel=1e-15)


@given(value=st.floats(-1e9, 1e9), unit=st.sampled_from(sorted(UNITS)), data=st.data())
def test_there_and_back_is_the_same_number(value, unit, data):
    to = data.draw(st.sampled_from(compatible(unit)))
    assert convert(convert(value, unit, to), to, unit) == pytest.approx(value, rel=1e-15)


def test_only_units_of_the_same_quantity_are_compatible():
    assert compatible("kN") == ["N", "uN", "mN", "kN"]
    assert set(compatible("deg")) == {"rad", "urad", "mrad", "deg", "arcmin", "arcsec", "rev"}


@pytest.mark.parametrize(
    ("written", "meant"),
    [("Nm", "N m"), ("m/s²", "m/s^2"), ("m/s2", "m/s^2"), ("µrad", "urad"), ("Tesla", "T"), ("volts", "V"),
     ("arcseconds", "arcsec"), ("w/m2", "W/m^2"), ("kilometres", "km"), ("furlong", None)],
)  # fmt: skip
def test_the_unit_that_was_meant_is_found(written, meant):
    assert nearest_unit(written, UNITS) == meant


@pytest.mark.parametrize(
    ("name", "meant"),
    [("h_mtr", "h_m"), ("h_mtrs", "h_m"), ("h_kmm", "h_km"), ("t_secs", "t_s"), ("t_msec", "t_ms"), ("t_hrs", "t_h"),
     ("t_minutes", "t_min"), ("p_kpas", "p_kpa"), ("n_rpms", "n_rpm"), ("angle_dge", "angle_deg"),
     ("angle_arcsc", "angle_arcsec"), ("k_w_m2k", "k_w_m2_k")],
)  # fmt: skip
def test_a_misspelt_ending_is_answered_with_the_unit_that_was_meant(name, meant):
    with pytest.raises(ModelError, match=f'did you mean "{meant}"'):
        unit_of(name)


@pytest.mark.parametrize("ending", ["kmh", "kph", "kts", "mach", "gm", "mbar", "m3s", "mm2", "dgr", "lbs", "psi"])
def test_the_unit_of_another_quantity_is_no_answer_to_an_ending_like_it(ending):
    with pytest.raises(ModelError) as caught:
        unit_of(f"x_{ending}")
    assert "did you mean" not in str(caught.value)


def test_an_unknown_unit_is_answered_with_the_command_that_lists_them():
    assert unit_hint("furlong") == f"; `mc-engine units` lists all {len(UNITS)}"
    assert unit_hint("Nm").startswith('; did you mean "N m"?; `mc-engine units`')
    listed = CliRunner().invoke(app, ["units"]).output
    lines = [line.split("  ") for line in listed.splitlines()]
    assert ["torque", "N m, uN m, mN m, kN m"] in [[one[0], one[-1].strip()] for one in lines]
    assert "Two end otherwise: _pct for %, _days for day\n" in listed
