"""Footprints on the Earth."""

import numpy as np
import pytest

from mc_engine.statistics.footprint import footprint
from mc_engine.statistics.geodesy import LocalPlane


def scattered(latitude, longitude, n=2000):
    """Places with standard deviations of 40 km and 5 km, the long axis 30 degrees from north to the east."""
    draw = np.random.Generator(np.random.Philox(key=4))
    along, across = draw.normal(0.0, 40e3, n), draw.normal(0.0, 5e3, n)
    s, c = np.sin(np.radians(30.0)), np.cos(np.radians(30.0))
    return LocalPlane(latitude, longitude).places(np.column_stack([s * along + c * across, c * along - s * across]))


@pytest.mark.parametrize("place", [(0.0, 0.0), (54.0, 76.0), (10.0, 180.0), (-89.95, 12.0), (90.0, 0.0)])
def test_a_footprint_has_the_same_size_wherever_it_lies(place):
    found = footprint(*scattered(*place))
    ellipse = found.ellipses[1]
    assert ellipse.semi_axes == pytest.approx([40e3 * 2.145966, 5e3 * 2.145966], rel=0.04)
    assert ellipse.inside / ellipse.n == pytest.approx(0.9, abs=0.03)
    middle = np.array([place[0]]), np.array([place[1]])
    assert np.hypot(*found.plane.points(*middle)[0]) < 3.0 * 40e3 / np.sqrt(2000)


def test_the_long_axis_points_where_the_cloud_does():
    found = footprint(*scattered(20.0, 179.9))
    assert np.degrees(found.ellipses[0].direction) == pytest.approx(60.0, abs=0.5)  # from east to north


def test_a_footprint_reaches_to_its_farthest_place_and_no_farther_than_a_plane_shows():
    ends = np.array([[4.99e6, 0.0], [-4.99e6, 0.0], [0.0, 1e6], [0.0, -1e6]])
    assert footprint(*LocalPlane(0.0, 30.0).places(ends)).reach == pytest.approx(4.99e6, abs=1.0)
    assert footprint(*LocalPlane(0.0, 30.0).places(ends * 5.01 / 4.99)) is None


def test_places_across_the_planet_are_no_footprint():
    assert footprint(np.array([0.0, 0.0, 60.0]), np.array([0.0, 100.0, 50.0])) is None
