"""Quantities along a flight of the flexible satellite and metrics at its end.  SI, radians."""

from campaigns.flexible_satellite.dynamics import AXES, MODES, body_rate
from campaigns.flexible_satellite.inputs import CHOICES
from mc_engine.lanes import atan2, maximum, merged, minimum, physics, sqrt, where
from mc_engine.model import Field, at_end, last_above, maximum_of, metrics, outputs
from mc_engine.physics.vectors import Vector, norm

SETTLED = 1e-3  # of 1 - q0: the source's "accuracy 0.001"
DAMPED = 0.005  # of each mode: Table 5's bound on the modal displacement
_MODAL = "√kg m"
_STATE = {
    "q0": Field("attitude in the orbital frame, scalar part", unit=""),
    **{f"q{i}": Field(f"attitude in the orbital frame, component {i} of the vector part", unit="") for i in (1, 2, 3)},
    **{f"omega_{axis}_rad_s": Field(f"inertial body rate about {axis}") for axis in AXES},
    **{f"eta_{i}": Field(f"displacement of mode {i}, {_MODAL}", unit="") for i in MODES},
}
Outputs = outputs(
    **_STATE,
    **{f"command_{axis}_n_m": Field(f"commanded torque about {axis}", unit="N m") for axis in AXES},
    **{
        f"torque_{axis}_n_m": Field(f"torque of the {axis} actuator, mean over the sample", unit="N m") for axis in AXES
    },
    scalar_error=Field("1 − q0", unit=""),
    attitude_error_deg="angle between body and orbital frame",
    rate_rad_s="size of the inertial body rate",
    largest_mode=Field(f"largest magnitude of the modal displacements, {_MODAL}", unit=""),
    control_effort_n_m_s="impulse of all actuators so far",
    **{f"pulse_count_{axis}": Field(f"pulses about {axis} so far", unit="") for axis in AXES},
)
Metrics = metrics(
    **{name: at_end(name, field.description, unit=field.unit) for name, field in _STATE.items()},
    # corners, where the rate limit switches gains
    peak_rate_rad_s=maximum_of("rate_rad_s", "largest inertial body rate", smooth=False, low=0.0),
    peak_modal_displacement=maximum_of("largest_mode", f"largest displacement of any mode, {_MODAL}", low=0.0, unit=""),
    settling_time_s=last_above(
        "scalar_error",
        SETTLED,
        "last time with 1 − q0 above 0.001; the length of the flight where it never settles",
        low=0.0,
    ),
    damping_time_s=last_above(
        "largest_mode",
        DAMPED,
        "last time with the displacement of any mode above 0.005; the length of the flight where it stays above",
        low=0.0,
    ),
    control_effort_n_m_s=at_end(
        "control_effort_n_m_s", "impulse of all actuators: integral of |u1| + |u2| + |u3|", low=0.0
    ),
    attitude_effort_s=Field("integral of |q1| + |q2| + |q3|", low=0.0),
    scalar_effort_s=Field("integral of |1 − q0|", low=0.0),
    q_vector_norm=Field("norm of the quaternion's vector part at the end", unit="", low=0.0, high=1.0),
    attitude_error_deg=at_end("attitude_error_deg", "angle between body and orbital frame at the end", low=0.0),
    eta_norm=Field(f"root sum square of the modal displacements at the end, {_MODAL}", unit="", low=0.0),
    pulse_count=Field("pulses of all modulators", unit="", low=0.0),
    min_pulse_s=Field("shortest pulse of any modulator; none for an ideal actuator", sometimes=True, low=0.0),
    **{f"pulse_count_{axis}": at_end(f"pulse_count_{axis}", f"pulses about {axis}", unit="") for axis in AXES},
    **{f"min_pulse_{axis}_s": Field(f"shortest pulse about {axis}", sometimes=True) for axis in AXES},
    **{
        f"on_time_{axis}_s": Field(f"time that the {axis} thrusters fired; no number without thrust", sometimes=True)
        for axis in AXES
    },
    **{f"impulse_{axis}_n_m_s": f"integral of the torque magnitude of the {axis} actuator" for axis in AXES},
    **{f"propellant_{axis}_kg": f"propellant for the impulse of the {axis} actuator" for axis in AXES},
    propellant_kg=Field("propellant for the impulse of all actuators", low=0.0),
)


@physics
def observe(s, m, p):
    """Outputs, SI and radians."""
    w = body_rate(s, p)
    return merged(
        Outputs,
        s,
        omega_x=w.x,
        omega_y=w.y,
        omega_z=w.z,
        command_x=m.command.x,
        command_y=m.command.y,
        command_z=m.command.z,
        torque_x=m.torque.x,
        torque_y=m.torque.y,
        torque_z=m.torque.z,
        scalar_error=1.0 - s.q0,
        attitude_error=2.0 * atan2(vector_norm(s), abs(s.q0)),
        rate=norm(w),
        largest_mode=maximum(maximum(abs(s.eta_1), abs(s.eta_2)), maximum(abs(s.eta_3), abs(s.eta_4))),
        control_effort=s.impulse_x + s.impulse_y + s.impulse_z,
        pulse_count_x=m.x.pulses,
        pulse_count_y=m.y.pulses,
        pulse_count_z=m.z.pulses,
    )


@physics
def vector_norm(s):
    """Size of the quaternion's vector part: the sine of half the attitude error.  (4)"""
    return norm(Vector(s.q1, s.q2, s.q3))


@physics
def counted(shortest):
    """The shortest pulse [s], not a number where none has ended."""
    return where(shortest < float("inf"), shortest, float("nan"))


@physics
def fired(impulse, thrust, p, o):
    """Time [s] that one axis fired; not a number where its thrust is nothing."""
    time = 0.0
    if o.actuator == CHOICES.actuator.pwpf:
        time = impulse / where(thrust > 0.0, p.torque * thrust, float("nan"))
    return time


@physics
def evaluate(s, m, p, o):
    """The metrics that the engine does not compute, at the end, SI; propellant (23)."""
    return merged(
        Metrics,
        s,
        q_vector_norm=vector_norm(s),
        eta_norm=sqrt(s.eta_1 * s.eta_1 + s.eta_2 * s.eta_2 + s.eta_3 * s.eta_3 + s.eta_4 * s.eta_4),
        pulse_count=m.x.pulses + m.y.pulses + m.z.pulses,
        min_pulse=counted(minimum(m.x.shortest, minimum(m.y.shortest, m.z.shortest))),
        min_pulse_x=counted(m.x.shortest),
        min_pulse_y=counted(m.y.shortest),
        min_pulse_z=counted(m.z.shortest),
        on_time_x=fired(s.impulse_x, p.thrust_x_factor, p, o),
        on_time_y=fired(s.impulse_y, p.thrust_y_factor, p, o),
        on_time_z=fired(s.impulse_z, p.thrust_z_factor, p, o),
        propellant_x=s.impulse_x / p.exhaust_arm,
        propellant_y=s.impulse_y / p.exhaust_arm,
        propellant_z=s.impulse_z / p.exhaust_arm,
        propellant=(s.impulse_x + s.impulse_y + s.impulse_z) / p.exhaust_arm,
    )
