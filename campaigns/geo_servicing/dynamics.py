"""Motion of one or two satellites about the geostationary orbit: gravity, Sun, Moon, sunlight, low thrust.

Cartesian, SI, mean equator and equinox of the epoch, which are taken as inertial; the Earth turns under them with the
mean sidereal rate.  The servicing module flies in all phases, the target module only in the inspection.
"""

from typing import Any

from campaigns.geo_servicing import plan_table
from campaigns.geo_servicing.inputs import CHOICES
from mc_engine.lanes import any_lane, atan2, merged, physics
from mc_engine.model import states
from mc_engine.physics.earth_frames import ecef_to_eci, eci_to_ecef, ric_from_eci
from mc_engine.physics.frames import half_turn
from mc_engine.physics.geopotential import MU_EGM2008, RADIUS_EGM2008, harmonics
from mc_engine.physics.gravity import point_mass
from mc_engine.physics.orbital_elements import equinoctial
from mc_engine.physics.radiation import solar_pressure
from mc_engine.physics.sun_moon import MU_MOON, MU_SUN, ephemeris, third_body
from mc_engine.physics.vectors import Vector, added, norm, transposed_times

MU = MU_EGM2008
SIDEREAL_DAY = 86_164.0905  # s
RATE = 7.292115857915991e-05  # 2 pi over it
R0 = 42_164_169.61350804  # m, radius at which a point mass gives that period
V0 = R0 * RATE

State = states(
    **{f"{axis}_m": f"place of the servicing module, {axis}" for axis in "xyz"},
    **{f"v{axis}_m_s": f"velocity of the servicing module, {axis}" for axis in "xyz"},
    mass_left_kg="mass of the servicing module",
    **{f"target_{axis}_m": f"place of the target module, {axis}" for axis in "xyz"},
    **{f"target_v{axis}_m_s": f"velocity of the target module, {axis}" for axis in "xyz"},
    longitude_sum_s="integral of the longitude deviation, in radians; after a transfer, of that from its end",
)


def tolerances(place: float, velocity: float) -> Any:
    """A State of absolute errors allowed in a step; place [m], velocity [m/s]."""
    by_unit = {"m": place, "m/s": velocity, "kg": 1e-6, "s": 1e-3}
    return State(*(by_unit[field.unit] for field in State.declared))


@physics
def initial(p):
    """State at the epoch."""
    return merged(State, p, longitude_sum=0.0)


@physics
def field(t, r, sun, moon, per_mass, p, o):
    """Acceleration [m/s^2] of a satellite by all but its thrust.

    r, sun, moon : places [m];  per_mass : C_R A/m [m^2/kg]
    """
    g = Vector(*point_mass(r.x, r.y, r.z, MU))
    if o.gravity_degree > 1.0:
        b, rows = eci_to_ecef(r, p.sidereal + RATE * t), plan_table.LENGTH
        h = harmonics(b.x, b.y, b.z, MU, RADIUS_EGM2008, o.gravity_degree, o.gravity_order, o.tables, rows)
        g = added(g, ecef_to_eci(Vector(*h), p.sidereal + RATE * t))
    if o.sun_and_moon > 0.5:
        g = added(g, Vector(*third_body(r.x, r.y, r.z, sun.x, sun.y, sun.z, MU_SUN)))
        g = added(g, Vector(*third_body(r.x, r.y, r.z, moon.x, moon.y, moon.z, MU_MOON)))
    if o.sunlight > 0.5:
        g = added(g, Vector(*solar_pressure(r.x, r.y, r.z, sun.x, sun.y, sun.z, per_mass, 1.0)))
    return g


@physics
def longitudes(t, s, p):
    """(true, mean) longitude of the servicing module less the required one [rad], in [-pi, pi]; and its elements."""
    elements = equinoctial(s.x, s.y, s.z, s.vx, s.vy, s.vz, MU)
    return true_deviation(t, s, p.aim), half_turn(elements.mean - (p.aim + RATE * t)), elements


@physics
def true_deviation(t, s, aim):
    """Longitude of the servicing module less that of which `aim` is the right ascension [rad] at the start."""
    r = eci_to_ecef(s, aim + RATE * t)
    return atan2(r.y, r.x)


@physics
def rhs(t, s, m, p, o):
    """Time derivative of the state, SI, inertial axes: gravity, Sun and Moon, light, thrust, and mass flow F / c."""
    sun, moon = Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0)
    if o.sun_and_moon + o.sunlight > 0.5:
        sx, sy, sz, mx, my, mz = ephemeris(p.sun_moon_time + t, o.tables, p.sun_moon)
        sun, moon = Vector(sx, sy, sz), Vector(mx, my, mz)
    a = field(t, s, sun, moon, p.light / s.mass_left, p, o)
    flow, away = 0.0, 0.0
    if any_lane(abs(m.burn.ahead) > 0.0):
        push = Vector(m.burn.outward, m.burn.ahead, m.burn.across)
        by_mass = Vector(push.x / s.mass_left, push.y / s.mass_left, push.z / s.mass_left)
        a = added(a, transposed_times(ric_from_eci(s, Vector(s.vx, s.vy, s.vz)), by_mass))
        flow = -norm(push) / p.exhaust
    target_v, target_a = Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0)
    if o.phase == CHOICES.phase.inspection:
        target_v = Vector(s.target_vx, s.target_vy, s.target_vz)
        target_a = field(t, Vector(s.target_x, s.target_y, s.target_z), sun, moon, p.target_light, p, o)
    else:
        away = true_deviation(t, s, p.aim + m.reference)
    return State(
        x=s.vx, y=s.vy, z=s.vz, vx=a.x, vy=a.y, vz=a.z, mass_left=flow,
        target_x=target_v.x, target_y=target_v.y, target_z=target_v.z,
        target_vx=target_a.x, target_vy=target_a.y, target_vz=target_a.z, longitude_sum=away,
    )  # fmt: skip
