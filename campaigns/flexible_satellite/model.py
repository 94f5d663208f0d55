"""The flexible-satellite model as the engine sees it: inputs, settings, each case's matrices, and the MODEL record."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from campaigns.flexible_satellite import control, dynamics, figures, outcome, structure
from mc_engine.model import Field, FixedStep, Model, Parameter, Refusals, Setting
from mc_engine.physics.attitude import body_matrix, quaternion_product, rotation_quaternion
from mc_engine.physics.constants import STANDARD_GRAVITY
from mc_engine.studies.published import read_published

SOURCE = (
    "H. Taei, S. Ayati, S. F. Mousavi, Robust PID control of a flexible satellite considering thruster actuator "
    "dynamics (in Persian), Iranian Journal of Mechanical Engineering 24(3), 2022, doi 10.30506/IJMEP.2022.525295.1770"
)
AXES, MODES = "xyz", (1, 2, 3, 4)
LONGEST_DELAY = 2  # samples that the control remembers
_NOT_ZERO = 1e-9

_CRAFT = (
    Parameter("inertia_x_kg_m2", "kg m^2", "moment of inertia about x", 100.0, low=0.0),
    Parameter("inertia_y_kg_m2", "kg m^2", "moment of inertia about y", 75.0, low=0.0),
    Parameter("inertia_z_kg_m2", "kg m^2", "moment of inertia about z", 50.0, low=0.0),
    Parameter("inertia_xy_kg_m2", "kg m^2", "entry xy of the inertia matrix: minus the product of inertia", 0.0),
    Parameter("inertia_xz_kg_m2", "kg m^2", "entry xz of the inertia matrix: minus the product of inertia", 0.0),
    Parameter("inertia_yz_kg_m2", "kg m^2", "entry yz of the inertia matrix: minus the product of inertia", 0.0),
    Parameter("inertia_x_factor", "", "true over assumed moment of inertia about x", 1.0, low=0.0),
    Parameter("inertia_y_factor", "", "true over assumed moment of inertia about y", 1.0, low=0.0),
    Parameter("inertia_z_factor", "", "true over assumed moment of inertia about z", 1.0, low=0.0),
    Parameter("modal_frequency_1_rad_s", "rad/s", "frequency of mode 1 on a body that is held", 0.7, low=0.0),
    Parameter("modal_frequency_2_rad_s", "rad/s", "frequency of mode 2 on a body that is held", 1.0, low=0.0),
    Parameter("modal_frequency_3_rad_s", "rad/s", "frequency of mode 3 on a body that is held", 1.8, low=0.0),
    Parameter("modal_frequency_4_rad_s", "rad/s", "frequency of mode 4 on a body that is held", 2.5, low=0.0),
    Parameter("modal_damping_1", "", "damping ratio of mode 1", 0.0056, low=0.0),
    Parameter("modal_damping_2", "", "damping ratio of mode 2", 0.0086, low=0.0),
    Parameter("modal_damping_3", "", "damping ratio of mode 3", 0.0128, low=0.0),
    Parameter("modal_damping_4", "", "damping ratio of mode 4", 0.0252, low=0.0),
    Parameter("modal_frequency_factor", "", "true over assumed frequency, all modes", 1.0, low=0.0),
    Parameter("modal_damping_factor", "", "true over assumed damping ratio, all modes", 1.0, low=0.0),
    Parameter("coupling_factor", "", "true over assumed coupling matrix c0 of modes and rotation", 1.0),
)
_FLIGHT = (
    Parameter("initial_q0", "", "scalar part of the first attitude in the orbital frame", 0.4),
    Parameter("initial_q1", "", "first component of its vector part", 0.2),
    Parameter("initial_q2", "", "second component of its vector part", 0.4),
    Parameter("initial_q3", "", "third component of its vector part", -0.8),
    Parameter("initial_attitude_error_x_deg", "deg", "further rotation of the first attitude, about body x", 0.0),
    Parameter("initial_attitude_error_y_deg", "deg", "further rotation of the first attitude, about body y", 0.0),
    Parameter("initial_attitude_error_z_deg", "deg", "further rotation of the first attitude, about body z", 0.0),
    Parameter("initial_omega_x_rad_s", "rad/s", "first inertial body rate about x", 0.07),
    Parameter("initial_omega_y_rad_s", "rad/s", "first inertial body rate about y", -0.05),
    Parameter("initial_omega_z_rad_s", "rad/s", "first inertial body rate about z", -0.04),
    Parameter("orbit_rate_rad_s", "rad/s", "rate of the circular orbit", 1.078e-3),
    # 5 sqrt(3)/3 1e-4 (sin t + rand) N m, the same about every axis
    Parameter("disturbance_amplitude_n_m", "N m", "amplitude of the disturbing torque", 5e-4 / np.sqrt(3.0)),
    Parameter("disturbance_frequency_rad_s", "rad/s", "frequency of its wave", 1.0),
    Parameter("disturbance_offset", "", "its constant part, in amplitudes: the source's rand", 0.5),
    Parameter("rate_noise_rad_s", "rad/s", "1-sigma of a fresh error on each measured rate", 0.0, low=0.0),
    Parameter(
        "attitude_noise_rad", "rad", "1-sigma of a fresh error of the measured attitude about each axis", 0.0, 0.0
    ),
)
_LAW = (
    Parameter("kp", "", "gain on the vector part of the attitude, N m", 5.0),
    Parameter("kd", "", "gain on the rate, N m s", 20.0),
    Parameter("ki", "", "gain on the integral, N m", 0.1),
    Parameter("integral_rate_gain", "", "c1: share of the rate in the integrand", 0.025),
    Parameter("integral_attitude_gain_1_s", "1/s", "c2: share of the attitude in the integrand", 0.005),
    Parameter("integral_gamma", "", "multiple of qv - qv(0) that is taken off the integral", 1.5),
    Parameter("torque_limit_n_m", "N m", "largest torque that the PID part may ask for", 0.5, low=0.0),
    Parameter("rate_limit_rad_s", "rad/s", "rate from which on the law brakes", 0.1, low=0.0),
    Parameter("delta_p", "", "divides kp above the rate limit", 2.0, low=_NOT_ZERO),
    Parameter("delta_i", "", "divides ki above the rate limit", 5.0, low=_NOT_ZERO),
    Parameter("delta_d", "", "multiplies kd above the rate limit", 10.0, low=0.0),
    Parameter("dbar_n_m", "N m", "size of the switching torque against disturbances", 0.0, low=0.0),
    Parameter("switching_rate_gain", "", "beta: weight of the rate in the switching torque's sign", 0.05),
    Parameter("switching_attitude_gain_1_s", "1/s", "lambda2: weight of the attitude in that sign", 0.01),
)
_THRUSTERS = (
    Parameter("pwpf_gain", "", "K_m: gain of the modulator", 7.39, low=_NOT_ZERO),
    Parameter("pwpf_time_constant_s", "s", "T_m: time constant of the modulator's lag", 0.713, low=1e-4),
    Parameter("pwpf_u_off", "", "U_off: lag output at which a pulse ends", 0.117, low=0.0),
    Parameter("pwpf_hysteresis", "", "h: U_on - U_off", 0.225, low=_NOT_ZERO),
    Parameter("thrust_level", "", "T: thrust level, N; pwpf_pairing says what follows from it", 1.07, low=_NOT_ZERO),
    Parameter("thrust_x_factor", "", "true over commanded torque of the x actuator", 1.0, low=0.0),
    Parameter("thrust_y_factor", "", "true over commanded torque of the y actuator", 1.0, low=0.0),
    Parameter("thrust_z_factor", "", "true over commanded torque of the z actuator", 1.0, low=0.0),
    Parameter("misalignment_x_deg", "deg", "rotation of the actuators' axes about body x", 0.0),
    Parameter("misalignment_y_deg", "deg", "rotation of the actuators' axes about body y", 0.0),
    Parameter("misalignment_z_deg", "deg", "rotation of the actuators' axes about body z", 0.0),
    Parameter("valve_delay_s", "s", "time by which thrust follows the modulator, at opening and closing", 0.0, low=0.0),
    Parameter("arm_m", "m", "arm of the thrusters, for the propellant", 0.5, low=1e-6),
    Parameter("isp_s", "s", "specific impulse of the thrusters, for the propellant", 220.0, low=1e-3),
)
PARAMETERS = (*_CRAFT, *_FLIGHT, *_LAW, *_THRUSTERS)
SETTINGS = (
    Setting("actuator", "", "what turns command into torque", "ideal", ("ideal", "pwpf")),
    Setting(
        "pwpf_pairing",
        "",
        "level in the modulator, torque on the body: A is T, T; B is T, T/2; C is T/2, T/2",
        "B",
        ("A", "B", "C"),
    ),
    Setting("rate_used", "", "rate that the law works with", "inertial", ("inertial", "orbital")),
    Setting(
        "disturbance_draw",
        "",
        "disturbance_offset holds all the run, or every sample draws afresh, uniform within 0.5 of it",
        "run",
        ("run", "sample"),
    ),
    Setting(
        "duration_s", "s", "length of the flight, up to the end of the step that reaches it", 300.0, low=1e-3, high=1e6
    ),
    Setting("step_s", "s", "integration step", 0.01, low=1e-4, high=1.0),
    Setting(
        "steps_per_sample", "", "integration steps from one sample of the control to the next", 1.0, low=1, high=1e6
    ),
)
STATES = (
    *(Field(f"q{i}", "", f"attitude in the orbital frame, component {i}, scalar first") for i in (0, 1, 2, 3)),
    *(Field(f"momentum_{axis}_n_m_s", "N m s", f"total angular momentum along body {axis}") for axis in AXES),
    *(Field(f"modal_momentum_{i}", "", f"momentum of mode {i}, kg^(1/2) m/s") for i in MODES),
    *(Field(f"eta_{i}", "", f"displacement of mode {i}, kg^(1/2) m") for i in MODES),
    *(Field(f"impulse_{axis}_n_m_s", "N m s", f"impulse of the {axis} actuator so far") for axis in AXES),
    Field("attitude_effort_s", "s", "integral of |q1| + |q2| + |q3| so far"),
    Field("scalar_effort_s", "s", "integral of |1 - q0| so far"),
)


def prepare(inputs: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> dict[str, np.ndarray]:
    """Kernel parameters of each case: matrices inverted, first state, gains, thrusters.

    inputs : float64[n] by symbol, SI;  settings : codes, float64[n], by symbol.  Refused cases join `refusals`.
    """
    i = inputs
    coupling = i.coupling_factor[:, None, None] * structure.COUPLING
    inertia = structure.inertia_matrix(
        i.inertia_x * i.inertia_x_factor,
        i.inertia_y * i.inertia_y_factor,
        i.inertia_z * i.inertia_z_factor,
        i.inertia_xy,
        i.inertia_xz,
        i.inertia_yz,
    )
    inverse = structure.refuse_unphysical(inertia, coupling, refusals)
    rows = {f"m{AXES[a]}{AXES[b]}": inverse[:, a, b] for a in range(3) for b in range(a, 3)}
    rows |= {f"c{AXES[a]}{mode}": coupling[:, a, mode - 1] for a in range(3) for mode in MODES}
    b = inverse @ coupling
    rows |= {f"b{AXES[a]}{mode}": b[:, a, mode - 1] for a in range(3) for mode in MODES}
    rows |= _first_state(i, inertia, coupling, refusals)
    for mode in MODES:
        frequency = getattr(i, f"modal_frequency_{mode}") * i.modal_frequency_factor
        damping = getattr(i, f"modal_damping_{mode}") * i.modal_damping_factor
        rows |= {f"k{mode}": frequency * frequency, f"d{mode}": 2.0 * damping * frequency}
    return rows | _law_rows(i) | _thruster_rows(i, settings, refusals)


def _first_state(i: SimpleNamespace, inertia, coupling, refusals: Refusals) -> dict[str, np.ndarray]:
    """Attitude, angular momentum J w [N m s] and modal momenta c0^T w [kg^(1/2) m/s]; the modes rest in the body."""
    q = np.array([i.initial_q0, i.initial_q1, i.initial_q2, i.initial_q3])
    size = np.sqrt((q * q).sum(axis=0))
    refusals.add(~(size > 0.0), "the first quaternion is zero")
    errors = np.array([i.initial_attitude_error_x, i.initial_attitude_error_y, i.initial_attitude_error_z])
    q = quaternion_product(q / size, rotation_quaternion(errors))
    w = np.array([i.initial_omega_x, i.initial_omega_y, i.initial_omega_z])
    h = np.einsum("nab,bn->an", inertia, w)
    psi = np.einsum("nam,an->mn", coupling, w)
    names = (*(f"q{k}" for k in range(4)), *(f"h{axis}" for axis in AXES), *(f"psi{mode}" for mode in MODES))
    return dict(zip(names, (*q, *h, *psi), strict=True))


def _law_rows(i: SimpleNamespace) -> dict[str, np.ndarray]:
    """Parameters of the law (11)-(17), the disturbance and the sensors, SI."""
    return {
        "orbit_rate": i.orbit_rate,
        "disturbance_amplitude": i.disturbance_amplitude,
        "disturbance_frequency": i.disturbance_frequency,
        "disturbance_offset": i.disturbance_offset,
        "kp": i.kp,
        "kd": i.kd,
        "ki": i.ki,
        "kp_fast": i.kp / i.delta_p,
        "kd_fast": i.kd * i.delta_d,
        "ki_fast": i.ki / i.delta_i,
        "gamma": i.integral_gamma,
        "c1": i.integral_rate_gain,
        "c2": i.integral_attitude_gain,
        "beta": i.switching_rate_gain,
        "lambda2": i.switching_attitude_gain,
        "torque_limit": i.torque_limit,
        "rate_limit": i.rate_limit,
        "dbar": i.dbar,
        "rate_noise": i.rate_noise,
        "attitude_noise": i.attitude_noise,
    }


def _thruster_rows(i: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> dict[str, np.ndarray]:
    """Parameters of modulators (18)-(21), valves and thruster axes, SI."""
    period = settings.step * settings.steps_per_sample
    half_level, half_torque = settings.pwpf_pairing == 2.0, settings.pwpf_pairing >= 1.0
    turn = np.array([i.misalignment_x, i.misalignment_y, i.misalignment_z])
    # thruster axes are body axes turned: components along them become components along the body by the transpose
    axes = body_matrix(rotation_quaternion(turn)).transpose(1, 0, 2)
    rows = {f"a{AXES[a]}{AXES[b]}": axes[a, b] for a in range(3) for b in range(3)}
    rows |= {
        "gain": i.pwpf_gain,
        "level": i.thrust_level * np.where(half_level, 0.5, 1.0),
        "torque": i.thrust_level * np.where(half_torque, 0.5, 1.0),
        "on": i.pwpf_u_off + i.pwpf_hysteresis,  # (21a)
        "off": i.pwpf_u_off,
        "time_constant": i.pwpf_time_constant,
        "decay": np.exp(-period / i.pwpf_time_constant),
        "thrust_x": i.thrust_x_factor,
        "thrust_y": i.thrust_y_factor,
        "thrust_z": i.thrust_z_factor,
        "exhaust_arm": i.isp * STANDARD_GRAVITY * i.arm,
    }
    return rows | _delay_shares(i.valve_delay / period, refusals)


def _delay_shares(delay: np.ndarray, refusals: Refusals) -> dict[str, np.ndarray]:
    """Shares of a sample's thrust that come in that sample and the next two; delay in samples, 0 to 2.

    Linear between whole samples, derived here: the shares add to 1, and their mean delay is the one given.
    """
    refusals.add(delay > LONGEST_DELAY, f"valve_delay_s is longer than {LONGEST_DELAY} samples of the control")
    return {name: np.maximum(0.0, 1.0 - np.abs(delay - k)) for k, name in enumerate(("now", "next", "then"))}


MODEL = Model(
    name="flexible_satellite",
    title="Flexible satellite under a robust PID and pulse-modulated thrusters",
    source=SOURCE,
    parameters=PARAMETERS,
    settings=SETTINGS,
    states=STATES,
    quantities=outcome.QUANTITIES,
    metrics=outcome.METRICS,
    clock=FixedStep("step", "duration", "steps_per_sample"),
    kernel_parameters=dynamics.Parameters,
    prepare=prepare,
    initial=dynamics.initial,
    start=control.start,
    rhs=dynamics.rhs,
    control=control.control,
    observe=outcome.observe,
    evaluate=outcome.evaluate,
    extrema=outcome.EXTREMA,
    figures=figures.FIGURES,
    published=read_published(Path(__file__).with_name("published.toml")),
)
