"""The nominal manoeuvre without thrusters: the numbers of the reading that fits Table 12, and of the others."""

import numpy as np
import pytest
from flexible_flights import END, fly_one, history


@pytest.fixture(scope="module")
def nominal():
    return fly_one()


@pytest.fixture(scope="module")
def seen():
    return history()


def test_the_rate_is_held_at_its_limit(nominal):
    assert 0.1 <= nominal["peak_rate_rad_s"] <= 0.1005


@pytest.mark.parametrize("grid", [(0.025, 1), (0.02, 1), (0.005, 1), (0.005, 2), (0.005, 4), (0.002, 1)])
def test_neither_the_step_nor_the_sampling_moves_the_end(nominal, grid):
    row = fly_one(step_s=grid[0], steps_per_sample=float(grid[1]))
    for name in END[:4]:
        assert row[name] == pytest.approx(nominal[name], abs=2e-6)
    for name in END[4:7]:
        assert row[name] == pytest.approx(nominal[name], abs=5e-8)
    assert row["settling_time_s"] == pytest.approx(nominal["settling_time_s"], abs=0.05)


# ---- what the digest says of the readings


def test_with_the_orbital_rate_in_the_law_q2_is_wrong_by_a_factor_of_two():
    assert fly_one(rate_used="orbital")["q2"] / -5.36e-3 == pytest.approx(2.08, abs=0.02)


def test_without_an_orbit_the_craft_comes_to_rest():
    row = fly_one(orbit_rate_rad_s=0.0)
    assert np.abs([row[f"omega_{axis}_rad_s"] for axis in "xyz"]).max() < 1e-4


def test_without_a_disturbance_the_modes_come_to_rest():
    row = fly_one(disturbance_amplitude_n_m=0.0)
    assert row["eta_norm"] < 1e-6


def test_the_end_of_the_modes_is_the_answer_to_the_wave_of_the_disturbance(nominal):
    """Mode 2 rings at 1 rad/s, as the disturbance does: half a period later its displacement is the opposite."""
    later = fly_one(duration_s=300.0 + np.pi)
    assert later["eta_2"] == pytest.approx(-nominal["eta_2"], rel=0.05)


# ---- the law along the way


def test_the_torque_never_asks_for_more_than_its_limit_and_keeps_its_direction(seen):
    asked = np.array([seen[f"command_{axis}_n_m"] for axis in "xyz"])
    assert np.linalg.norm(asked, axis=0).max() == pytest.approx(0.5, abs=1e-12)
    np.testing.assert_array_equal(asked, [seen[f"torque_{axis}_n_m"] for axis in "xyz"])


def test_the_first_command_is_that_of_equations_11_to_16(seen):
    """Nothing integrated yet, |w| = 0.0949 below the limit: X = -kd w - kp q_v, shortened to 0.5 N m."""
    x = -20.0 * np.array([0.07, -0.05, -0.04]) - 5.0 * np.array([0.2, 0.4, -0.8])
    first = [seen[f"command_{axis}_n_m"][0] for axis in "xyz"]
    np.testing.assert_allclose(first, 0.5 * x / np.linalg.norm(x), rtol=1e-12)


def test_above_the_rate_limit_the_law_brakes():
    """|w| = 0.12: kd ten times, kp a half, ki a fifth."""
    quick = {"initial_omega_x_rad_s": 0.12, "initial_omega_y_rad_s": 0.0, "initial_omega_z_rad_s": 0.0}
    first = history(**quick, torque_limit_n_m=100.0, duration_s=0.02)
    asked = [first[f"command_{axis}_n_m"][0] for axis in "xyz"]
    np.testing.assert_allclose(asked, [-200.0 * 0.12 - 2.5 * 0.2, -2.5 * 0.4, 2.5 * 0.8], rtol=1e-12)


def test_the_efforts_are_the_integrals_of_the_history(nominal, seen):
    t = seen["t_s"]
    torque = sum(np.abs(seen[f"torque_{axis}_n_m"]) for axis in "xyz")
    assert nominal["control_effort_n_m_s"] == pytest.approx(np.sum(torque[:-1] * np.diff(t)), rel=1e-9)
    attitude = sum(np.abs(seen[f"q{i}"]) for i in (1, 2, 3))
    assert nominal["attitude_effort_s"] == pytest.approx(np.trapezoid(attitude, t), rel=1e-6)
    assert nominal["scalar_effort_s"] == pytest.approx(np.trapezoid(np.abs(1.0 - seen["q0"]), t), rel=1e-6)


def test_peaks_and_last_times_are_those_of_the_history(nominal, seen):
    t = seen["t_s"]
    modes = np.max([np.abs(seen[f"eta_{i}"]) for i in (1, 2, 3, 4)], axis=0)
    assert nominal["peak_modal_displacement"] == pytest.approx(modes.max(), rel=1e-5)
    assert nominal["settling_time_s"] == pytest.approx(t[np.flatnonzero(1.0 - seen["q0"] > 1e-3)[-1]], abs=0.011)
    assert nominal["damping_time_s"] == pytest.approx(t[np.flatnonzero(modes > 0.005)[-1]], abs=0.011)
    rate = np.sqrt(sum(seen[f"omega_{axis}_rad_s"] ** 2 for axis in "xyz"))
    assert nominal["peak_rate_rad_s"] == rate.max()
    np.testing.assert_allclose(seen["rate_rad_s"], rate, rtol=1e-14)


def test_the_propellant_is_the_impulse_over_arm_and_exhaust_speed(nominal):
    assert nominal["propellant_kg"] == pytest.approx(
        nominal["control_effort_n_m_s"] / (0.5 * 220.0 * 9.80665), rel=1e-12
    )


def test_the_attitude_error_is_the_angle_of_the_quaternion(nominal):
    assert nominal["attitude_error_deg"] == pytest.approx(2.0 * np.degrees(np.arccos(nominal["q0"])), rel=1e-6)
    assert nominal["q_vector_norm"] == pytest.approx(np.sin(np.radians(nominal["attitude_error_deg"]) / 2.0), rel=1e-9)
