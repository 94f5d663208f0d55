"""What a push, the disturbance, the length of a flight and the noise of the sensors do."""

import numpy as np
import pytest
from flexible_flights import fly_cases, fly_one, history
from flexible_twin import C0

CALM = {"disturbance_amplitude_n_m": 0.0, "orbit_rate_rad_s": 0.0, "kd": 0.0, "ki": 0.0, "duration_s": 1.0}
CALM |= {f"initial_omega_{axis}_rad_s": 0.0 for axis in "xyz"}
AIMED = CALM | {"initial_q0": 1.0, "initial_q1": 0.0, "initial_q2": 0.0, "initial_q3": 0.0}


def off(axis, component):
    """At rest, this component of the attitude's vector part away from the target."""
    name = f"initial_q{'xyz'.index(axis) + 1}"
    return AIMED | {"initial_q0": np.sqrt(1.0 - component**2), name: component}


PUSH_X = off("x", -0.5)  # the torque limit's 0.5 N m
WAVE = AIMED | {"disturbance_amplitude_n_m": 0.1, "kp": 0.0}
WX, WY, WZ = "omega_x_rad_s", "omega_y_rad_s", "omega_z_rad_s"


def test_a_push_turns_the_body_that_gives_way_at_first_and_the_whole_one_in_the_end():
    """0.5 N m about x: (J - c0 c0^T)^-1 u in the first instant; with damped modes, J^-1 u on average."""
    first = fly_one(**PUSH_X | {"duration_s": 0.01, "step_s": 0.001, "steps_per_sample": 1.0})
    wanted = 0.005 * np.linalg.inv(np.diag([100.0, 75.0, 50.0]) - C0 @ C0.T)[:, 0]
    np.testing.assert_allclose([first[name] for name in (WX, WY, WZ)], wanted, rtol=1e-3)
    heavy = {"modal_damping_factor": 20.0, "kp": 0.5, "torque_limit_n_m": 0.01}
    last = fly_one(**PUSH_X | heavy | {"duration_s": 100.0})
    assert last[WX] == pytest.approx(0.01 * 100.0 / 100.0, rel=0.01)


def test_the_disturbance_is_one_torque_on_all_three_axes():
    """A sin(t) + A/2 on a craft that hardly moves: the momentum is its integral, the same in every component."""
    flown = fly_one(**WAVE | {"disturbance_amplitude_n_m": 1e-4, "duration_s": 2.0})
    wanted = 1e-4 * (1.0 - np.cos(2.0) + 0.5 * 2.0)
    np.testing.assert_allclose([flown[f"end_momentum_{axis}_n_m_s"] for axis in "xyz"], wanted, rtol=1e-4)


@pytest.mark.parametrize(("duration", "step", "end"), [(0.005, 0.01, 0.01), (1.0, 0.3, 1.2), (3.0, 0.01, 3.0)])
def test_a_flight_ends_with_the_step_that_reaches_its_length(duration, step, end):
    row = fly_one(duration_s=duration, step_s=step)
    assert row["end_time_s"] == pytest.approx(end, rel=1e-12)
    assert row["settling_time_s"] == row["end_time_s"]  # it has not settled


# ---- noise


@pytest.fixture(scope="module")
def noisy_commands():
    """Torques asked for in a minute, float64[3, 6001] each, under noise of the rate and under that of the attitude."""
    noises = {"kd": 20.0, "rate_noise_rad_s": 1e-6}, {"attitude_noise_rad": 1e-6}
    flights = (history(**AIMED | {"duration_s": 60.0} | noise) for noise in noises)
    return [np.array([seen[f"command_{axis}_n_m"] for axis in "xyz"]) for seen in flights]


def test_rate_noise_reaches_the_torque_through_its_gain_and_attitude_noise_as_half_its_angle(noisy_commands):
    by_rate, by_attitude = noisy_commands
    assert by_rate.std(axis=1) == pytest.approx([20.0 * 1e-6] * 3, rel=0.05)
    assert np.abs(by_rate.mean(axis=1)).max() < 4.0 * 20.0 * 1e-6 / np.sqrt(6000)
    assert by_attitude.std(axis=1) == pytest.approx([5.0 * 0.5e-6] * 3, rel=0.05)


def test_the_noise_of_the_three_axes_and_of_the_two_sensors_is_drawn_apart(noisy_commands):
    apart = np.corrcoef(np.concatenate(noisy_commands)) - np.eye(6)
    assert np.abs(apart).max() < 5.0 / np.sqrt(6000)


def test_every_case_draws_its_own_noise_and_the_same_one_again():
    noise = {"rate_noise_rad_s": np.full(9, 1e-4), "disturbance_draw": "sample", "duration_s": 20.0}
    one, again = fly_cases(**noise), fly_cases(**noise)
    np.testing.assert_array_equal(one["q1"], again["q1"])
    assert len(np.unique(one["q1"])) == 9


@pytest.mark.parametrize("offset", [0.5, 2.0])
def test_a_fresh_offset_is_uniform_within_a_half_of_the_one_given(offset):
    """Of sample means over 100 s the craft feels the sum: that of the offset, a spread of sqrt(1/12)."""
    n_cases = 200
    flown = fly_cases(
        **WAVE | {"disturbance_amplitude_n_m": 1e-5, "disturbance_frequency_rad_s": 0.0, "duration_s": 10.0},
        disturbance_draw="sample",
        disturbance_offset=np.full(n_cases, offset),
    )
    momentum = flown["end_momentum_x_n_m_s"] / 1e-5  # sum of 1000 draws times 0.01 s
    assert momentum.mean() == pytest.approx(10.0 * offset, abs=4.0 * np.sqrt(1000.0 / 12.0) * 0.01 / np.sqrt(n_cases))
    assert momentum.std() == pytest.approx(np.sqrt(1000.0 / 12.0) * 0.01, rel=0.2)
