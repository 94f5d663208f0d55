"""The compiled flight against a slow one that is written apart: matrices, SciPy's steps, pulses as lists of times."""

import numpy as np
import pytest
from flexible_flights import MODEL, NOMINAL, PWPF, SEED, TABLE_8, fly_one
from flexible_twin import fly_twin

from mc_engine.flight.flight import fly, fly_history, prepare
from mc_engine.flight.kernel_parts import settings_class
from mc_engine.lanes.philox import Draws, noise_key

# both fly the same samples; what is left is that of Runge-Kutta steps of 10 ms, and trapezoids of |q| at their corners
TOLERANCE = {"q": 5e-11, "omega": 2e-10, "eta": 3e-9, "end_momentum": 5e-9, "impulse": 5e-9, "control_effort": 1e-8}
TOLERANCE |= {"attitude_effort": 5e-4, "propellant": 2e-11, "pulse_count": 0.0, "min_pulse": 1e-11}
SLOW_SAMPLES = {"duration_s": 40.0, "step_s": 0.01, "steps_per_sample": 10.0}
PULSED = PWPF | {"duration_s": 8.0, "steps_per_sample": 2.0}


def tolerance_of(name):
    return next(gap for start, gap in TOLERANCE.items() if name.startswith(start))


def gaps(case):
    """What lies outside its tolerance: {column: (flown, wanted)}."""
    flown, wanted = fly_one(**case), fly_twin(NOMINAL | case)
    assert flown["status"] == "ok"
    inside = {
        name: abs(flown[name] - value) <= tolerance_of(name) or (np.isnan(value) and np.isnan(flown[name]))
        for name, value in wanted.items()
    }
    return {name: (flown[name], wanted[name]) for name, good in inside.items() if not good}


def random_case(number):
    """A case in which everything is off: structure, start, orbit, disturbance, law, thrusters."""
    draw = np.random.default_rng([SEED, number])
    case = {f"inertia_{axis}_factor": draw.uniform(0.9, 1.1) for axis in "xyz"}
    case |= {f"inertia_{pair}_kg_m2": draw.uniform(-3.0, 3.0) for pair in ("xy", "xz", "yz")}
    case |= {
        f"modal_frequency_{k}_rad_s": NOMINAL[f"modal_frequency_{k}_rad_s"] * draw.uniform(0.9, 1.1)
        for k in (1, 2, 3, 4)
    }
    case |= {f"modal_damping_{k}": draw.uniform(0.002, 0.03) for k in (1, 2, 3, 4)}
    for name, low, high in [
        ("modal_frequency_factor", 0.9, 1.1), ("modal_damping_factor", 0.5, 2.0), ("coupling_factor", 0.8, 1.1),
        ("orbit_rate_rad_s", 5e-4, 2e-3), ("disturbance_amplitude_n_m", 0.0, 1e-2),
        ("disturbance_frequency_rad_s", 0.2, 2.0), ("disturbance_offset", 0.0, 1.0),
        ("kp", 3.0, 7.0), ("kd", 15.0, 30.0), ("ki", 0.0, 0.3),
        ("integral_rate_gain", 0.0, 0.05), ("integral_attitude_gain_1_s", 0.0, 0.02), ("integral_gamma", 0.5, 1.5),
        ("torque_limit_n_m", 0.3, 1.0), ("rate_limit_rad_s", 0.02, 0.2), ("dbar_n_m", 0.0, 1e-3),
        ("switching_rate_gain", 0.0, 0.1), ("switching_attitude_gain_1_s", 0.0, 0.1),
        ("thrust_level", 0.8, 1.2), ("valve_delay_s", 0.0, 0.02), ("arm_m", 0.3, 0.7), ("isp_s", 150.0, 250.0),
        ("delta_p", 1.5, 3.0), ("delta_i", 3.0, 8.0), ("delta_d", 5.0, 12.0),
        ("pwpf_gain", 6.0, 9.0), ("pwpf_time_constant_s", 0.5, 0.9), ("pwpf_u_off", 0.1, 0.15),
        ("pwpf_hysteresis", 0.2, 0.3),
    ]:  # fmt: skip
        case[name] = draw.uniform(low, high)
    case |= {f"initial_q{k}": value for k, value in enumerate(draw.normal(size=4))}
    for axis in "xyz":
        case[f"initial_attitude_error_{axis}_deg"] = draw.uniform(-5.0, 5.0)
        case[f"initial_omega_{axis}_rad_s"] = draw.uniform(-0.08, 0.08)
        case[f"thrust_{axis}_factor"] = draw.uniform(0.9, 1.1)
        case[f"misalignment_{axis}_deg"] = draw.uniform(-3.0, 3.0)
    return case | {"rate_used": ["inertial", "orbital"][number % 2], "pwpf_pairing": "ABC"[number % 3]}


@pytest.mark.parametrize("number", [0, 1, *(pytest.param(number, marks=pytest.mark.slow) for number in (2, 3))])
def test_a_random_case_with_an_ideal_actuator_flies_like_its_slow_twin(number):
    assert gaps(random_case(number) | SLOW_SAMPLES) == {}


@pytest.mark.parametrize("number", range(4, 7))
def test_a_random_case_with_thrusters_flies_like_its_slow_twin(number):
    assert gaps(random_case(number) | PULSED) == {}


def test_samples_of_50_ms_hold_several_switches_and_are_still_exact():
    assert gaps(TABLE_8 | {"duration_s": 15.0, "step_s": 0.01, "steps_per_sample": 5.0}) == {}


def test_pulses_may_act_as_their_mean_over_a_sample():
    """The twin lets them act when they fire: the modes, of 2.4 s and longer, do not feel the difference."""
    case = TABLE_8 | {"duration_s": 8.0}
    flown, wanted = fly_one(**case), fly_twin(NOMINAL | case, averaged=False)
    assert abs(flown["q3"] - wanted["q3"]) < 1e-5
    assert abs(flown["omega_z_rad_s"] - wanted["omega_z_rad_s"]) < 1e-5
    assert abs(flown["eta_1"] - wanted["eta_1"]) < 1e-4
    assert flown["control_effort_n_m_s"] == pytest.approx(wanted["control_effort_n_m_s"], rel=1e-3)


def test_every_width_of_the_build_has_the_bits_of_the_others():
    case = NOMINAL | random_case(4) | PULSED | {"rate_noise_rad_s": 1e-4, "disturbance_draw": "sample"}
    wide, alone = (fly(MODEL, case, np.array([17]), SEED, width=width) for width in (None, 1))
    for name, column in wide.items():
        np.testing.assert_array_equal(column, alone[name], err_msg=name)


def test_a_case_has_the_same_bits_among_others_of_every_kind():
    """Noise, late valves and the switching torque are skipped where no case of a block has them."""
    mixed = {
        "rate_noise_rad_s": np.array([0.0, 1e-4, 0.0, 0.0]),
        "valve_delay_s": np.array([0.0, 0.0, 0.007, 0.0]),
        "dbar_n_m": np.array([0.0, 0.0, 0.0, 1e-3]),
    }
    together = fly(MODEL, NOMINAL | PULSED | mixed, np.arange(4), SEED)
    for case in range(4):
        own = {name: column[case] for name, column in mixed.items()}
        alone = fly(MODEL, NOMINAL | PULSED | own, np.array([case]), SEED)
        for name, column in alone.items():
            np.testing.assert_array_equal(together[name][case], column[0], err_msg=name)


@pytest.mark.parametrize("actuator", ["ideal", "pwpf"])
def test_the_interpreted_control_gives_the_bits_of_the_compiled_one(actuator):
    case = random_case(5) | PULSED | {"actuator": actuator, "rate_noise_rad_s": 1e-4, "attitude_noise_rad": 1e-3}
    seen = fly_history(MODEL, NOMINAL | case, 0, SEED)[1]
    ready = prepare(MODEL, NOMINAL | case, 1)
    p = MODEL.kernel_parameters(*(float(row[0]) for row in ready.parameters))
    o = settings_class(MODEL)(*ready.settings[0])
    state, memory = MODEL.initial(p, o), MODEL.start(p, o)
    memory = MODEL.control(0.0, state, memory, p, o, Draws(noise_key(SEED), 0.0, 0.0))
    quantities = MODEL.observe(0.0, state, memory, p, o)
    for field, value in zip(MODEL.quantities, quantities, strict=True):
        assert value / field.si_factor == seen[field.name][0], field.name
