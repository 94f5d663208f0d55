"""Pressure and speed of sound of the 1976 standard, and wind profiles."""

from collections import namedtuple

import numpy as np
import pytest
from records import by_both

from mc_engine.errors import ModelError
from mc_engine.lanes import physics
from mc_engine.physics.air import GAS_CONSTANT, dynamic_pressure, us76_air
from mc_engine.physics.atmosphere import US76_TOP, us76, us76_logarithm
from mc_engine.physics.curves import wind_profile

# NOAA-S/T 76-1562, table I: geometric altitude [m], pressure [Pa], temperature [K], speed of sound [m/s]
PRINTED = [
    (0.0, 101_325.0, 288.150, 340.29),
    (1e3, 8.9876e4, 281.651, 336.43),
    (5e3, 5.4048e4, 255.676, 320.55),
    (10e3, 2.6500e4, 223.252, 299.53),
    (20e3, 5.5293e3, 216.650, 295.07),
    (30e3, 1.1970e3, 226.509, 301.71),
    (40e3, 2.8714e2, 250.350, 317.19),
    (50e3, 7.9779e1, 270.650, 329.80),
    (60e3, 2.1958e1, 247.021, 315.07),
    (70e3, 5.2209e0, 219.585, 297.06),
    (80e3, 1.0524e0, 198.639, 282.54),
]
# and above, pressure, density, temperature and molar mass [kg/kmol], which the gas law ties together
ALOFT = [
    (90e3, 1.8359e-1, 186.87, 28.91),
    (100e3, 3.2011e-2, 195.08, 28.40),
    (110e3, 7.1042e-3, 240.00, 27.27),
    (120e3, 2.5382e-3, 360.00, 26.20),
    (150e3, 4.5422e-4, 634.39, 24.10),
    (200e3, 8.4736e-5, 854.56, 21.30),
]
Altitude = namedtuple("Altitude", "h")


@pytest.mark.parametrize(("h", "pressure", "temperature", "speed"), PRINTED)
def test_the_air_is_the_printed_one(h, pressure, temperature, speed):
    air = us76_air(h)
    assert air.pressure == pytest.approx(pressure, rel=1e-4)
    assert air.temperature == pytest.approx(temperature, abs=6e-4)
    assert air.speed_of_sound == pytest.approx(speed, abs=6e-3)
    assert air.density == us76(h)


@pytest.mark.parametrize(("h", "pressure", "temperature", "molar_mass"), ALOFT)
def test_aloft_pressures_are_printed_and_fit_the_densities(h, pressure, temperature, molar_mass):
    air = us76_air(h)
    assert air.pressure == pytest.approx(pressure, rel=1e-12)
    assert air.density * 8314.32 / molar_mass * temperature == pytest.approx(pressure, rel=5e-4)
    assert air.speed_of_sound == us76_air(US76_TOP).speed_of_sound


def test_pressure_holds_the_column_of_air_above_it():
    h = np.linspace(-1e3, 85e3, 400)
    gravity = 9.80665 * (6_356_766.0 / (6_356_766.0 + h)) ** 2
    slope = (np.log(us76_air(h + 1.0).pressure) - np.log(us76_air(h - 1.0).pressure)) / 2.0
    near_a_corner = np.abs(np.diff(us76_logarithm(np.array([h - 1.0, h + 1.0]))[1], axis=0)[0]) > 1e-8
    found = us76_air(h)
    np.testing.assert_allclose(slope[~near_a_corner], (-gravity * found.density / found.pressure)[~near_a_corner],
                               rtol=1e-6)  # fmt: skip
    assert near_a_corner.mean() < 0.05


def test_pressure_has_no_step_at_86_km_and_numbers_stay_numbers_far_away():
    below, above = us76_air(US76_TOP - 1e-6), us76_air(US76_TOP + 1e-6)
    assert below.pressure == pytest.approx(above.pressure, rel=1e-9)
    assert below.pressure == pytest.approx(below.density * GAS_CONSTANT * below.temperature, rel=1e-12)
    for h in (-5e4, 1e6, 1e8):
        assert np.isfinite(us76_air(h)).all()
    assert np.isnan(us76_air(np.nan)).all()


def test_the_air_is_the_same_in_lanes():
    @physics
    def function(r):
        return us76_air(r.h)

    h = np.random.default_rng(4).uniform(-1e3, 250e3, (1, 4096))
    found = by_both(function, Altitude, h)
    assert found[0] == pytest.approx(us76(h[0]), rel=1e-14)


def test_the_dynamic_pressure_of_water_at_a_metre_a_second():
    assert dynamic_pressure(1000.0, 1.0) == 500.0


# ---- wind


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setitem(globals(), "__file__", str(tmp_path / "model.py"))
    text = "altitude_km,speed_m_s,from_deg,north_m_s,east_m_s\n0,10,350,-9.848,1.736\n2,10,10,-9.848,-1.736\n"
    (tmp_path / "wind.csv").write_text(text)
    return tmp_path


def test_a_wind_from_the_north_blows_south_and_turns_the_short_way(folder):
    wind = wind_profile("wind.csv", "altitude_km", speed="speed_m_s", coming_from="from_deg")
    other = wind_profile("wind.csv", "altitude_km", "north_m_s", "east_m_s")
    assert wind(1e3) == pytest.approx((-10.0 * np.cos(np.radians(10.0)), 0.0, 0.0), abs=1e-12)
    assert wind(500.0) == pytest.approx(other(500.0), abs=1e-3)
    assert wind(0.0).y > 0.0  # from a little west of north: to the east


def test_a_wind_without_its_columns_is_refused(folder):
    with pytest.raises(ModelError, match="north and east, or speed and coming_from"):
        wind_profile("wind.csv", "altitude_km", "north_m_s")
