"""Direction of the lift and force along the axis; heat rates."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mc_engine.physics.aerodynamics import axial_coefficient, lift_direction
from mc_engine.physics.heating import (
    SUTTON_GRAVES,
    detra_kemp_riddell,
    detra_kemp_riddell_coefficient,
    sutton_graves,
)

UP = (0.0, 0.0, 1.0)  # with x ahead and y to the left
number = st.floats(-1e4, 1e4)


def lift(velocity, bank):
    v = np.array(velocity, dtype=float)
    return np.array(lift_direction(*v, *UP, float(np.sqrt(v @ v)), np.cos(bank), np.sin(bank)))


@given(vx=number, vy=number, vz=number, bank=st.floats(-7.0, 7.0))
def test_lift_has_length_one_and_is_across_the_velocity(vx, vy, vz, bank):
    speed = np.sqrt(vx * vx + vy * vy + vz * vz)
    if np.hypot(vx, vy) > 0.011 * speed and speed > 1.0:
        direction = lift((vx, vy, vz), bank)
        assert direction @ direction == pytest.approx(1.0, rel=1e-9)
        assert abs(direction @ [vx, vy, vz]) < 1e-9 * speed


def test_lift_at_bank_zero_is_up_and_at_90_degrees_to_the_right():
    assert lift((100.0, 0.0, 0.0), 0.0) == pytest.approx([0.0, 0.0, 1.0], abs=1e-15)
    assert lift((100.0, 0.0, 0.0), np.pi / 2) == pytest.approx([0.0, -1.0, 0.0], abs=1e-15)
    assert lift((100.0, 0.0, 0.0), np.pi) == pytest.approx([0.0, 0.0, -1.0], abs=1e-15)


@pytest.mark.parametrize(("tilt", "length"), [(0.02, 1.0), (0.005, 0.5), (0.0, 0.0)])
def test_lift_fades_where_the_flight_is_vertical(tilt, length):
    direction = lift((100.0 * np.sin(tilt), 0.0, -100.0 * np.cos(tilt)), 0.3)
    assert np.sqrt(direction @ direction) == pytest.approx(length, rel=1e-3, abs=1e-15)


def test_axial_force_is_drag_at_no_angle_of_attack_and_lift_at_a_right_one():
    assert axial_coefficient(1.2, 0.4, 1.0, 0.0) == 1.2
    assert axial_coefficient(1.2, 0.4, 0.0, 1.0) == 0.4


def test_detra_kemp_and_riddell_give_17600_btu_per_square_foot_and_second():
    """For 1 ft at sea-level density and 26 000 ft/s; 1 Btu/(ft^2 s) = 11 356.5 W/m^2.

    The digest's factor is 1.1035e8, with the root of a foot in it: 17 600 * 11 356.5 * sqrt(0.3048).
    """
    coefficient = detra_kemp_riddell_coefficient(0.3048)
    assert detra_kemp_riddell(1.225, 7924.8, coefficient) == pytest.approx(17_600 * 11_356.5, rel=2e-4)


@given(speed=st.floats(100.0, 12e3), density=st.floats(1e-9, 1.0))
def test_heat_rates_grow_with_the_root_of_density_and_the_third_power_of_speed(speed, density):
    assert sutton_graves(4.0 * density, speed, 1.0) == pytest.approx(
        2.0 * sutton_graves(density, speed, 1.0), rel=1e-12
    )
    assert sutton_graves(density, 2.0 * speed, 1.0) == pytest.approx(
        8.0 * sutton_graves(density, speed, 1.0), rel=1e-12
    )
    growth = detra_kemp_riddell(density, 2.0 * speed, 1.0) / detra_kemp_riddell(density, speed, 1.0)
    assert growth == pytest.approx(2.0**3.15, rel=1e-12)


def test_sutton_and_graves_at_a_round_point():
    """k sqrt(rho / R) V^3 with 1e-4 kg/m^3, 1 m and 7 km/s: 1.7415e-4 * 0.01 * 3.43e11."""
    assert sutton_graves(1e-4, 7000.0, SUTTON_GRAVES["earth"]) == pytest.approx(5.973e5, rel=1e-3)
