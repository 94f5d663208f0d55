"""Sunlight and shadow against the geometry of two discs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mc_engine.physics.constants import AU
from mc_engine.physics.radiation import PRESSURE, RADIUS_EARTH, RADIUS_SUN, discs, solar_pressure, sunlit

SUN = (AU, 0.0, 0.0)
GEO = 42_164_170.0


def behind(degrees, r=GEO):
    """A place whose direction is this far from that opposite to the Sun."""
    turn = np.radians(degrees)
    return -r * np.cos(turn), r * np.sin(turn), 0.0


def share_by_counting(place, n=400):
    """Share of points of the Sun's disc that the Earth's disc does not cover."""
    a, b, c = discs(*place, *SUN)
    x, y = np.meshgrid(np.linspace(-a, a, n), np.linspace(-a, a, n))
    disc = x * x + y * y <= a * a
    return float(((x - c) ** 2 + y * y > b * b)[disc].mean())


@pytest.mark.parametrize("degrees", [0.0, 5.0, 8.4, 8.5, 8.6, 8.7, 8.8, 8.9, 9.0, 20.0, 90.0, 180.0])
def test_the_share_of_the_sun_is_what_counting_points_of_its_disc_gives(degrees):
    assert float(sunlit(*behind(degrees), *SUN)) == pytest.approx(share_by_counting(behind(degrees)), abs=2e-3)


def test_the_shadow_at_the_geostationary_radius_lasts_as_long_as_it_is_known_to():
    """The longest eclipse there is of some 72 minutes, 69 of them total."""
    minutes = np.arange(-60.0, 60.0, 0.05)
    share = np.array([float(sunlit(*behind(m * 360.0 / 1436.07), *SUN)) for m in minutes])
    assert (share < 1.0).sum() * 0.05 == pytest.approx(71.5, abs=1.0)
    assert (share == 0.0).sum() * 0.05 == pytest.approx(67.2, abs=1.0)


@settings(max_examples=40, deadline=None)
@given(st.floats(0.0, 180.0), st.floats(6.6e6, 1e8))
def test_the_share_is_one_nothing_or_between(degrees, r):
    place = behind(degrees, r)
    share, (a, b, c) = float(sunlit(*place, *SUN)), discs(*place, *SUN)
    assert 0.0 <= share <= 1.0
    assert share == 1.0 or c < a + b
    assert share == 0.0 or c > b - a


def test_the_pressure_at_one_astronomical_unit_pushes_away_from_the_sun():
    push = solar_pressure(0.0, GEO, 0.0, *SUN, 0.02, 1.5)
    assert push[0] == pytest.approx(-PRESSURE * 0.03, rel=1e-6)
    assert push[1] == pytest.approx(PRESSURE * 0.03 * GEO / AU, rel=1e-6)
    far = solar_pressure(0.0, np.sqrt(3.0) * AU, 0.0, *SUN, 0.02, 1.5)
    assert np.hypot(*far[:2]) == pytest.approx(0.25 * PRESSURE * 0.03, rel=1e-6)


def test_there_is_no_pressure_in_the_umbra():
    assert solar_pressure(*behind(1.0), *SUN, 0.02, 1.5) == (0.0, 0.0, 0.0)
    assert RADIUS_SUN > 100.0 * RADIUS_EARTH
