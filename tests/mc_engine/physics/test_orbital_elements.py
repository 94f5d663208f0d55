"""Equinoctial elements against classical ones, and the axes of the orbit."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mc_engine.physics.frames import orbital_axes, turned
from mc_engine.physics.orbital_elements import equinoctial, mean_anomaly, state_of_elements, true_anomaly

MU = 3.986004415e14


def classical_state(a, e, inclination, node, pericentre, eccentric):
    """Place and velocity from the eccentric anomaly, by three rotations."""

    def about(axis, x):
        c, s = np.cos(x), np.sin(x)
        return {"x": np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), "z": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])}[
            axis
        ]

    root, n = np.sqrt(1.0 - e * e), np.sqrt(MU / a**3)
    turn = about("z", node) @ about("x", inclination) @ about("z", pericentre)
    place = a * np.array([np.cos(eccentric) - e, root * np.sin(eccentric), 0.0])
    rate = n / (1.0 - e * np.cos(eccentric))
    velocity = a * rate * np.array([-np.sin(eccentric), root * np.cos(eccentric), 0.0])
    return turn @ place, turn @ velocity


angles = st.floats(-3.1, 3.1)


@settings(max_examples=200, deadline=None)
@given(st.floats(7e6, 1e8), st.floats(0.0, 0.8), st.floats(0.0, 2.5), angles, angles, angles)
def test_the_elements_are_those_that_the_state_was_made_of(a, e, inclination, node, pericentre, eccentric):
    place, velocity = classical_state(a, e, inclination, node, pericentre, eccentric)
    x = equinoctial(*place, *velocity, MU)
    assert x.a == pytest.approx(a, rel=1e-11)
    longitude = node + pericentre
    assert [x.k, x.h] == pytest.approx([e * np.cos(longitude), e * np.sin(longitude)], abs=1e-12)
    tilt = np.tan(0.5 * inclination)
    assert [x.q, x.p] == pytest.approx([tilt * np.cos(node), tilt * np.sin(node)], abs=1e-12 * (1.0 + tilt))
    mean = longitude + eccentric - e * np.sin(eccentric)
    assert np.exp(1j * x.mean) == pytest.approx(np.exp(1j * mean), abs=1e-11)
    anomaly = 2.0 * np.arctan2(np.sqrt(1 + e) * np.sin(0.5 * eccentric), np.sqrt(1 - e) * np.cos(0.5 * eccentric))
    assert np.exp(1j * x.true) == pytest.approx(np.exp(1j * (longitude + anomaly)), abs=1e-11)


def test_a_circular_orbit_in_the_equator_is_as_good_as_any():
    place, velocity = classical_state(4.2e7, 0.0, 0.0, 0.0, 0.0, 1.0)
    x = equinoctial(*place, *velocity, MU)
    assert [x.k, x.h, x.q, x.p] == pytest.approx([0.0] * 4, abs=1e-15)
    assert [x.mean, x.true] == pytest.approx([1.0, 1.0], abs=1e-14)


@settings(max_examples=50, deadline=None)
@given(st.floats(0.0, 0.8), st.floats(0.0, 3.0), angles, angles, angles)
def test_the_orbital_axes_are_right_handed_and_follow_the_motion(e, inclination, node, pericentre, eccentric):
    place, velocity = classical_state(4.2e7, e, inclination, node, pericentre, eccentric)
    axes = np.reshape(orbital_axes(*place, *velocity), (3, 3))
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-13)
    assert np.cross(axes[0], axes[1]) == pytest.approx(axes[2], abs=1e-13)
    assert axes[0] @ place == pytest.approx(np.linalg.norm(place), rel=1e-13)
    assert axes[1] @ velocity > 0.0
    assert axes[2] @ velocity == pytest.approx(0.0, abs=1e-9)


def test_axes_turned_by_a_quarter_see_x_as_minus_y():
    assert turned(1.0, 0.0, 0.0, 1.0) == (0.0, -1.0)
    c, s = np.cos(0.3), np.sin(0.3)
    assert turned(np.cos(1.0), np.sin(1.0), c, s) == pytest.approx((np.cos(0.7), np.sin(0.7)))


@settings(max_examples=200, deadline=None)
@given(st.floats(7e6, 1e8), st.floats(0.0, 0.8), st.floats(0.0, 3.1), angles, angles, angles)
def test_the_state_of_elements_is_that_of_three_rotations(a, e, inclination, node, pericentre, eccentric):
    place, velocity = classical_state(a, e, inclination, node, pericentre, eccentric)
    anomaly = 2.0 * np.arctan2(np.sqrt(1 + e) * np.sin(0.5 * eccentric), np.sqrt(1 - e) * np.cos(0.5 * eccentric))
    state = state_of_elements(a, e, inclination, node, pericentre, anomaly, MU)
    assert state[:3] == pytest.approx(place, abs=1e-13 * a / (1.0 - e))
    assert state[3:] == pytest.approx(velocity, abs=1e-13 * np.linalg.norm(velocity) / (1.0 - e))


@settings(max_examples=200, deadline=None)
@given(st.floats(0.0, 0.5), angles)
def test_kepler_s_equation_goes_both_ways(e, eccentric):
    mean = eccentric - e * np.sin(eccentric)
    anomaly = 2.0 * np.arctan2(np.sqrt(1 + e) * np.sin(0.5 * eccentric), np.sqrt(1 - e) * np.cos(0.5 * eccentric))
    assert mean_anomaly(anomaly, e) == pytest.approx(mean, abs=1e-14)
    assert true_anomaly(mean, e) == pytest.approx(anomaly, abs=1e-13)
    assert true_anomaly(mean + 4.0 * np.pi, e) == pytest.approx(anomaly, abs=1e-13)


@pytest.mark.parametrize("e", [0.0, 0.5, 0.8, 0.95])
def test_kepler_s_equation_is_solved_on_long_ellipses_too(e):
    mean = np.concatenate([np.linspace(-np.pi, np.pi, 20_001)[1:-1], np.logspace(-12.0, 0.0, 1000)])
    assert mean_anomaly(true_anomaly(mean, e), e) == pytest.approx(mean, abs=2e-14)
