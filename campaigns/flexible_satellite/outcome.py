"""Quantities along a flight of the flexible satellite and metrics at its end.  SI, radians."""

from collections import namedtuple

from campaigns.flexible_satellite.control import PWPF
from campaigns.flexible_satellite.dynamics import body_rate
from mc_engine.lanes import atan2, maximum, minimum, physics, sqrt, where
from mc_engine.model import Extremum, Field

SETTLED = 1e-3  # of 1 - q0: the source's "accuracy 0.001"
DAMPED = 0.005  # of each mode: Table 5's bound on the modal displacement
_MODAL = "kg^(1/2) m"

QUANTITIES = (
    Field("q0", "", "attitude in the orbital frame, scalar part"),
    *(Field(f"q{i}", "", f"attitude in the orbital frame, component {i} of the vector part") for i in (1, 2, 3)),
    *(Field(f"omega_{axis}_rad_s", "rad/s", f"inertial body rate about {axis}") for axis in "xyz"),
    *(Field(f"eta_{i}", "", f"displacement of mode {i}, {_MODAL}") for i in (1, 2, 3, 4)),
    *(Field(f"command_{axis}_n_m", "N m", f"torque that the law asks for about {axis}") for axis in "xyz"),
    *(Field(f"torque_{axis}_n_m", "N m", f"torque of the {axis} actuator, mean over the sample") for axis in "xyz"),
    Field("scalar_error", "", "1 - q0"),
    Field("attitude_error_deg", "deg", "angle between body and orbital frame"),
    Field("rate_rad_s", "rad/s", "size of the inertial body rate"),
    Field("largest_mode", "", f"largest modal displacement without sign, {_MODAL}"),
    Field("control_effort_n_m_s", "N m s", "impulse of all actuators so far"),
    *(Field(f"pulse_count_{axis}", "", f"pulses about {axis} so far") for axis in "xyz"),
)
EXTREMA = (
    Extremum("rate", "rate_rad_s", smooth=False),  # the rate limit switches gains: corners
    Extremum("mode", "largest_mode"),
    Extremum("settling", "scalar_error", "last_above", SETTLED),
    Extremum("damping", "largest_mode", "last_above", DAMPED),
)
METRICS = (
    *QUANTITIES[:11],
    Field("peak_rate_rad_s", "rad/s", "largest inertial body rate", low=0.0),
    Field("peak_modal_displacement", "", f"largest displacement of any mode, {_MODAL}", low=0.0),
    Field(
        "settling_time_s",
        "s",
        "last time with 1 - q0 above 1e-3; the length of the flight where it never settles",
        low=0.0,
    ),
    Field(
        "damping_time_s", "s", "last time with the displacement of any mode above 0.005; as settling_time_s", low=0.0
    ),
    Field("control_effort_n_m_s", "N m s", "impulse of all actuators: integral of |u1| + |u2| + |u3|", low=0.0),
    Field("attitude_effort_s", "s", "integral of |q1| + |q2| + |q3|", low=0.0),
    Field("scalar_effort_s", "s", "integral of |1 - q0|", low=0.0),
    Field("q_vector_norm", "", "size of the vector part at the end", low=0.0, high=1.0),
    Field("attitude_error_deg", "deg", "angle between body and orbital frame at the end", low=0.0),
    Field("eta_norm", "", f"root of the sum of squares of the modal displacements at the end, {_MODAL}", low=0.0),
    Field("pulse_count", "", "pulses of all modulators", low=0.0),
    Field("min_pulse_s", "s", "shortest pulse of any modulator; none for an ideal actuator", sometimes=True, low=0.0),
    *(Field(f"pulse_count_{axis}", "", f"pulses about {axis}") for axis in "xyz"),
    *(Field(f"min_pulse_{axis}_s", "s", f"shortest pulse about {axis}", sometimes=True) for axis in "xyz"),
    *(Field(f"on_time_{axis}_s", "s", f"time that the {axis} thrusters fired") for axis in "xyz"),
    *(Field(f"impulse_{axis}_n_m_s", "N m s", f"impulse of the {axis} actuator, without sign") for axis in "xyz"),
    *(Field(f"propellant_{axis}_kg", "kg", f"propellant for the impulse of the {axis} actuator") for axis in "xyz"),
    Field("propellant_kg", "kg", "propellant for the impulse of all actuators", low=0.0),
)
Quantities = namedtuple("Quantities", [field.symbol for field in QUANTITIES])  # type: ignore[misc]
Metrics = namedtuple("Metrics", [field.symbol for field in METRICS])  # type: ignore[misc]


@physics
def observe(t, s, m, p, o):
    """The quantities in the order of QUANTITIES, SI and radians."""
    wx, wy, wz = body_rate(s, p)
    mode = maximum(maximum(abs(s.eta1), abs(s.eta2)), maximum(abs(s.eta3), abs(s.eta4)))
    return Quantities(
        q0=s.q0,
        q1=s.q1,
        q2=s.q2,
        q3=s.q3,
        omega_x=wx,
        omega_y=wy,
        omega_z=wz,
        eta_1=s.eta1,
        eta_2=s.eta2,
        eta_3=s.eta3,
        eta_4=s.eta4,
        command_x=m.command_x,
        command_y=m.command_y,
        command_z=m.command_z,
        torque_x=m.torque_x,
        torque_y=m.torque_y,
        torque_z=m.torque_z,
        scalar_error=1.0 - s.q0,
        attitude_error=attitude_error(s),
        rate=sqrt(wx * wx + wy * wy + wz * wz),
        largest_mode=mode,
        control_effort=s.impulse_x + s.impulse_y + s.impulse_z,
        pulse_count_x=m.pulses_x,
        pulse_count_y=m.pulses_y,
        pulse_count_z=m.pulses_z,
    )


@physics
def vector_norm(s):
    """Size of the quaternion's vector part: the sine of half the attitude error.  (4)"""
    return sqrt(s.q1 * s.q1 + s.q2 * s.q2 + s.q3 * s.q3)


@physics
def attitude_error(s):
    """Angle [rad] between body and orbital frame, 0 to pi."""
    return 2.0 * atan2(vector_norm(s), abs(s.q0))


@physics
def counted(shortest):
    """The shortest pulse [s], not a number where none has ended."""
    return where(shortest < float("inf"), shortest, float("nan"))


@physics
def fired(impulse, thrust, p, o):
    """Time [s] that one axis fired; not a number where its thrust is nothing."""
    if o.actuator == PWPF:
        time = impulse / where(thrust > 0.0, p.torque * thrust, float("nan"))
    else:
        time = 0.0 * impulse
    return time


@physics
def evaluate(t, s, m, p, o, best, when):
    """The metrics in the order of METRICS, at the end, SI and radians."""
    wx, wy, wz = body_rate(s, p)
    effort = s.impulse_x + s.impulse_y + s.impulse_z
    return Metrics(
        q0=s.q0,
        q1=s.q1,
        q2=s.q2,
        q3=s.q3,
        omega_x=wx,
        omega_y=wy,
        omega_z=wz,
        eta_1=s.eta1,
        eta_2=s.eta2,
        eta_3=s.eta3,
        eta_4=s.eta4,
        peak_rate=best.rate,
        peak_modal_displacement=best.mode,
        settling_time=when.settling,
        damping_time=when.damping,
        control_effort=effort,
        attitude_effort=s.attitude_effort,
        scalar_effort=s.scalar_effort,
        q_vector_norm=vector_norm(s),
        attitude_error=attitude_error(s),
        eta_norm=sqrt(s.eta1 * s.eta1 + s.eta2 * s.eta2 + s.eta3 * s.eta3 + s.eta4 * s.eta4),
        pulse_count=m.pulses_x + m.pulses_y + m.pulses_z,
        min_pulse=counted(minimum(m.shortest_x, minimum(m.shortest_y, m.shortest_z))),
        pulse_count_x=m.pulses_x,
        pulse_count_y=m.pulses_y,
        pulse_count_z=m.pulses_z,
        min_pulse_x=counted(m.shortest_x),
        min_pulse_y=counted(m.shortest_y),
        min_pulse_z=counted(m.shortest_z),
        on_time_x=fired(s.impulse_x, p.thrust_x, p, o),
        on_time_y=fired(s.impulse_y, p.thrust_y, p, o),
        on_time_z=fired(s.impulse_z, p.thrust_z, p, o),
        impulse_x=s.impulse_x,
        impulse_y=s.impulse_y,
        impulse_z=s.impulse_z,
        propellant_x=s.impulse_x / p.exhaust_arm,
        propellant_y=s.impulse_y / p.exhaust_arm,
        propellant_z=s.impulse_z / p.exhaust_arm,
        propellant=effort / p.exhaust_arm,
    )
