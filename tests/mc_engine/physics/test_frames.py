"""Altitude over the ellipsoid, local axes, angles of a velocity."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mc_engine.physics.frames import (
    WGS84_ECCENTRICITY2,
    WGS84_RADIUS,
    geodetic_latitude,
    local_axes,
    over_ellipsoid,
    radius_at_altitude,
    spherical,
    velocity_angles,
    velocity_components,
)

POLAR = WGS84_RADIUS * np.sqrt(1.0 - WGS84_ECCENTRICITY2)
LATITUDES = np.linspace(-np.pi / 2, np.pi / 2, 361)
angle = st.floats(-1.5, 1.5)


def place(latitude, altitude):
    """Distance from the axis and from the equator [m] of a geodetic latitude and altitude: the exact direction."""
    n = WGS84_RADIUS / np.sqrt(1.0 - WGS84_ECCENTRICITY2 * np.sin(latitude) ** 2)
    return (n + altitude) * np.cos(latitude), (n * (1.0 - WGS84_ECCENTRICITY2) + altitude) * np.sin(latitude)


def altitude_of(p, z):
    r = np.hypot(p, z)
    return over_ellipsoid(r, 1.0 / r, (z / r) ** 2, POLAR, WGS84_ECCENTRICITY2)[0]


@pytest.mark.parametrize(
    ("altitude", "error"), [(0.0, 1e-8), (1e4, 1e-6), (1e5, 1e-4), (2e5, 1e-4), (1e7, 0.1), (4e8, 0.1)]
)
def test_the_altitude_is_exact_to_its_stated_error(altitude, error):
    assert np.abs(altitude_of(*place(LATITUDES, altitude)) - altitude).max() < error


@pytest.mark.parametrize("altitude", [0.0, 1e5, 1e7])
def test_the_geodetic_latitude_is_exact_to_1e_8_rad(altitude):
    p, z = place(LATITUDES, altitude)
    found = geodetic_latitude(p, 0.0 * p, z, altitude_of(p, z), POLAR, WGS84_ECCENTRICITY2)
    assert np.abs(found - LATITUDES).max() < 1e-8


def test_the_21_km_between_equator_and_pole_are_there():
    assert altitude_of(WGS84_RADIUS, 0.0) == pytest.approx(0.0, abs=1e-8)
    assert altitude_of(0.0, WGS84_RADIUS) == pytest.approx(21_384.7, abs=0.05)  # a f


@given(sin2=st.floats(0.01, 0.99))
def test_the_slope_is_the_derivative_of_the_ellipsoids_radius(sin2):
    r, step = 6.5e6, 1e-5
    slope = over_ellipsoid(r, 1.0 / r, sin2, POLAR, WGS84_ECCENTRICITY2)[1]

    def radius(x):
        return POLAR / np.sqrt(1.0 - WGS84_ECCENTRICITY2 * (1.0 - x))

    assert slope == pytest.approx((radius(sin2 + step) - radius(sin2 - step)) / (2.0 * step), rel=1e-6)


@given(latitude=angle, altitude=st.floats(0.0, 2e5))
def test_the_radius_at_an_altitude_leads_back_to_it(latitude, altitude):
    latitude = np.array([latitude])
    r = radius_at_altitude(np.array([altitude]), latitude, np.array([POLAR]), np.array([WGS84_ECCENTRICITY2]))
    found = over_ellipsoid(r, 1.0 / r, np.sin(latitude) ** 2, POLAR, WGS84_ECCENTRICITY2)[0]
    assert found[0] == pytest.approx(altitude, abs=1e-8)


@given(latitude=angle, longitude=st.floats(-3.1, 3.1), path=angle, heading=st.floats(0.1, 6.2), speed=st.floats(1, 1e4))
def test_components_and_angles_of_place_and_velocity_are_inverse(latitude, longitude, path, heading, speed):
    north, east, up = local_axes(np.array([latitude]), np.array([longitude]))
    c = velocity_components(np.array([speed]), np.array([path]), np.array([heading]))
    position, velocity = (7e6 * up)[:, 0], (c[0] * north + c[1] * east + c[2] * up)[:, 0]
    assert spherical(*position) == pytest.approx((latitude, longitude), abs=1e-12)
    found = velocity_angles(*position, *velocity)
    assert found[0] == pytest.approx(path, abs=1e-9)
    assert np.cos(found[1] - heading) == pytest.approx(1.0, abs=1e-9)
