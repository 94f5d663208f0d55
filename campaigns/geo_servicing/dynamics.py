"""Motion of one or two satellites about the geostationary orbit: gravity, Sun, Moon, sunlight, low thrust.

Cartesian, SI, mean equator and equinox of the epoch, which are taken as inertial; the Earth turns under them with the
mean sidereal rate.  The servicing module flies in all phases, the target module only in the inspection.
"""

from typing import Any

from campaigns.geo_servicing import plan_table
from campaigns.geo_servicing.inputs import CHOICES
from mc_engine.lanes import any_lane, atan2, physics, sincos, sqrt
from mc_engine.model import states
from mc_engine.physics.frames import half_turn, orbital_axes, turned
from mc_engine.physics.geopotential import MU_EGM2008, RADIUS_EGM2008, harmonics
from mc_engine.physics.gravity import point_mass
from mc_engine.physics.orbital_elements import equinoctial
from mc_engine.physics.radiation import solar_pressure
from mc_engine.physics.sun_moon import MU_MOON, MU_SUN, ephemeris, third_body

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
    longitude_sum_s="integral of the longitude deviation, in radians",
)


def tolerances(place: float, velocity: float) -> Any:
    """A State of absolute errors allowed in a step; place [m], velocity [m/s]."""
    by_unit = {"m": place, "m/s": velocity, "kg": 1e-6, "s": 1e-3}
    return State(*(by_unit[field.unit] for field in State.declared))


@physics
def initial(p):
    """State at the epoch."""
    return State(
        x=p.x, y=p.y, z=p.z, vx=p.vx, vy=p.vy, vz=p.vz, mass_left=p.mass_left,
        target_x=p.target_x, target_y=p.target_y, target_z=p.target_z,
        target_vx=p.target_vx, target_vy=p.target_vy, target_vz=p.target_vz, longitude_sum=0.0,
    )  # fmt: skip


@physics
def field(t, x, y, z, sun, moon, per_mass, p, o):
    """Acceleration [m/s^2] of a satellite by all but its thrust.

    sun, moon : places [m];  per_mass : C_R A/m [m^2/kg]
    """
    gx, gy, gz = point_mass(x, y, z, MU)
    if o.gravity_degree > 1.0:
        sine, cosine = sincos(p.sidereal + RATE * t)
        bx, by = turned(x, y, cosine, sine)
        hx, hy, hz = harmonics(
            bx, by, z, MU, RADIUS_EGM2008, o.gravity_degree, o.gravity_order, o.tables, plan_table.LENGTH
        )
        hx, hy = turned(hx, hy, cosine, -sine)
        gx, gy, gz = gx + hx, gy + hy, gz + hz
    if o.sun_and_moon > 0.5:
        ax, ay, az = third_body(x, y, z, sun[0], sun[1], sun[2], MU_SUN)
        bx, by, bz = third_body(x, y, z, moon[0], moon[1], moon[2], MU_MOON)
        gx, gy, gz = gx + ax + bx, gy + ay + by, gz + az + bz
    if o.sunlight > 0.5:
        ax, ay, az = solar_pressure(x, y, z, sun[0], sun[1], sun[2], per_mass, 1.0)
        gx, gy, gz = gx + ax, gy + ay, gz + az
    return gx, gy, gz


@physics
def longitudes(t, s, p):
    """(true, mean) longitude of the servicing module less the required one [rad], in [-pi, pi]; and its elements."""
    elements = equinoctial(s.x, s.y, s.z, s.vx, s.vy, s.vz, MU)
    mean = elements.mean - (p.aim + RATE * t)
    return true_deviation(t, s, p), half_turn(mean), elements


@physics
def true_deviation(t, s, p):
    """Longitude of the servicing module less the required one [rad]."""
    sine, cosine = sincos(p.aim + RATE * t)
    x, y = turned(s.x, s.y, cosine, sine)
    return atan2(y, x)


@physics
def thrust(s, m):
    """Acceleration [m/s^2] by the thrust that the memory holds."""
    rx, ry, rz, sx, sy, sz, nx, ny, nz = orbital_axes(s.x, s.y, s.z, s.vx, s.vy, s.vz)
    a, b, c = m.burn.outward / s.mass_left, m.burn.ahead / s.mass_left, m.burn.across / s.mass_left
    return a * rx + b * sx + c * nx, a * ry + b * sy + c * ny, a * rz + b * sz + c * nz


@physics
def rhs(t, s, m, p, o):
    """Time derivative of the state, SI, inertial axes: gravity, Sun and Moon, light, thrust, and mass flow F / c."""
    sx, sy, sz, mx, my, mz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if o.sun_and_moon + o.sunlight > 0.5:
        sx, sy, sz, mx, my, mz = ephemeris(p.sun_moon_time + t, o.tables, p.sun_moon)
    sun, moon = (sx, sy, sz), (mx, my, mz)
    ax, ay, az = field(t, s.x, s.y, s.z, sun, moon, p.light / s.mass_left, p, o)
    flow = 0.0
    if any_lane(abs(m.burn.ahead) > 0.0):
        fx, fy, fz = thrust(s, m)
        ax, ay, az = ax + fx, ay + fy, az + fz
        flow = -push(m.burn) / p.exhaust
    ux, uy, uz, bx, by, bz, away = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if o.phase == CHOICES.phase.inspection:
        bx, by, bz = field(t, s.target_x, s.target_y, s.target_z, sun, moon, p.target_light, p, o)
        ux, uy, uz = s.target_vx, s.target_vy, s.target_vz
    else:
        away = true_deviation(t, s, p)
    return State(
        x=s.vx, y=s.vy, z=s.vz, vx=ax, vy=ay, vz=az, mass_left=flow,
        target_x=ux, target_y=uy, target_z=uz, target_vx=bx, target_vy=by, target_vz=bz, longitude_sum=away,
    )  # fmt: skip


@physics
def push(burn):
    """Size of the thrust [N]."""
    return sqrt(burn.outward * burn.outward + burn.ahead * burn.ahead + burn.across * burn.across)
