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


def test_chosen_cases_have_a_place_and_no_regions():
    found = footprint(*scattered(20.0, 30.0), random=False)
    assert found.all_regions == []
    assert len(found.points) == 2000


def test_one_place_many_equal_ones_and_a_line_have_no_regions():
    for latitude, longitude in ([[45.0], [7.0]], [[45.0] * 30, [7.0] * 30], [[0.0] * 30, np.arange(30.0)]):
        found = footprint(np.array(latitude), np.array(longitude))
        assert found.all_regions == []


def test_places_across_the_planet_are_no_footprint():
    assert footprint(np.array([0.0, 0.0, 60.0]), np.array([0.0, 100.0, 50.0])) is None
