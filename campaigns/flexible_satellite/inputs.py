"""Inputs of a campaign with the flexible satellite: parameters, which may differ from case to case, and settings.

Mass and modes are those of Tables 10 and 11 of H. Taei, S. Ayati, S. F. Mousavi, Iranian Journal of Mechanical
Engineering 24(3), 2022.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from campaigns.flexible_satellite.dynamics import AXES
from mc_engine.model import Parameter, Setting, choices, inputs

_NOT_ZERO = 1e-9


def _each(name: str, meaning: str, values: Mapping[Any, float], **more: Any) -> dict[str, Parameter]:
    """Parameters of one kind by column; {} in name and meaning is the axis or mode, by which `values` are given."""
    return {name.format(key): Parameter(value, meaning.format(key), **more) for key, value in values.items()}


ONES, ZEROS = dict.fromkeys(AXES, 1.0), dict.fromkeys(AXES, 0.0)
Inputs = inputs(
    **_each("inertia_{}_kg_m2", "moment of inertia about {}",
            {"x": 100.0, "y": 75.0, "z": 50.0}, low=0.0, unit="kg m^2"),
    **_each("inertia_{}_kg_m2", "entry {} of the inertia matrix: minus the product of inertia",
            {"xy": 0.0, "xz": 0.0, "yz": 0.0}, unit="kg m^2"),
    **_each("inertia_{}_factor", "true over assumed moment of inertia about {}", ONES, low=0.0, unit=""),
    **_each("modal_frequency_{}_rad_s", "frequency of mode {} on a body that is held",
            {1: 0.7, 2: 1.0, 3: 1.8, 4: 2.5}, low=0.0),
    **_each("modal_damping_{}", "damping ratio of mode {}",
            {1: 0.0056, 2: 0.0086, 3: 0.0128, 4: 0.0252}, low=0.0, unit=""),
    modal_frequency_factor=Parameter(1.0, "true over assumed frequency, all modes", low=0.0, unit=""),
    modal_damping_factor=Parameter(1.0, "true over assumed damping ratio, all modes", low=0.0, unit=""),
    coupling_factor=Parameter(1.0, "true over assumed coupling matrix c0 of modes and rotation", unit=""),
    **_each("initial_q{}", "initial attitude in the orbital frame, component {}, scalar first",
            {0: 0.4, 1: 0.2, 2: 0.4, 3: -0.8}, unit=""),
    **_each("initial_attitude_error_{}_deg", "further rotation of the first attitude, about body {}", ZEROS),
    **_each("initial_omega_{}_rad_s", "first inertial body rate about {}", {"x": 0.07, "y": -0.05, "z": -0.04}),
    orbit_rate_rad_s=Parameter(1.078e-3, "rate of the circular orbit"),
    # 5 sqrt(3)/3 1e-4 (sin t + rand) N m, the same about every axis
    disturbance_amplitude_n_m=Parameter(5e-4 / np.sqrt(3.0), "amplitude of the disturbing torque", unit="N m"),
    disturbance_frequency_rad_s=Parameter(1.0, "frequency of the disturbing torque"),
    disturbance_offset=Parameter(0.5, "constant part of that torque, in amplitudes: the source's rand", unit=""),
    rate_noise_rad_s=Parameter(0.0, "1-sigma of the noise of each measured rate", low=0.0),
    attitude_noise_rad=Parameter(0.0, "1-sigma of the noise of the measured attitude about each axis", low=0.0),
    kp=Parameter(5.0, "gain on the vector part of the attitude, N m", unit=""),
    kd=Parameter(20.0, "gain on the rate, N m s", unit=""),
    ki=Parameter(0.1, "gain on the integral, N m", unit=""),
    integral_rate_gain=Parameter(0.025, "c1: weight of the rate in the integrand", unit=""),
    integral_attitude_gain_1_s=Parameter(0.005, "c2: weight of the attitude in the integrand", unit="1/s"),
    integral_gamma=Parameter(1.5, "multiple of qv − qv(0) that is subtracted from the integral", unit=""),
    torque_limit_n_m=Parameter(0.5, "largest torque that the PID part may command", low=0.0, unit="N m"),
    rate_limit_rad_s=Parameter(0.1, "rate above which the control law brakes", low=0.0),
    delta_p=Parameter(2.0, "divisor of kp above the rate limit", low=_NOT_ZERO, unit=""),
    delta_i=Parameter(5.0, "divisor of ki above the rate limit", low=_NOT_ZERO, unit=""),
    delta_d=Parameter(10.0, "factor of kd above the rate limit", low=0.0, unit=""),
    dbar_n_m=Parameter(0.0, "size of the switching torque against disturbances", low=0.0, unit="N m"),
    switching_rate_gain=Parameter(0.05, "beta: weight of the rate in the switching torque's sign", unit=""),
    switching_attitude_gain_1_s=Parameter(0.01, "lambda2: weight of the attitude in the same sign", unit="1/s"),
    pwpf_gain=Parameter(7.39, "K_m: gain of the modulator", low=_NOT_ZERO, unit=""),
    pwpf_time_constant_s=Parameter(0.713, "T_m: time constant of the modulator's lag", low=1e-4),
    pwpf_u_off=Parameter(0.117, "U_off: lag output at which a pulse ends", low=0.0, unit=""),
    pwpf_hysteresis=Parameter(0.225, "h: U_on − U_off", low=_NOT_ZERO, unit=""),
    thrust_level=Parameter(1.07, "T: thrust level, N; see pwpf_pairing", low=_NOT_ZERO, unit=""),
    **_each("thrust_{}_factor", "true over commanded torque of the {} actuator", ONES, low=0.0, unit=""),
    **_each("misalignment_{}_deg", "rotation of the actuators' axes about body {}", ZEROS),
    valve_delay_s=Parameter(0.0, "delay of the thrust behind the modulator, at opening and closing", low=0.0),
    arm_m=Parameter(0.5, "arm of the thrusters, for the propellant", low=1e-6),
    isp_s=Parameter(220.0, "specific impulse of the thrusters, for the propellant", low=1e-3),
    actuator=Setting("ideal", "what turns command into torque", choices=("ideal", "pwpf")),
    pwpf_pairing=Setting("B", "level in the modulator, torque on the body: A is T, T; B is T, T/2; C is T/2, T/2",
                         choices=("A", "B", "C")),
    rate_used=Setting("inertial", "rate that the law works with", choices=("inertial", "orbital")),
    disturbance_draw=Setting(
        "run",
        "disturbance_offset holds all the run, or every sample draws afresh, uniform within 0.5 of it",
        choices=("run", "sample"),
    ),
    duration_s=Setting(300.0, "length of the flight, up to the end of the step that reaches it", low=1e-3, high=1e6),
    step_s=Setting(0.01, "integration step", low=1e-4, high=1.0),
    steps_per_sample=Setting(
        1.0, "integration steps from one sample of the control to the next", low=1, high=1e6, whole=True, unit=""
    ),
)  # fmt: skip

CHOICES = choices(Inputs)
