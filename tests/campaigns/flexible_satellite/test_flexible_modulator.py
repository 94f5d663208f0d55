"""The pulse modulator: closed forms, the campaign's flight of them under a constant torque, and any held command."""

from collections import namedtuple

import numpy as np
import pytest
from flexible_flights import MODEL, NOMINAL, SEED, TABLE_8, fly_cases, fly_one, history
from scipy.integrate import solve_ivp

from mc_engine.flight.flight import fly
from mc_engine.physics.pulse_modulators import at_rest, sampled_pulses
from tests.campaigns.pulse_trains import dead_band, first_on_time, pause_time, pulse_time

GAIN, TAU, OFF, HYSTERESIS, LEVEL = 7.39, 0.713, 0.117, 0.225, 1.07  # Table 8
ON = OFF + HYSTERESIS
PULSE, PAUSE = 0.027103, 0.080803  # s, under a torque of 0.3, recomputed


# ---- the campaign under a constant torque

# a body too heavy to turn, 120 s, and an attitude that asks for r = kp q1 about x
HEAVY = TABLE_8 | {f"inertia_{axis}_kg_m2": 1e12 for axis in "xyz"} | {"kd": 0.0, "ki": 0.0, "duration_s": 120.0}
HEAVY |= {"disturbance_amplitude_n_m": 0.0, "orbit_rate_rad_s": 0.0, "initial_q2": 0.0, "initial_q3": 0.0}
HEAVY |= {f"initial_omega_{axis}_rad_s": 0.0 for axis in "xyz"}


def asking(r):
    """Inputs of a craft whose x axis asks for the torque r for ever."""
    q1 = -np.asarray(r) / 5.0
    return HEAVY | {"initial_q0": np.sqrt(1.0 - q1 * q1), "initial_q1": q1}


@pytest.mark.parametrize("period", [0.005, 0.02, 0.1])
def test_flown_pulses_and_pauses_are_those_of_the_closed_forms(period):
    """However coarse the samples: a command that is held has pulses known to the last digit."""
    row = fly_one(**asking(0.3), steps_per_sample=period / 0.005)
    pulses, t = row["pulse_count_x"], 120.0
    first = first_on_time(0.3, GAIN, TAU, ON)
    assert pulses == np.floor((t - first) / (PULSE + PAUSE)) + 1.0
    assert row["min_pulse_x_s"] == pytest.approx(PULSE, abs=1e-6)
    assert row["on_time_x_s"] / pulses == pytest.approx(PULSE, rel=1e-3)
    assert (t - first - row["on_time_x_s"]) / pulses == pytest.approx(PAUSE, rel=1e-3)


def test_flown_over_the_whole_range_the_closed_forms_hold():
    r = np.linspace(0.06, 0.49, 8)
    flown = fly_cases(**asking(r))
    pulses, pauses = pulse_time(r, GAIN, TAU, LEVEL, ON, OFF), pause_time(r, GAIN, TAU, ON, OFF)
    np.testing.assert_allclose(flown["min_pulse_x_s"], pulses, rtol=1e-7)  # the body turns by some nanoradians
    np.testing.assert_allclose(flown["on_time_x_s"] / flown["pulse_count_x"], pulses, rtol=1e-2)
    rest = 120.0 - first_on_time(r, GAIN, TAU, ON) - flown["on_time_x_s"]
    np.testing.assert_allclose(rest / flown["pulse_count_x"], pauses, rtol=1e-2)


def test_inside_the_dead_band_nothing_is_ever_fired():
    edge = dead_band(GAIN, ON)
    inside, outside = fly_cases(**asking(np.array([0.9999 * edge, 1.0001 * edge])))["pulse_count_x"]
    assert (inside, outside > 0.0) == (0.0, True)


def test_beyond_the_level_and_the_switch_off_the_thruster_fires_for_good():
    strong = asking(1.09) | {"torque_limit_n_m": 2.0}
    row = fly_one(**strong)
    assert row["pulse_count_x"] == 1.0
    assert np.isnan(row["min_pulse_x_s"])  # it has not ended
    assert row["on_time_x_s"] == pytest.approx(120.0 - first_on_time(1.09, GAIN, TAU, ON), abs=1e-9)


def test_a_torque_of_the_other_sign_fires_the_other_thrusters_alike():
    plus, minus = fly_cases(**asking(np.array([0.3, -0.3])))["impulse_x_n_m_s"]
    assert plus == minus > 0.0
    seen = history(**asking(-0.3))["torque_x_n_m"]
    assert seen.min() == -0.535
    assert seen.max() <= 0.0


# ---- valves that open and close late


@pytest.mark.parametrize("delay", [0.0025, 0.005, 0.008, 0.01])
def test_a_late_valve_moves_every_pulse_by_its_delay_and_keeps_its_impulse(delay):
    impulses, centres = [], []
    for seen in (history(**asking(0.3), valve_delay_s=d) for d in (0.0, delay)):
        length = np.diff(seen["t_s"])
        t, impulse = seen["t_s"][:-1] + 0.5 * length, seen["torque_x_n_m"][:-1] * length
        window = (t > 0.1) & (t < 0.3)  # two whole pulses, pauses about them
        impulses.append(impulse[window].sum())
        centres.append(np.sum(t[window] * impulse[window]) / impulses[-1])
    assert impulses[1] == pytest.approx(impulses[0], rel=1e-9)
    assert centres[1] - centres[0] == pytest.approx(delay, abs=1e-12)


def test_late_valves_do_not_change_what_the_modulator_counts():
    on_time, late = fly_one(**asking(0.3)), fly_one(**asking(0.3), valve_delay_s=0.008)
    assert late["pulse_count_x"] == on_time["pulse_count_x"]
    assert late["min_pulse_x_s"] == pytest.approx(on_time["min_pulse_x_s"], rel=1e-9)


# ---- any command that is held from sample to sample

Modulator = namedtuple("Modulator", "gain level on off time_constant decay")


def modulator(period):
    """The thrusters of Table 8 sampled with `period`."""
    return Modulator(GAIN, LEVEL, ON, OFF, TAU, np.exp(-period / TAU))


def followed(commands, period):
    """(lag, mean outputs, pulses, shortest): the lag integrated by SciPy from switch to switch."""
    f, y, means, begins, shortest, t = 0.0, 0.0, [], [], np.inf, 0.0
    for command in commands:
        left, fired = period, 0.0
        while left > 0.0:

            def rate(_, f, r=command, y=y):
                return (GAIN * (r - LEVEL * y) - f) / TAU

            events = [lambda _, f, y=y: y * f[0] - OFF] if y else [lambda _, f, s=s: s * f[0] - ON for s in (1, -1)]
            for event in events:
                event.terminal, event.direction = True, -1 if y else 1
            flight = solve_ivp(rate, (0.0, left), [f], "DOP853", events=events, rtol=1e-12, atol=1e-13)
            f, spent = flight.y[0, -1], flight.t[-1]
            left, t, fired = left - spent, t + spent, fired + y * spent
            if flight.status == 1:
                if y:
                    shortest = min(shortest, t - begins[-1])
                    y = 0.0
                else:
                    y = np.sign(f)
                    begins.append(t)
                left = 0.0 if left < 1e-13 else left
            else:
                left = 0.0
        means.append(fired / period)
    return f, np.array(means), len(begins), shortest


def wandering(n, seed):
    """Commands that wander from sample to sample, some of them beyond the level less the switch-off."""
    return np.clip(np.cumsum(np.random.default_rng([20221012, seed]).normal(0.0, 0.15, n)), -0.9, 0.9)


@pytest.mark.parametrize(
    ("period", "n"),
    [
        (0.005, 40),
        (0.03, 40),
        (0.2, 40),
        *(pytest.param(*more, marks=pytest.mark.slow) for more in ((0.5, 16), (2.0, 8))),
    ],
)
def test_under_any_held_command_the_samples_are_those_of_the_integrated_lag(period, n):
    """Up to 37 switches in a sample; each axis for itself."""
    commands = np.array([wandering(n, int(1000 * period)), wandering(n, 7), np.full(n, 0.53)])
    axes, means = [at_rest()] * 3, []
    for held in commands.T:
        *axes, x, y, z = sampled_pulses(*axes, *held, modulator(period), period)
        means.append((x, y, z))
    for axis, pulses in enumerate(axes):
        lag, wanted, count, shortest = followed(commands[axis], period)
        np.testing.assert_allclose(np.array(means)[:, axis], wanted, rtol=0.0, atol=1e-8)
        assert pulses.filtered == pytest.approx(lag, abs=1e-8)
        assert pulses.pulses == count
        assert pulses.shortest == pytest.approx(shortest, abs=1e-8)
    assert period < 0.01 or axes[2].pulses > 3


@pytest.mark.parametrize("period", [0.5, 1.0, 2.0])
def test_flown_with_samples_of_many_pulses_the_mean_output_is_that_of_the_closed_forms(period):
    row = fly_one(**asking(0.3), steps_per_sample=period / 0.005)
    assert row["pulse_count_x"] == np.floor((120.0 - first_on_time(0.3, GAIN, TAU, ON)) / (PULSE + PAUSE)) + 1.0
    assert LEVEL * row["on_time_x_s"] / 120.0 == pytest.approx(0.26875, rel=0.002)
    assert row["min_pulse_x_s"] == pytest.approx(PULSE, abs=1e-6)


def test_cases_with_many_pulses_in_a_sample_have_the_same_bits_alone_and_among_others():
    """Their neighbours have none, one or some."""
    inputs = asking(np.array([0.0, 0.05, 0.1, 0.2, 0.3, 0.45, 0.49, -0.4])) | {"steps_per_sample": 100.0}
    together = fly_cases(**inputs)
    assert set(np.sign(together["pulse_count_x"] - 100.0)) == {-1.0, 1.0}
    alone = fly(MODEL, NOMINAL | inputs, np.arange(8), SEED, width=1)
    for name in ("impulse_x_n_m_s", "pulse_count_x", "min_pulse_x_s", "q1"):
        np.testing.assert_array_equal(alone[name], together[name])


def test_the_fastest_modulator_of_table_2_flies_alike_with_steps_of_5_ms_and_of_a_half():
    """Pulses and pauses of a millisecond: settled after 153 s with 121 s of attitude error, whatever the sample."""
    fastest = {
        "pwpf_gain": 10.0, "pwpf_time_constant_s": 0.05, "pwpf_u_off": 0.05, "pwpf_hysteresis": 0.05,
        "thrust_level": 2.0,
    }  # fmt: skip
    coarse, fine = (fly_one(**TABLE_8 | fastest | {"step_s": step}) for step in (0.005, 0.0005))
    for name, share in (("settling_time_s", 0.002), ("attitude_effort_s", 0.002), ("control_effort_n_m_s", 0.005)):
        assert coarse[name] == pytest.approx(fine[name], rel=share)
    assert coarse["settling_time_s"] == pytest.approx(153.4, abs=0.5)
