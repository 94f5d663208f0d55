"""Places in the plane about their middle."""

import numpy as np
import pytest

from mc_engine.statistics.geodesy import LocalPlane, middle_plane

MILLIMETRE = 1e-3


def test_distance_and_direction_are_those_of_the_geodesic():
    # GeographicLib, example of its geodesic routines: JFK to Heathrow, 5551759.400 m, azimuth 51.198882845579824 deg
    (east, north), *_ = LocalPlane(40.6, -73.8).points(np.array([51.6]), np.array([-0.5]))
    assert np.hypot(east, north) == pytest.approx(5_551_759.400, abs=MILLIMETRE)
    assert np.degrees(np.arctan2(east, north)) == pytest.approx(51.198882845579824, abs=1e-10)


def test_a_quarter_meridian_has_its_length():
    # C. F. F. Karney, Journal of Geodesy 87 (2013): 10 001 965.729 m on WGS 84
    ((east, north),) = LocalPlane(0.0, 20.0).points(np.array([90.0]), np.array([0.0]))
    assert north == pytest.approx(10_001_965.729, abs=MILLIMETRE)
    assert east == pytest.approx(0.0, abs=MILLIMETRE)


# of the module's first page: (s/R) / sin(s/R) is 1.001 at 500 km and 1.017 at 2000 km from the middle
@pytest.mark.parametrize(("distance", "stretch"), [(0.0, 0.0), (500e3, 0.001), (2000e3, 0.017)])
def test_lengths_across_are_too_large_by_the_stated_factor(distance, stretch):
    assert LocalPlane(40.0, 0.0).stretch(distance) == pytest.approx(stretch, abs=5e-4)


def test_places_come_back_from_the_plane():
    draw = np.random.Generator(np.random.Philox(key=1))
    latitude, longitude = draw.uniform(-89.0, 89.0, 200), draw.uniform(-180.0, 180.0, 200)
    plane = LocalPlane(51.0, -3.0)
    back = plane.places(plane.points(latitude, longitude))
    assert back[0] == pytest.approx(latitude, abs=1e-9)
    assert back[1] == pytest.approx(longitude, abs=1e-9)


def test_the_mean_of_places_across_the_date_line_lies_on_it():
    plane = middle_plane(np.array([10.0, -10.0, 0.0, 0.0]), np.array([179.0, -179.0, 175.0, 185.0]))
    assert abs(plane.longitude) == pytest.approx(180.0, abs=1e-6)
    assert plane.latitude == pytest.approx(0.0, abs=1e-6)
    east = plane.points(np.zeros(2), np.array([179.0, -179.0]))[:, 0]
    assert east == pytest.approx([-111_319.49, 111_319.49], abs=0.01)  # a degree of the equator


def test_the_mean_of_places_around_a_pole_is_the_pole():
    plane = middle_plane(np.full(6, -89.0), np.arange(0.0, 360.0, 60.0))
    assert plane.latitude == pytest.approx(-90.0, abs=1e-7)
    points = plane.points(np.full(6, -89.0), np.arange(0.0, 360.0, 60.0))
    assert np.hypot(*points.T) == pytest.approx(np.full(6, 111_693.865), abs=0.5)
