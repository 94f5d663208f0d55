"""Quantities along an entry and metrics at its end.  SI, radians."""

from collections import namedtuple

from campaigns.reentry.air import sound_speed
from campaigns.reentry.bank import angle_at
from campaigns.reentry.dynamics import (
    FLAT,
    STOP_ON_EXIT,
    UNGUIDED,
    UNKNOWN,
    air_of,
    exit_of,
    exposure_of,
    force_of,
    heat_rate,
    place_of,
    speed2,
)
from mc_engine.lanes import atan2, physics, sqrt, where
from mc_engine.model import Field
from mc_engine.physics.frames import TURN, full_turn, geodetic_latitude, spherical, velocity_angles

QUANTITIES = (
    Field("altitude_km", "km", "geodetic altitude"),
    Field("speed_m_s", "m/s", "speed over ground"),
    Field("flight_path_angle_deg", "deg", "flight-path angle over ground, negative below the horizon"),
    Field("heading_deg", "deg", "heading over ground, from north, clockwise"),
    Field("latitude_deg", "deg", "geodetic latitude"),
    Field("longitude_deg", "deg", "longitude, east"),
    Field("downrange_km", "km", "distance over ground along the planned great circle"),
    Field("crossrange_km", "km", "distance over ground to the right of the planned great circle"),
    Field("load_g", "g", "total aerodynamic load"),
    Field("axial_load_g", "g", "load along the body axis"),
    Field("dynamic_pressure_pa", "Pa", "dynamic pressure"),
    Field("heat_rate_w_m2", "W/m^2", "convective heat rate at the stagnation point"),
    Field("heat_load_j_m2", "J/m^2", "convective heat load at the stagnation point"),
    Field("mach", "", "Mach number"),
    Field("density_kg_m3", "kg/m^3", "density of the air"),
    Field("bank_deg", "deg", "bank angle, positive to the right"),
)
_PEAKS = (
    ("load_g", "g", "largest total aerodynamic load"),
    ("axial_load_g", "g", "largest load along the body axis"),
    ("dynamic_pressure_pa", "Pa", "largest dynamic pressure"),
    ("heat_rate_w_m2", "W/m^2", "largest convective heat rate at the stagnation point"),
)


def _peak(name: str, unit: str, text: str) -> tuple[Field, ...]:
    """The peak itself, and when, where and how fast it was."""
    stem = f"peak_{Field(name, unit, text).symbol}"
    return (
        Field(f"peak_{name}", unit, text, low=0.0),
        Field(f"{stem}_time_s", "s", f"{text}: when", low=0.0),
        Field(f"{stem}_altitude_km", "km", f"{text}: at what altitude", low=0.0),
        Field(f"{stem}_speed_m_s", "m/s", f"{text}: at what speed over ground", low=0.0),
    )


METRICS = (
    *(field for peak in _PEAKS for field in _peak(*peak)),
    Field("heat_load_j_m2", "J/m^2", "convective heat load at the stagnation point", low=0.0),
    Field("corridor_violations", "", "how many of the corridor's four limits were passed", low=0.0),
    Field("min_altitude_km", "km", "altitude of the first pull-out, or of the end of a flight without one"),
    Field("min_altitude_time_s", "s", "when that was", low=0.0),
    Field("exits", "", "how often the vehicle left the atmosphere, upwards through the exit altitude", low=0.0),
    Field("exit_time_s", "s", "first exit", sometimes=True, low=0.0),
    Field("exit_speed_m_s", "m/s", "speed over ground at the first exit", sometimes=True, low=0.0),
    Field("exit_flight_path_angle_deg", "deg", "flight-path angle over ground at the first exit", sometimes=True),
    Field("exit_inertial_speed_m_s", "m/s", "inertial speed at the first exit", sometimes=True, low=0.0),
    Field("exit_apoapsis_altitude_km", "km", "altitude of the apoapsis that the first exit leads to", sometimes=True),
    Field("flight_time_s", "s", "length of the flight", low=0.0),
    Field("final_altitude_km", "km", "geodetic altitude at the end"),
    Field("final_speed_m_s", "m/s", "speed over ground at the end", low=0.0),
    Field("final_flight_path_angle_deg", "deg", "flight-path angle over ground at the end", low=-90.0, high=90.0),
    Field("final_mach", "", "Mach number at the end", low=0.0),
    Field("final_latitude_deg", "deg", "geodetic latitude of the end", low=-90.0, high=90.0),
    Field("final_longitude_deg", "deg", "longitude of the end, east"),
    Field("downrange_km", "km", "distance over ground to the end, along the planned great circle"),
    Field("crossrange_km", "km", "distance over ground to the end, to the right of the planned great circle"),
    Field("miss_km", "km", "distance of the end from the target", sometimes=True, low=0.0),
    Field("target_latitude_deg", "deg", "geodetic latitude of the target", sometimes=True),
    Field("target_longitude_deg", "deg", "longitude of the target, east", sometimes=True),
    Field("reference_range_km", "km", "distance over ground to the end of the reference path", sometimes=True),
    Field(
        "saturated_share",
        "",
        "share of the guidance's samples at which its command was at a limit",
        sometimes=True,
        low=0.0,
        high=1.0,
    ),
    Field("reversals", "", "how often the guidance changed the side of the lift", low=0.0),
    Field("relative_speed_m_s", "m/s", "speed over ground at entry", low=0.0),
    Field("relative_flight_path_angle_deg", "deg", "flight-path angle over ground at entry"),
    Field(
        "ballistic_coefficient_kg_m2", "kg/m^2", "mass over drag area in hypersonic flow, dispersions included", low=0.0
    ),
)
Quantities = namedtuple(
    "Quantities",
    "altitude speed path heading latitude longitude downrange crossrange load axial pressure flux heat mach density "
    "bank",
)
Metrics = namedtuple("Metrics", [field.symbol for field in METRICS])  # type: ignore[misc]
Ground = namedtuple("Ground", "latitude longitude downrange crossrange path heading")


@physics
def ground_of(s, altitude, p, o):
    """Place over ground and direction of flight [m, rad].  Distances are counted from the planned entry place.

    Downrange is the arc along the planned great circle, crossrange the arc from it, on a sphere of the planet's radius.
    Downrange goes on beyond the antipodes, from a quarter of a turn behind the entry place to three quarters ahead.
    """
    if o.shape == FLAT:
        latitude, longitude, downrange, crossrange = 0.0 * s.x, 0.0 * s.x, s.x + 0.0 * s.x, -s.y
        path = atan2(s.vz, sqrt(s.vx * s.vx + s.vy * s.vy))
        heading = p.heading + atan2(-s.vy, s.vx)
    else:
        _, longitude = spherical(s.x, s.y, s.z)
        latitude = geodetic_latitude(s.x, s.y, s.z, altitude, p.polar_radius, p.e2)
        up = s.x * p.ex + s.y * p.ey + s.z * p.ez
        ahead = s.x * p.fx + s.y * p.fy + s.z * p.fz
        right = s.x * p.nx + s.y * p.ny + s.z * p.nz
        along = atan2(ahead, up)
        downrange = p.radius * where(along < -0.25 * TURN, along + TURN, along)
        crossrange = p.radius * atan2(right, sqrt(up * up + ahead * ahead))
        path, heading = velocity_angles(s.x, s.y, s.z, s.vx, s.vy, s.vz)
    return Ground(latitude, longitude, downrange, crossrange, path, full_turn(heading))


@physics
def observe(t, s, m, p, o):
    """The quantities in the order of QUANTITIES, SI and radians."""
    place = place_of(s, p, o)
    air = air_of(s, place, p, o)
    v2 = speed2(air)
    through = sqrt(v2)
    pressure = 0.5 * air.density * v2
    force = force_of(air, through, p, o)
    ground = ground_of(s, place.altitude, p, o)
    if o.guidance == UNGUIDED:
        bank = atan2(m.sin_bank, m.cos_bank)
    else:
        bank = angle_at(t, m, o.guidance_period)
    return Quantities(
        altitude=place.altitude,
        speed=sqrt(speed2(s)),
        path=ground.path,
        heading=ground.heading,
        latitude=ground.latitude,
        longitude=ground.longitude,
        downrange=ground.downrange,
        crossrange=ground.crossrange,
        load=pressure * force.total,
        axial=pressure * force.axial,
        pressure=pressure,
        flux=heat_rate(air.density, through, p, o),
        heat=s.heat,
        mach=through / sound_speed(air.temperature),
        density=air.density,
        bank=bank,
    )


@physics
def known(value):
    """The value, or not a number where it is unknown."""
    return where(abs(value) < UNKNOWN, value, float("nan"))


@physics
def violations(load, pressure, flux, heat, p):
    """How many of load [m/s^2], heat rate [W/m^2], heat load [J/m^2], dynamic pressure [Pa] were above their limits."""
    return (
        where(load > p.corridor_load, 1.0, 0.0)
        + where(flux > p.corridor_heat_rate, 1.0, 0.0)
        + where(heat > p.corridor_heat_load, 1.0, 0.0)
        + where(pressure > p.corridor_pressure, 1.0, 0.0)
    )


@physics
def target_of(t, p, o):
    """(geodetic latitude, longitude) of the target [rad], not numbers without one or over a flat Earth."""
    if o.shape == FLAT:
        latitude, longitude = float("nan") + t, float("nan") + t
    else:
        # at the altitude where the flight ends, so that a hit lies no distance from it
        r = p.polar_radius / sqrt(1.0 - p.e2 * (1.0 - p.tz * p.tz)) + p.stop
        aimed = p.aimed > 0.5
        latitude = geodetic_latitude(r * p.tx, r * p.ty, r * p.tz, p.stop, p.polar_radius, p.e2)
        latitude = where(aimed, latitude, float("nan")) + 0.0 * t
        longitude = where(aimed, spherical(p.tx, p.ty, p.tz)[1], float("nan")) + 0.0 * t
    return latitude, longitude


@physics
def planned_range(t, p, o):
    """Range [m] of the reference path, not a number without one."""
    if o.guidance == UNGUIDED:
        value = float("nan") + t
    else:
        value = p.planned_range + 0.0 * t
    return value


@physics
def evaluate(t, s, m, p, o, best, when):
    """The metrics in the order of METRICS, at the end of the flight, SI and radians."""
    pressure, flux, altitude, v, force = exposure_of(s, p, o)
    ground = ground_of(s, altitude, p, o)
    push, heat = pressure > m.pressure, flux > m.flux  # the flight may end before a peak
    pressure, flux = where(push, pressure, m.pressure), where(heat, flux, m.flux)
    load = pressure * where(push, force.total, m.pressure_total)
    # the load peaks with the dynamic pressure
    load_time, load_altitude = where(push, t, m.pressure_time), where(push, altitude, m.pressure_altitude)
    load_speed = where(push, v, m.pressure_speed)
    target_latitude, target_longitude = target_of(t, p, o)
    leaves = (o.on_exit == STOP_ON_EXIT) & (altitude > p.exit - 1e-3) & (ground.path > 0.0)
    speed, angle, inertial, apoapsis = exit_of(s, p, o)
    pulled = m.low < UNKNOWN
    air = air_of(s, place_of(s, p, o), p, o)
    miss_down, miss_cross = ground.downrange - p.aim_down, ground.crossrange - p.aim_cross
    return Metrics(
        peak_load=load,
        peak_load_time=load_time,
        peak_load_altitude=load_altitude,
        peak_load_speed=load_speed,
        peak_axial_load=pressure * where(push, force.axial, m.pressure_axial),
        peak_axial_load_time=load_time,
        peak_axial_load_altitude=load_altitude,
        peak_axial_load_speed=load_speed,
        peak_dynamic_pressure=pressure,
        peak_dynamic_pressure_time=load_time,
        peak_dynamic_pressure_altitude=load_altitude,
        peak_dynamic_pressure_speed=load_speed,
        peak_heat_rate=flux,
        peak_heat_rate_time=where(heat, t, m.flux_time),
        peak_heat_rate_altitude=where(heat, altitude, m.flux_altitude),
        peak_heat_rate_speed=where(heat, v, m.flux_speed),
        heat_load=s.heat,
        corridor_violations=violations(load, pressure, flux, s.heat, p),
        min_altitude=where(pulled, m.low, altitude),
        min_altitude_time=where(pulled, m.low_time, t),
        exits=where(leaves, 1.0, m.exits),
        exit_time=known(where(leaves, t, m.exit_time)),
        exit_speed=known(where(leaves, speed, m.exit_speed)),
        exit_flight_path_angle=known(where(leaves, angle, m.exit_angle)),
        exit_inertial_speed=known(where(leaves, inertial, m.exit_inertial)),
        exit_apoapsis_altitude=known(where(leaves, apoapsis, m.exit_apoapsis)),
        flight_time=t,
        final_altitude=altitude,
        final_speed=v,
        final_flight_path_angle=ground.path,
        final_mach=sqrt(speed2(air)) / sound_speed(air.temperature),
        final_latitude=ground.latitude,
        final_longitude=ground.longitude,
        downrange=ground.downrange,
        crossrange=ground.crossrange,
        miss=where(p.aimed > 0.5, sqrt(miss_down * miss_down + miss_cross * miss_cross), float("nan")),
        target_latitude=target_latitude,
        target_longitude=target_longitude,
        reference_range=planned_range(t, p, o),
        saturated_share=where(m.samples > 0.0, m.saturated / where(m.samples > 0.0, m.samples, 1.0), float("nan")),
        reversals=m.reversals,
        relative_speed=p.speed,
        relative_flight_path_angle=p.path,
        ballistic_coefficient=where(p.drag > 0.0, 1.0 / where(p.drag > 0.0, p.drag, 1.0), float("nan")),
    )
