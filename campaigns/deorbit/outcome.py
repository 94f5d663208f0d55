"""Quantities along a de-orbit flight and metrics at its end.  SI, radians."""

from collections import namedtuple

from campaigns.deorbit.dynamics import (
    OFF,
    command,
    desired_motion,
    element_errors,
    flown,
    initial,
    propellant,
    thrust,
)
from mc_engine.lanes import asin, atan2, maximum, minimum, physics, sqrt, where
from mc_engine.model import Extremum, Field
from mc_engine.physics.constants import EARTH_RATE
from mc_engine.physics.frames import full_turn, half_turn

SETTLED = 0.01  # of its first value: an element's error below this has settled
QUANTITIES = (
    Field("position_error_m", "m", "distance from the desired place"),
    Field("velocity_error_m_s", "m/s", "difference from the desired velocity"),
    Field("a_error_km", "km", "semi-major axis, flown less desired"),
    Field("e_error", "", "eccentricity, flown less desired"),
    Field("omega_error_deg", "deg", "argument of perigee, flown less desired"),
    Field("a_remaining_pct", "%", "error of the semi-major axis in its first value"),
    Field("e_remaining_pct", "%", "error of the eccentricity in its first value"),
    Field("omega_remaining_pct", "%", "error of the argument of perigee in its first value"),
    Field("unsettled_pct", "%", "largest of the three remaining errors, without sign"),
    Field("force_n", "N", "size of the thrust"),
    Field("force_radial_n", "N", "thrust along the desired radius"),
    Field("force_transverse_n", "N", "thrust along the desired transverse direction"),
    Field("force_normal_n", "N", "thrust along the orbit normal"),
    Field("command_n", "N", "size of the commanded force"),
    Field("impulse_m_s", "m/s", "impulse S per mass so far"),
    Field("radius_km", "km", "distance from the Earth's centre"),
)
EXTREMA = (
    Extremum("position_error", "position_error_m"),
    Extremum("force", "force_n", smooth=False),  # clipped and pulsed thrust has corners
    Extremum("a_below", "a_remaining_pct", "min"),
    Extremum("e_below", "e_remaining_pct", "min"),
    Extremum("omega_below", "omega_remaining_pct", "min"),
    Extremum("settling", "unsettled_pct", "last_above", SETTLED),
)
METRICS = (
    Field("correction_impulse_m_s", "m/s", "S: time integral of thrust over mass", low=0.0),
    Field("propellant_kg", "kg", "propellant of the correction, from S", low=0.0),
    Field("peak_force_n", "N", "largest thrust", low=0.0),
    Field(
        "settling_time_s",
        "s",
        "last time with the error of a, e or omega above 1 % of its first value; none if so at entry",
        sometimes=True,
        low=0.0,
    ),
    Field("overshoot_a_pct", "%", "largest error of a beyond zero, in its first value", low=0.0),
    Field("overshoot_e_pct", "%", "largest error of e beyond zero, in its first value", low=0.0),
    Field("overshoot_omega_pct", "%", "largest error of omega beyond zero, in its first value", low=0.0),
    Field("max_position_error_m", "m", "largest distance from the desired place", low=0.0),
    Field("max_position_error_time_s", "s", "when that was, after the nominal burn", low=0.0),
    Field("final_position_error_m", "m", "distance from the desired place at entry", low=0.0),
    Field("pulse_count", "", "pulses fired by the modulator", low=0.0),
    Field("entry_time_s", "s", "entry, after the nominal burn", low=0.0),
    Field("entry_speed_m_s", "m/s", "inertial speed at entry", low=0.0),
    Field(
        "entry_flight_path_angle_deg",
        "deg",
        "inertial flight-path angle at entry, negative below the horizon",
        low=-90.0,
        high=90.0,
    ),
    Field("entry_heading_deg", "deg", "inertial heading at entry, from north, clockwise"),
    Field("entry_latitude_argument_deg", "deg", "angle in the desired plane from its node to the entry place"),
    Field("entry_latitude_deg", "deg", "geocentric latitude of entry", low=-90.0, high=90.0),
    Field("entry_longitude_deg", "deg", "longitude of entry, east, on the rotating Earth"),
    Field("entry_right_ascension_deg", "deg", "right ascension of entry, from the node"),
    Field("entry_radius_km", "km", "distance from the Earth's centre at entry", low=0.0),
    Field("entry_mass_kg", "kg", "mass at entry", low=0.0),
    Field("initial_velocity_error_m_s", "m/s", "velocity after the burn less the desired one", low=0.0),
    Field("actual_semi_major_axis_km", "km", "semi-major axis after the burn, before any correction", low=0.0),
    Field("actual_eccentricity", "", "eccentricity after the burn, before any correction", low=0.0),
    Field("actual_perigee_argument_deg", "deg", "argument of perigee after the burn, before any correction"),
    Field("desired_semi_major_axis_km", "km", "semi-major axis of the desired path", low=0.0),
    Field("desired_eccentricity", "", "eccentricity of the desired path", low=0.0),
    Field("desired_perigee_argument_deg", "deg", "argument of perigee of the desired path"),
    Field("burn_latitude_argument_deg", "deg", "argument of latitude of the planned burn"),
    Field("burn_dv_m_s", "m/s", "size of the planned burn", low=0.0),
    Field("burn_angle_deg", "deg", "alpha: angle of the planned burn from the retrograde direction"),
    Field("planned_entry_time_s", "s", "entry along the desired path, after the nominal burn", low=0.0),
)
Quantities = namedtuple(
    "Quantities",
    "position_error velocity_error a_error e_error omega_error a_left e_left omega_left unsettled "
    "force force_r force_t force_n command impulse radius",
)
Metrics = namedtuple("Metrics", [field.symbol for field in METRICS])  # type: ignore[misc]


@physics
def distance(x, y, z):
    """Length of a vector, in the unit of its components: sqrt(x^2 + y^2 + z^2)."""
    return sqrt(x * x + y * y + z * z)


@physics
def observe(t, s, m, p, o):
    """The quantities in the order of QUANTITIES, SI and radians."""
    d = desired_motion(s.f_desired, p)
    fx, fy, fz, size = command(t, s, m, d, p, o)
    scale, force = thrust(size, m, p, o)
    nx, ny, nz = d.ry * d.tz - d.rz * d.ty, d.rz * d.tx - d.rx * d.tz, d.rx * d.ty - d.ry * d.tx
    a_error, e_error, omega_error = element_errors(s, p)
    a_left, e_left, omega_left = m.a_scale * a_error, m.e_scale * e_error, m.omega_scale * omega_error
    return Quantities(
        position_error=distance(s.x, s.y, s.z),
        velocity_error=distance(s.vx, s.vy, s.vz),
        a_error=a_error,
        e_error=e_error,
        omega_error=omega_error,
        a_left=a_left,
        e_left=e_left,
        omega_left=omega_left,
        unsettled=maximum(maximum(abs(a_left), abs(e_left)), abs(omega_left)),
        force=force,
        force_r=scale * (fx * d.rx + fy * d.ry + fz * d.rz),
        force_t=scale * (fx * d.tx + fy * d.ty + fz * d.tz),
        force_n=scale * (fx * nx + fy * ny + fz * nz),
        command=size,
        impulse=s.impulse,
        radius=distance(d.x + s.x, d.y + s.y, d.z + s.z),
    )


@physics
def evaluate(t, s, m, p, o, best, when):
    """The metrics in the order of METRICS, at entry, SI and radians.

    Heading and flight-path angle come from the inertial velocity's components to the east, to the north and up, the
    longitude from the right ascension less the Earth's rotation since the epoch; derived here.
    """
    d = desired_motion(s.f_desired, p)
    x, y, z, vx, vy, vz = flown(s, d)
    r, v = distance(x, y, z), distance(vx, vy, vz)
    along = (x * p.px + y * p.py + z * p.pz) / r
    across = (x * p.qx + y * p.qy + z * p.qz) / r
    ground = sqrt(x * x + y * y)
    right_ascension = atan2(y, x)
    east = (x * vy - y * vx) / ground
    north = (vz * ground * ground - z * (x * vx + y * vy)) / (r * ground)
    climb = (x * vx + y * vy + z * vz) / r
    entry_time = t + p.delay
    longitude = right_ascension - p.greenwich - EARTH_RATE * entry_time
    spent = propellant(s, p)
    a_error, e_error, omega_error = element_errors(s, p)
    left = maximum(maximum(abs(m.a_scale * a_error), abs(m.e_scale * e_error)), abs(m.omega_scale * omega_error))
    # not settled at entry is no settling time: such a case counts against a requirement on it
    unsettled = (left > SETTLED) | (o.control == OFF)
    a_error, e_error, omega_error = element_errors(initial(p, o), p)
    return Metrics(
        correction_impulse=s.impulse,
        propellant=spent,
        peak_force=best.force,
        settling_time=where(unsettled, float("nan"), when.settling + p.delay),
        overshoot_a=maximum(-best.a_below, 0.0),
        overshoot_e=maximum(-best.e_below, 0.0),
        overshoot_omega=maximum(-best.omega_below, 0.0),
        max_position_error=best.position_error,
        max_position_error_time=when.position_error + p.delay,
        final_position_error=distance(s.x, s.y, s.z),
        pulse_count=m.pulses,
        entry_time=entry_time,
        entry_speed=v,
        entry_flight_path_angle=atan2(climb, sqrt(maximum(v * v - climb * climb, 0.0))),
        entry_heading=full_turn(atan2(east, north)),
        entry_latitude_argument=full_turn(atan2(across, along) + p.omega),
        entry_latitude=asin(maximum(-1.0, minimum(1.0, z / r))),
        entry_longitude=half_turn(longitude),
        entry_right_ascension=right_ascension,
        entry_radius=r,
        entry_mass=p.mass - spent,
        initial_velocity_error=distance(p.vx, p.vy, p.vz),
        actual_semi_major_axis=p.a + a_error,
        actual_eccentricity=p.e + e_error,
        actual_perigee_argument=full_turn(p.omega + omega_error),
        desired_semi_major_axis=p.a,
        desired_eccentricity=p.e,
        desired_perigee_argument=p.omega,
        burn_latitude_argument=p.theta_burn,
        burn_dv=p.dv,
        burn_angle=p.alpha,
        planned_entry_time=p.duration,
    )
