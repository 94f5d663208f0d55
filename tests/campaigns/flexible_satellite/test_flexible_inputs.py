"""Every input does what its name says: sign of each effect, on a craft at rest that is pushed for a second."""

import numpy as np
import pytest
from flexible_flights import C0, MODEL, TABLE_8, fly_cases, fly_one, history

CALM = {"disturbance_amplitude_n_m": 0.0, "orbit_rate_rad_s": 0.0, "kd": 0.0, "ki": 0.0, "duration_s": 1.0}
CALM |= {f"initial_omega_{axis}_rad_s": 0.0 for axis in "xyz"}
AIMED = CALM | {"initial_q0": 1.0, "initial_q1": 0.0, "initial_q2": 0.0, "initial_q3": 0.0}


def off(axis, component):
    """At rest, this component of the attitude's vector part away from the target."""
    name = f"initial_q{'xyz'.index(axis) + 1}"
    return AIMED | {"initial_q0": np.sqrt(1.0 - component**2), name: component}


# the torque limit's 0.5 N m along an axis; a quarter of a newton metre about x
PUSH_X, PUSH_Y, PUSH_Z = off("x", -0.5), off("y", -0.5), off("z", -0.5)
NUDGE = off("x", -0.05)
SPIN = AIMED | {"initial_omega_x_rad_s": 0.01}
FAST = NUDGE | {"initial_omega_y_rad_s": 0.2, "torque_limit_n_m": 100.0}  # above the rate limit
SWITCHED = NUDGE | {"kp": 0.0, "dbar_n_m": 0.01}
WAVE = AIMED | {"disturbance_amplitude_n_m": 0.1, "kp": 0.0}
PULSED = TABLE_8 | off("x", -0.06) | {"inertia_x_kg_m2": 1e9, "inertia_y_kg_m2": 1e9, "inertia_z_kg_m2": 1e9}
PULSED |= {"duration_s": 60.0}  # 0.3 N m for ever
WX, WY, WZ, PROPELLANT = "omega_x_rad_s", "omega_y_rad_s", "omega_z_rad_s", "propellant_kg"

# parameter, from, to, what else, column, its sign of change, why
EFFECTS = [
    ("inertia_x_kg_m2", 100.0, 110.0, PUSH_X, WX, -1, "a heavier body turns more slowly"),
    ("inertia_y_kg_m2", 75.0, 80.0, PUSH_Y, WY, -1, "a heavier body turns more slowly"),
    ("inertia_z_kg_m2", 50.0, 55.0, PUSH_Z, WZ, -1, "a heavier body turns more slowly"),
    ("inertia_xy_kg_m2", 0.0, 3.0, PUSH_X, WY, -1, "a push about x turns it about y the other way"),
    ("inertia_xz_kg_m2", 0.0, 3.0, PUSH_X, WZ, -1, "a push about x turns it about z the other way"),
    ("inertia_yz_kg_m2", 0.0, 3.0, PUSH_Y, WZ, -1, "a push about y turns it about z the other way"),
    ("inertia_x_factor", 1.0, 1.1, PUSH_X, WX, -1, "a heavier body turns more slowly"),
    ("inertia_y_factor", 1.0, 1.1, PUSH_Y, WY, -1, "a heavier body turns more slowly"),
    ("inertia_z_factor", 1.0, 1.1, PUSH_Z, WZ, -1, "a heavier body turns more slowly"),
    ("modal_frequency_1_rad_s", 0.7, 0.8, PUSH_X, "eta_1", +1, "a stiffer mode stays behind less"),
    ("modal_frequency_2_rad_s", 1.0, 1.1, PUSH_X, "eta_2", -1, "and so does one that leans the other way"),
    ("modal_frequency_3_rad_s", 1.8, 2.0, PUSH_X, "eta_3", +1, "a stiffer mode stays behind less"),
    ("modal_frequency_4_rad_s", 2.5, 2.7, PUSH_X, "eta_4", +1, "a stiffer mode stays behind less"),
    ("modal_damping_1", 0.0056, 0.02, PUSH_X, "eta_1", +1, "a damped mode moves less"),
    ("modal_damping_2", 0.0086, 0.02, PUSH_X, "eta_2", -1, "and so does one that leans the other way"),
    ("modal_damping_3", 0.0128, 0.02, PUSH_X, "eta_3", +1, "a damped mode moves less"),
    ("modal_damping_4", 0.0252, 0.04, PUSH_X, "eta_4", +1, "a damped mode moves less"),
    ("modal_frequency_factor", 1.0, 1.1, PUSH_X, "eta_1", +1, "stiffer modes stay behind less"),
    ("modal_damping_factor", 1.0, 3.0, PUSH_X, "eta_1", +1, "damped modes move less"),
    ("coupling_factor", 1.0, 1.05, PUSH_X, "eta_1", -1, "more coupling leaves the modes further behind"),
    ("initial_q0", 0.4, 0.5, CALM, "q0", +1, "the first attitude is the one given"),
    ("initial_q1", 0.2, 0.3, CALM, "q1", +1, "the first attitude is the one given"),
    ("initial_q2", 0.4, 0.5, CALM, "q2", +1, "the first attitude is the one given"),
    ("initial_q3", -0.8, -0.7, CALM, "q3", +1, "the first attitude is the one given"),
    ("initial_attitude_error_x_deg", 0.0, 1.0, AIMED, "q1", +1, "an error about x shows in q1"),
    ("initial_attitude_error_y_deg", 0.0, 1.0, AIMED, "q2", +1, "an error about y shows in q2"),
    ("initial_attitude_error_z_deg", 0.0, 1.0, AIMED, "q3", +1, "an error about z shows in q3"),
    ("initial_omega_x_rad_s", 0.0, 0.01, AIMED, WX, +1, "the first rate is the one given"),
    ("initial_omega_y_rad_s", 0.0, 0.01, AIMED, WY, +1, "the first rate is the one given"),
    ("initial_omega_z_rad_s", 0.0, 0.01, AIMED, WZ, +1, "the first rate is the one given"),
    ("orbit_rate_rad_s", 0.0, 1e-3, AIMED, "q2", +1, "the orbital frame turns away about -y"),
    ("disturbance_amplitude_n_m", 0.1, 0.2, WAVE, WX, +1, "a stronger disturbance pushes more"),
    ("disturbance_frequency_rad_s", 1.0, 2.0, WAVE, WX, +1, "a faster wave has risen further after a second"),
    ("disturbance_offset", 0.5, 1.0, WAVE, WX, +1, "a constant part pushes all the time"),
    ("rate_noise_rad_s", 0.0, 1e-4, AIMED | {"kd": 20.0}, "control_effort_n_m_s", +1, "chasing noise costs impulse"),
    ("attitude_noise_rad", 0.0, 1e-3, AIMED, "control_effort_n_m_s", +1, "chasing noise costs impulse"),
    ("kp", 5.0, 6.0, NUDGE, WX, +1, "a stiffer law turns faster towards the target"),
    ("kd", 0.0, 20.0, SPIN, WX, -1, "the law brakes"),
    ("ki", 0.0, 1.0, NUDGE, WX, +1, "the integral helps to turn"),
    ("integral_rate_gain", 0.025, 0.1, SPIN | {"ki": 10.0}, WX, -1, "an integrated rate brakes"),
    ("integral_attitude_gain_1_s", 0.005, 0.01, NUDGE | {"ki": 10.0}, WX, +1, "an integrated error pushes"),
    ("integral_gamma", 0.5, 1.5, NUDGE | {"ki": 10.0}, WX, +1, "what is taken off rises with the way made"),
    ("torque_limit_n_m", 0.5, 0.6, PUSH_X, WX, +1, "a higher limit turns faster"),
    ("rate_limit_rad_s", 0.1, 0.11, {}, "peak_rate_rad_s", +1, "the craft may turn faster"),
    ("delta_p", 2.0, 3.0, FAST, WX, -1, "above the limit the attitude counts less"),
    ("delta_i", 5.0, 8.0, FAST | {"ki": 100.0, "integral_rate_gain": 0.0}, WX, -1, "and its integral"),
    ("delta_d", 10.0, 12.0, FAST | {"kd": 1.0}, WY, -1, "and the rate more"),
    ("dbar_n_m", 0.0, 0.01, SPIN, WX, -1, "the switching torque opposes the motion"),
    ("switching_rate_gain", 0.05, 0.1, SWITCHED | {"initial_omega_x_rad_s": 0.008}, WX, -1, "where the rate decides"),
    ("switching_attitude_gain_1_s", 0.01, 0.02, SWITCHED | {"initial_omega_x_rad_s": 0.012}, WX, +1, "or the attitude"),
    ("pwpf_gain", 7.39, 8.0, PULSED, "pulse_count", +1, "a steeper modulator fires more often"),
    ("pwpf_time_constant_s", 0.713, 0.8, PULSED, "min_pulse_s", +1, "a slower one longer"),
    ("pwpf_u_off", 0.117, 0.13, PULSED, "on_time_x_s", -1, "higher thresholds fire less"),
    ("pwpf_hysteresis", 0.225, 0.25, PULSED, "min_pulse_s", +1, "wider thresholds fire longer"),
    ("thrust_level", 1.07, 1.2, PULSED, "on_time_x_s", -1, "stronger thrusters need less time"),
    ("thrust_x_factor", 1.0, 1.1, PUSH_X, WX, +1, "more torque than asked for turns faster"),
    ("thrust_y_factor", 1.0, 1.1, PUSH_Y, WY, +1, "more torque than asked for turns faster"),
    ("thrust_z_factor", 1.0, 1.1, PUSH_Z, WZ, +1, "more torque than asked for turns faster"),
    ("misalignment_x_deg", 0.0, 1.0, PUSH_Y, WZ, +1, "turned about x, y thrusters push about z too"),
    ("misalignment_y_deg", 0.0, 1.0, PUSH_Z, WX, +1, "turned about y, z thrusters push about x too"),
    ("misalignment_z_deg", 0.0, 1.0, PUSH_X, WY, +1, "turned about z, x thrusters push about y too"),
    ("valve_delay_s", 0.0, 0.008, TABLE_8 | PUSH_X, WX, -1, "late thrust turns it later"),
    ("arm_m", 0.5, 0.6, PUSH_X, PROPELLANT, -1, "a longer arm needs less propellant"),
    ("isp_s", 220.0, 240.0, PUSH_X, PROPELLANT, -1, "and so does a better thruster"),
]


@pytest.mark.parametrize(
    ("name", "before", "after", "others", "column", "sign"),
    [effect[:6] for effect in EFFECTS],
    ids=[f"{effect[0]}: {effect[6]}" for effect in EFFECTS],
)
def test_each_parameter_acts_in_its_direction(name, before, after, others, column, sign):
    first, then = (fly_one(**others | {name: value}) for value in (before, after))
    assert (first["status"], then["status"]) == ("ok", "ok")
    change = then[column] - first[column]
    # far above rounding, so that the sign is physics
    assert sign * change > 1e-4 * abs(first[column])
    assert abs(change) > 1e-9


def test_no_parameter_is_without_a_tested_effect():
    assert [effect[0] for effect in EFFECTS] == [parameter.name for parameter in MODEL.parameters]


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


def test_rate_noise_reaches_the_torque_through_the_gain_on_the_rate():
    seen = history(**AIMED | {"kd": 20.0, "duration_s": 60.0, "rate_noise_rad_s": 1e-6})
    for axis in "xyz":
        assert seen[f"command_{axis}_n_m"].std() == pytest.approx(20.0 * 1e-6, rel=0.05)
        assert abs(seen[f"command_{axis}_n_m"].mean()) < 4.0 * 20.0 * 1e-6 / np.sqrt(6000)


def test_attitude_noise_reaches_the_torque_as_half_its_angle():
    seen = history(**AIMED | {"duration_s": 60.0, "attitude_noise_rad": 1e-6})
    for axis in "xyz":
        assert seen[f"command_{axis}_n_m"].std() == pytest.approx(5.0 * 0.5e-6, rel=0.05)


def test_the_noise_of_the_three_axes_and_of_the_two_sensors_is_drawn_apart():
    noise = {"kd": 20.0, "rate_noise_rad_s": 1e-6, "duration_s": 60.0}
    rate = history(**AIMED | noise)
    attitude = history(**AIMED | {"duration_s": 60.0, "attitude_noise_rad": 1e-6})
    rows = [seen[f"command_{axis}_n_m"] for seen in (rate, attitude) for axis in "xyz"]
    apart = np.corrcoef(rows) - np.eye(6)
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
