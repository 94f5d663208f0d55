"""Outputs along an entry and metrics at its end.  SI, radians."""

from collections import namedtuple

from campaigns.reentry.air import sound_speed
from campaigns.reentry.bank import angle_at
from campaigns.reentry.dynamics import NAN, PullOut, exit_of, exposure_of, from_planned_entry, moment_of
from campaigns.reentry.inputs import CHOICES
from mc_engine.lanes import atan2, merged, physics, sqrt, where
from mc_engine.model import Field, at_end, metrics, outputs
from mc_engine.physics.frames import TURN, full_turn, geodetic_latitude, spherical, velocity_angles

Outputs = outputs(
    altitude_km="geodetic altitude",
    speed_m_s="speed over ground",
    flight_path_angle_deg="flight-path angle over ground, negative below the horizon",
    heading_deg="heading over ground, from north, clockwise",
    latitude_deg="geodetic latitude",
    longitude_deg="longitude, east",
    downrange_km="distance over ground along the planned great circle",
    crossrange_km="distance over ground to the right of the planned great circle",
    load_g="total aerodynamic load",
    axial_load_g="load along the body axis",
    dynamic_pressure_pa="dynamic pressure",
    heat_rate_w_m2="convective heat rate at the stagnation point",
    heat_load_j_m2="convective heat load at the stagnation point",
    mach=Field("Mach number", unit=""),
    density_kg_m3="density of the air",
    bank_deg="bank angle, positive to the right",
)


def _peak(what: str, unit: str, text: str) -> dict[str, Field]:
    """Columns of a peak: its value, and when, where and how fast it was."""
    return {
        f"peak_{what}_{unit}": Field(text, low=0.0),
        f"peak_{what}_time_s": Field(f"time of the {text}", low=0.0),
        f"peak_{what}_altitude_km": Field(f"altitude of the {text}", low=0.0),
        f"peak_{what}_speed_m_s": Field(f"speed over ground at the {text}", low=0.0),
    }


Metrics = metrics(
    **_peak("load", "g", "largest total aerodynamic load"),
    **_peak("axial_load", "g", "largest load along the body axis"),
    **_peak("dynamic_pressure", "pa", "largest dynamic pressure"),
    **_peak("heat_rate", "w_m2", "largest convective heat rate at the stagnation point"),
    heat_load_j_m2=at_end("heat_load_j_m2", "convective heat load at the stagnation point", low=0.0),
    corridor_violations=Field("number of the corridor's four limits that were exceeded", low=0.0, unit=""),
    min_altitude_km="altitude of the first pull-out, or of the end of a flight without one",
    min_altitude_time_s=Field("time of the first pull-out, or of the end of a flight without one", low=0.0),
    exits=Field("number of exits from the atmosphere, upwards through the exit altitude", low=0.0, unit=""),
    exit_time_s=Field("time of the first exit", sometimes=True, low=0.0),
    exit_speed_m_s=Field("speed over ground at the first exit", sometimes=True, low=0.0),
    exit_flight_path_angle_deg=Field("flight-path angle over ground at the first exit", sometimes=True),
    exit_inertial_speed_m_s=Field("inertial speed at the first exit", sometimes=True, low=0.0),
    exit_apoapsis_altitude_km=Field("altitude of the apoapsis that the first exit leads to", sometimes=True),
    flight_time_s=at_end("t_s", "length of the flight", low=0.0),
    final_altitude_km=at_end("altitude_km", "geodetic altitude at the end"),
    final_speed_m_s=at_end("speed_m_s", "speed over ground at the end", low=0.0),
    final_flight_path_angle_deg=at_end(
        "flight_path_angle_deg", "flight-path angle over ground at the end", low=-90.0, high=90.0
    ),
    final_mach=at_end("mach", "Mach number at the end", low=0.0, unit=""),
    final_latitude_deg=at_end("latitude_deg", "geodetic latitude of the end", low=-90.0, high=90.0),
    final_longitude_deg=at_end("longitude_deg", "longitude of the end, east"),
    downrange_km=at_end("downrange_km", "distance over ground to the end, along the planned great circle"),
    crossrange_km=at_end("crossrange_km", "distance over ground to the end, to the right of the planned great circle"),
    miss_km=Field("distance of the end from the target", sometimes=True, low=0.0),
    target_latitude_deg=Field("geodetic latitude of the target", sometimes=True),
    target_longitude_deg=Field("longitude of the target, east", sometimes=True),
    reference_range_km=Field("distance over ground to the end of the reference path", sometimes=True),
    saturated_share=Field(
        "fraction of the guidance's samples with a command at a limit", sometimes=True, low=0.0, high=1.0, unit=""
    ),
    reversals=Field("number of bank reversals of the guidance", low=0.0, unit=""),
    relative_speed_m_s=Field("speed over ground at entry", low=0.0),
    relative_flight_path_angle_deg="flight-path angle over ground at entry",
    ballistic_coefficient_kg_m2=Field(
        "mass over drag area in hypersonic flow, errors included; no number without drag",
        sometimes=True,
        low=0.0,
        unit="kg/m^2",
    ),
)
Ground = namedtuple("Ground", "latitude longitude downrange crossrange flight_path_angle heading")  # outputs
Target = namedtuple("Target", "target_latitude target_longitude", defaults=(NAN, NAN))  # metrics


@physics
def ground_of(s, altitude, p, o):
    """Place over ground and direction of flight [m, rad].  Distances are counted from the planned entry place.

    Downrange is the arc along the planned great circle, crossrange the arc from it, on a sphere of the planet's radius.
    Downrange goes on beyond the antipodes, from a quarter of a turn behind the entry place to three quarters ahead.
    """
    if o.shape == CHOICES.shape.flat:
        path = atan2(s.vz, sqrt(s.vx * s.vx + s.vy * s.vy))
        return Ground(0.0, 0.0, s.x, -s.y, path, full_turn(p.heading + atan2(-s.vy, s.vx)))
    latitude = geodetic_latitude(s.x, s.y, s.z, altitude, p.polar_radius, p.e2)
    _, longitude = spherical(s.x, s.y, s.z)
    up, ahead, right = from_planned_entry(s, p)
    along = atan2(ahead, up)
    downrange = p.radius * where(along < -0.25 * TURN, along + TURN, along)
    crossrange = p.radius * atan2(right, sqrt(up * up + ahead * ahead))
    path, heading = velocity_angles(s.x, s.y, s.z, s.vx, s.vy, s.vz)
    return Ground(latitude, longitude, downrange, crossrange, path, full_turn(heading))


@physics
def observe(t, s, m, p, o):
    """Outputs, SI and radians."""
    exposure = exposure_of(s, p, o)
    air, ground = exposure.air, ground_of(s, exposure.place.altitude, p, o)
    if o.guidance == CHOICES.guidance.none:
        bank = atan2(m.met.lift.sin_bank, m.met.lift.cos_bank)
    else:
        bank = angle_at(t, m.steering.turn, o.guidance_period)
    mach = air.speed / sound_speed(air.temperature)
    return merged(Outputs, ground, moment_of(t, s, exposure), s, mach=mach, density=air.density, bank=bank)


@physics
def target_of(p, o):
    """Geodetic latitude and longitude of the `Target` [rad], not numbers without one or over a flat Earth."""
    if o.shape == CHOICES.shape.flat:
        return Target()
    # at the altitude where the flight ends, so that a hit lies no distance from it
    r = p.polar_radius / sqrt(1.0 - p.e2 * (1.0 - p.tz * p.tz)) + p.stop_altitude
    latitude = geodetic_latitude(r * p.tx, r * p.ty, r * p.tz, p.stop_altitude, p.polar_radius, p.e2)
    _, longitude = spherical(p.tx, p.ty, p.tz)
    return where(p.aim_down > 0.0, Target(latitude, longitude), Target())


@physics
def evaluate(t, s, m, p, o):
    """The metrics that are no outputs at the end of the flight, SI and radians."""
    now, met, steering = moment_of(t, s, exposure_of(s, p, o)), m.met, m.steering
    # the flight may end before a peak; the load peaks with the dynamic pressure
    pressed = where(now.dynamic_pressure > met.pressed.dynamic_pressure, now, met.pressed)
    hottest = where(now.heat_rate > met.hottest.heat_rate, now, met.hottest)
    lowest = where(met.pull_out.min_altitude_time >= 0.0, met.pull_out, PullOut(now.altitude, t))
    ground = ground_of(s, now.altitude, p, o)
    # a flight that ends on the way up, and not for its time, has left the air
    leaves = (o.on_exit == CHOICES.on_exit.stop) & (t < p.stop_time) & (ground.flight_path_angle > 0.0)
    first = where(leaves, exit_of(t, s, p, o), met.first_exit)
    violations = (
        where(pressed.load > p.corridor_load, 1.0, 0.0)
        + where(hottest.heat_rate > p.corridor_heat_rate, 1.0, 0.0)
        + where(s.heat_load > p.corridor_heat_load, 1.0, 0.0)
        + where(pressed.dynamic_pressure > p.corridor_dynamic_pressure, 1.0, 0.0)
    )
    miss_down, miss_cross = ground.downrange - p.aim_down, ground.crossrange - p.target_crossrange
    reference_range = NAN if o.guidance == CHOICES.guidance.none else p.planned_range
    sampled = steering.samples > 0.0
    return merged(
        Metrics,
        p,
        steering,
        lowest,
        first,
        target_of(p, o),
        peak_load=pressed.load,
        peak_load_time=pressed.time,
        peak_load_altitude=pressed.altitude,
        peak_load_speed=pressed.speed,
        peak_axial_load=pressed.axial_load,
        peak_axial_load_time=pressed.time,
        peak_axial_load_altitude=pressed.altitude,
        peak_axial_load_speed=pressed.speed,
        peak_dynamic_pressure=pressed.dynamic_pressure,
        peak_dynamic_pressure_time=pressed.time,
        peak_dynamic_pressure_altitude=pressed.altitude,
        peak_dynamic_pressure_speed=pressed.speed,
        peak_heat_rate=hottest.heat_rate,
        peak_heat_rate_time=hottest.time,
        peak_heat_rate_altitude=hottest.altitude,
        peak_heat_rate_speed=hottest.speed,
        corridor_violations=violations,
        exits=where(leaves, 1.0, met.exits),
        miss=where(p.aim_down > 0.0, sqrt(miss_down * miss_down + miss_cross * miss_cross), NAN),
        reference_range=reference_range,
        ballistic_coefficient=where(p.drag > 0.0, 1.0 / where(p.drag > 0.0, p.drag, 1.0), NAN),
        saturated_share=where(sampled, steering.saturated / where(sampled, steering.samples, 1.0), NAN),
    )
