"""Spherical harmonics against closed forms, the gradient of a potential of its own, and another library."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import lpmv

from mc_engine.errors import ModelError
from mc_engine.physics.geopotential import (
    EGM2008,
    MU_EGM2008,
    RADIUS_EGM2008,
    harmonics,
    harmonics_table,
    unnormalised,
)
from mc_engine.physics.gravity import point_mass

PLACES = [(7.0e6, 1.0e6, -2.0e6), (-3.0e7, -2.9e7, 1.0e6), (1.0e6, -2.0e6, 6.9e6), (4.2e7, 1.0, 0.0)]


def ours(place, degree, order):
    table = harmonics_table(degree, order).ravel()
    return np.array(harmonics(*place, MU_EGM2008, RADIUS_EGM2008, float(degree), float(order), table, 0.0))


def potential(place, degree, order):
    """Potential of the harmonics from degree 2 on, by scipy's Legendre functions; its sign is that of geodesy."""
    x, y, z = place
    r, longitude = np.linalg.norm(place), np.arctan2(y, x)
    total = 0.0
    for n, m, c, s in EGM2008:
        if n <= degree and m <= order:
            legendre = (-1.0) ** m * lpmv(m, n, z / r)
            wave = c * np.cos(m * longitude) + s * np.sin(m * longitude)
            total += unnormalised(n, m) * (RADIUS_EGM2008 / r) ** n * legendre * wave
    return MU_EGM2008 / r * total


@pytest.mark.parametrize(("degree", "order"), [(2, 0), (2, 2), (4, 4), (6, 3), (8, 8)])
@pytest.mark.parametrize("place", PLACES)
def test_the_acceleration_is_the_gradient_of_the_potential(place, degree, order):
    gradient, step = np.zeros(3), 2e3
    for axis in range(3):
        for steps, weight in ((1, 45.0), (2, -9.0), (3, 1.0)):  # central differences of sixth order
            shift = np.eye(3)[axis] * steps * step
            change = potential(place + shift, degree, order) - potential(place - shift, degree, order)
            gradient[axis] += weight * change / (60.0 * step)
    size = np.linalg.norm(gradient)
    assert ours(place, degree, order) == pytest.approx(gradient, rel=0.0, abs=1e-8 * size + 1e-15)


@pytest.mark.parametrize("place", PLACES)
def test_degree_two_alone_is_the_closed_form_of_j2(place):
    """Curtis, Orbital Mechanics for Engineering Students, 3rd ed., eq. (12.30)."""
    r = np.linalg.norm(place)
    j2 = -unnormalised(2, 0) * EGM2008[0][2]
    q = 1.5 * j2 * MU_EGM2008 * RADIUS_EGM2008**2 / r**5
    k = 5.0 * (place[2] / r) ** 2 - np.array([1.0, 1.0, 3.0])
    assert ours(place, 2, 0) == pytest.approx(q * k * np.array(place), rel=1e-13)


@pytest.mark.parametrize(("degree", "order"), [(2, 0), (4, 4), (8, 8), (7, 2)])
def test_another_library_has_the_same_coefficients_and_accelerations(degree, order):
    heyoka = pytest.importorskip("heyoka")
    axes = list(heyoka.make_vars("x", "y", "z"))
    whole = heyoka.cfunc(heyoka.model.egm2008_acc(axes, degree, order), axes)
    for place in PLACES:
        sum_of_both = ours(place, degree, order) + np.array(point_mass(*place, MU_EGM2008))
        assert sum_of_both == pytest.approx(whole(np.array(place)), rel=0.0, abs=2e-15 * np.linalg.norm(sum_of_both))


@settings(max_examples=30, deadline=None)
@given(turn=st.floats(-3.1, 3.1), z=st.floats(-1e7, 1e7))
def test_zonal_harmonics_turn_with_the_place(turn, z):
    c, s = np.cos(turn), np.sin(turn)
    start, end = ours((9e6, 0.0, z), 8, 0), ours((9e6 * c, 9e6 * s, z), 8, 0)
    assert end == pytest.approx([c * start[0], s * start[0], start[2]], rel=1e-11, abs=1e-15)


def test_the_geostationary_values_are_those_of_the_source_digest():
    """Transverse and radial acceleration at 95 E, and the four places where the transverse one is nothing."""

    def along(longitude):
        east = np.array([-np.sin(longitude), np.cos(longitude), 0.0])
        return ours(42_164_170.0 * np.array([np.cos(longitude), np.sin(longitude), 0.0]), 4, 4) @ east

    at = np.radians(95.0)
    assert along(at) == pytest.approx(4.417e-8, rel=5e-3)
    outward = np.array([np.cos(at), np.sin(at), 0.0])
    assert ours(42_164_170.0 * outward, 4, 4) @ outward == pytest.approx(-8.260e-6, rel=5e-3)
    longitudes = np.arange(0.0, 361.0)
    values = np.array([along(longitude) for longitude in np.radians(longitudes)])
    before = np.flatnonzero(values[:-1] * values[1:] < 0.0)
    zeros = longitudes[before] + values[before] / (values[before] - values[before + 1])
    assert zeros == pytest.approx([74.94, 161.90, 254.91, 348.48], abs=0.1)


def test_little_is_left_beyond_the_lower_degrees_at_the_geostationary_radius():
    angles = np.radians(np.arange(0.0, 360.0, 10.0))
    places = 42_164_170.0 * np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])
    left = [[np.linalg.norm(ours(place, 8, 8) - ours(place, n, n)) for place in places] for n in (7, 4)]
    assert max(left[0]) < 1e-12
    assert 2e-10 < max(left[1]) < 3e-10  # as the module says, on the equator


def test_a_degree_without_coefficients_is_refused():
    with pytest.raises(ModelError, match="harmonics of degree 9: the coefficients at hand end at degree 8"):
        harmonics_table(9, 2)
