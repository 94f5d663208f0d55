import numpy as np
import pytest
from typer.testing import CliRunner

from mc_engine.command_line.commands import app
from mc_engine.errors import ModelError
from mc_engine.units import UNITS, compatible, convert, nearest_unit, unit_hint, unit_of

SYMBOLS = {
    "m": 1.0, "g": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "day": 86_400.0, "Hz": 1.0, "N": 1.0, "Pa": 1.0,
    "bar": 1e5, "J": 1.0, "eV": 1.602176634e-19, "W": 1.0, "K": 1.0, "V": 1.0, "A": 1.0, "Ohm": 1.0, "C": 1.0, "T": 1.0,
    "rad": 1.0, "deg": np.pi / 180.0, "arcmin": np.pi / 10_800.0, "arcsec": np.pi / 648_000.0, "rev": 2.0 * np.pi,
}  # fmt: skip
PREFIXES = {"n": 1e-9, "u": 1e-6, "m": 1e-3, "c": 1e-2, "h": 1e2, "k": 1e3, "M": 1e6}
NOT_OF_SYMBOLS = {
    "": 1.0, "%": 0.01, "ppm": 1e-6, "g": 9.80665, "ug": 9.80665e-6, "rpm": np.pi / 30.0, "deg/rev": np.pi / 180.0,
}  # fmt: skip


def worth(unit):
    """The SI value of a unit, from its name alone: powers, products and quotients of symbols with prefixes."""
    if unit in NOT_OF_SYMBOLS:
        return NOT_OF_SYMBOLS[unit]
    values = {prefix + symbol: PREFIXES[prefix] * SYMBOLS[symbol] for prefix in PREFIXES for symbol in SYMBOLS}
    return eval(unit.replace("^", "**").replace(" ", "*"), {**values, **SYMBOLS, "sqrt": np.sqrt})


@pytest.mark.parametrize("unit", UNITS)
def test_every_unit_is_worth_what_its_name_says(unit):
    assert UNITS[unit].factor == pytest.approx(worth(unit), rel=1e-15, abs=0.0)


@pytest.mark.parametrize(
    ("value", "unit", "to", "expected"),
    [(250.0, "m", "km", 0.25), (2.0, "h", "min", 120.0), (3600.0, "arcsec", "deg", 1.0), (1.0, "W h", "kJ", 3.6)],
)
def test_a_number_in_one_unit_becomes_the_number_in_another(value, unit, to, expected):
    assert convert(value, unit, to) == pytest.approx(expected, rel=1e-15)


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
     ("angle_arcsc", "angle_arcsec"), ("k_w_m2k", "k_w_m2_k"), ("wind_kmh", "wind_km_h")],
)  # fmt: skip
def test_a_misspelt_ending_is_answered_with_the_unit_that_was_meant(name, meant):
    with pytest.raises(ModelError, match=f'did you mean "{meant}"'):
        unit_of(name)


@pytest.mark.parametrize("ending", ["kph", "kts", "mach", "gm", "mbar", "m3s", "mm2", "dgr", "lbs", "psi"])
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


@pytest.mark.parametrize(
    ("name", "quotient", "unit"),
    [("flow_kg_h", "kg/h", "h"), ("speed_ft_s", "ft/s", "s"), ("climb_m_min", "m/min", "min"),
     ("density_g_cm3", "g/cm^3", "cm^3"), ("turn_rev_s", "rev/s", "s")],
)  # fmt: skip
def test_a_quotient_that_no_unit_is_is_not_taken_for_its_denominator(name, quotient, unit):
    with pytest.raises(ModelError) as caught:
        unit_of(name)
    assert f'"{name}" ends in {quotient}, which is no unit here' in str(caught.value)
    assert f'say unit="{unit}" if it is in {unit}' in str(caught.value)


def test_kilometres_an_hour_are_a_speed():
    assert unit_of("wind_km_h") == "km/h"
    assert convert(36.0, "km/h", "m/s") == pytest.approx(10.0, rel=1e-15)
