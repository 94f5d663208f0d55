"""Quantities along a de-orbit flight and metrics at its end.  SI, radians."""

from campaigns.deorbit.dynamics import desired_motion, deviation, element_errors, flown, initial, thrust
from campaigns.deorbit.inputs import CHOICES
from mc_engine.lanes import asin, atan2, exp, maximum, minimum, physics, sqrt, where
from mc_engine.model import Field, at_end, last_above, maximum_of, metrics, minimum_of, outputs
from mc_engine.physics.constants import EARTH_RATE
from mc_engine.physics.frames import full_turn, half_turn
from mc_engine.physics.vectors import Vector, cross, dot, norm

SETTLED = 0.01  # of its first value: an element's error below this has settled
Outputs = outputs(
    position_error_m="distance from the desired place",
    velocity_error_m_s="difference from the desired velocity",
    a_error_km="semi-major axis, flown less desired",
    e_error=Field("eccentricity, flown less desired", unit=""),
    omega_error_deg="argument of perigee, flown less desired",
    a_remaining_pct="error of the semi-major axis relative to its first value",
    e_remaining_pct="error of the eccentricity relative to its first value",
    omega_remaining_pct="error of the argument of perigee relative to its first value",
    unsettled_pct="largest magnitude of the three remaining errors",
    force_n="size of the thrust",
    force_radial_n="thrust along the desired radius",
    force_transverse_n="thrust along the desired transverse direction",
    force_normal_n="thrust along the orbit normal",
    command_n="size of the commanded force",
    impulse_m_s="impulse S per mass so far",
    radius_km="distance from the Earth's centre",
)
EXTREMA = {
    **{f"{of}_below": minimum_of(f"{of}_remaining_pct", "beyond zero") for of in ("a", "e", "omega")},
    "settling": last_above("unsettled_pct", SETTLED, "until all are settled"),
}
Metrics = metrics(
    correction_impulse_m_s=at_end("impulse_m_s", "S: time integral of thrust over mass", low=0.0),
    propellant_kg=Field("propellant of the correction, from S", low=0.0),
    peak_force_n=maximum_of("force_n", "largest thrust", smooth=False, low=0.0),  # clipped and pulsed, it has corners
    settling_time_s=Field(
        "last time with the error of a, e or omega above 1 % of its first value; no number if one is above it at entry",
        sometimes=True,
        low=0.0,
    ),
    **{f"overshoot_{of}_pct": Field(f"largest error of {of} beyond zero, relative to its first value", low=0.0)
       for of in ("a", "e", "omega")},
    max_position_error_m=maximum_of("position_error_m", "largest distance from the desired place", low=0.0),
    max_position_error_time_s=Field("time of the largest position error, after the nominal burn", low=0.0),
    final_position_error_m=at_end("position_error_m", "distance from the desired place at entry", low=0.0),
    pulse_count=Field("pulses fired by the modulator", unit="", low=0.0),
    entry_time_s=Field("time of entry, after the nominal burn", low=0.0),
    entry_speed_m_s=Field("inertial speed at entry", low=0.0),
    entry_flight_path_angle_deg=Field(
        "inertial flight-path angle at entry, negative below the horizon", low=-90.0, high=90.0
    ),
    entry_heading_deg="inertial heading at entry, from north, clockwise",
    entry_latitude_argument_deg="angle in the desired plane from its node to the entry place",
    entry_latitude_deg=Field("geocentric latitude of entry", low=-90.0, high=90.0),
    entry_longitude_deg="longitude of entry, east, on the rotating Earth",
    entry_right_ascension_deg="right ascension of entry, from the node",
    entry_radius_km=at_end("radius_km", "distance from the Earth's centre at entry", low=0.0),
    entry_mass_kg=Field("mass at entry", low=0.0),
    initial_velocity_error_m_s=Field("magnitude of the velocity after the burn less the desired one", low=0.0),
    actual_semi_major_axis_km=Field("semi-major axis after the burn, before any correction", low=0.0),
    actual_eccentricity=Field("eccentricity after the burn, before any correction", unit="", low=0.0),
    actual_perigee_argument_deg="argument of perigee after the burn, before any correction",
    desired_semi_major_axis_km=Field("semi-major axis of the desired path", low=0.0),
    desired_eccentricity=Field("eccentricity of the desired path", unit="", low=0.0),
    desired_perigee_argument_deg="argument of perigee of the desired path",
    burn_latitude_argument_deg="argument of latitude of the planned burn",
    burn_dv_m_s=Field("size of the planned burn", low=0.0),
    burn_angle_deg="alpha: angle of the planned burn from the retrograde direction",
    planned_entry_time_s=Field("time of entry along the desired path, after the nominal burn", low=0.0),
)  # fmt: skip


@physics
def observe(t, s, m, p, o):
    """Outputs, SI and radians; force along R, T, N.  (39)"""
    d = desired_motion(s.f_desired, p)
    r, _ = flown(s, d)
    dr, dv = deviation(s)
    command, size, scale, force = thrust(t, s, m, d, p, o)
    errors = element_errors(s, p)
    a_left, e_left, omega_left = m.scale.a * errors.a, m.scale.e * errors.e, m.scale.omega * errors.omega
    return Outputs(
        position_error=norm(dr),
        velocity_error=norm(dv),
        a_error=errors.a,
        e_error=errors.e,
        omega_error=errors.omega,
        a_remaining=a_left,
        e_remaining=e_left,
        omega_remaining=omega_left,
        unsettled=maximum(maximum(abs(a_left), abs(e_left)), abs(omega_left)),
        force=force,
        force_radial=scale * dot(command, d.radial),
        force_transverse=scale * dot(command, d.transverse),
        force_normal=scale * dot(command, cross(d.radial, d.transverse)),
        command=size,
        impulse=s.impulse,
        radius=norm(r),
    )


@physics
def evaluate(t, s, m, p, o, best, when):
    """The metrics at entry that the engine does not compute, SI and radians.

    Heading and flight-path angle come from the inertial velocity's components to the east, to the north and up, the
    longitude from the right ascension less the Earth's rotation since the epoch; derived here.
    """
    place, velocity = flown(s, desired_motion(s.f_desired, p))
    r, v, x, y, z = norm(place), norm(velocity), place.x, place.y, place.z
    along = dot(place, Vector(p.px, p.py, p.pz)) / r
    across = dot(place, Vector(p.qx, p.qy, p.qz)) / r
    ground = sqrt(x * x + y * y)
    right_ascension = atan2(y, x)
    east = (x * velocity.y - y * velocity.x) / ground
    north = (velocity.z * ground * ground - z * (x * velocity.x + y * velocity.y)) / (r * ground)
    climb = dot(place, velocity) / r
    entry_time = t + p.burn_delay
    spent = p.initial_mass * (1.0 - exp(-s.impulse / p.exhaust))  # (40)
    # not settled at entry is no settling time: such a case counts against a requirement on it
    unsettled = (observe(t, s, m, p, o).unsettled > SETTLED) | (o.control == CHOICES.control.off)
    first = element_errors(initial(p), p)
    return Metrics(
        propellant=spent,
        settling_time=where(unsettled, float("nan"), when.settling + p.burn_delay),
        overshoot_a=maximum(-best.a_below, 0.0),
        overshoot_e=maximum(-best.e_below, 0.0),
        overshoot_omega=maximum(-best.omega_below, 0.0),
        max_position_error_time=when.max_position_error + p.burn_delay,
        pulse_count=m.pulses,
        entry_time=entry_time,
        entry_speed=v,
        entry_flight_path_angle=atan2(climb, sqrt(maximum(v * v - climb * climb, 0.0))),
        entry_heading=full_turn(atan2(east, north)),
        entry_latitude_argument=full_turn(atan2(across, along) + p.omega),
        entry_latitude=asin(maximum(-1.0, minimum(1.0, z / r))),
        entry_longitude=half_turn(right_ascension - p.greenwich_angle - EARTH_RATE * entry_time),
        entry_right_ascension=right_ascension,
        entry_mass=p.initial_mass - spent,
        initial_velocity_error=norm(deviation(p)[1]),
        actual_semi_major_axis=p.a + first.a,
        actual_eccentricity=p.e + first.e,
        actual_perigee_argument=full_turn(p.omega + first.omega),
        desired_semi_major_axis=p.a,
        desired_eccentricity=p.e,
        desired_perigee_argument=p.omega,
        burn_latitude_argument=p.theta_burn,
        burn_dv=p.dv,
        burn_angle=p.alpha,
        planned_entry_time=p.duration,
    )
