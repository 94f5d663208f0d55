"""Motion of one or two satellites about the geostationary orbit: gravity, Sun, Moon, sunlight, low thrust.

Cartesian, SI, mean equator and equinox of the epoch, which are taken as inertial; the Earth turns under them with the
mean sidereal rate.  The servicing module flies in all phases, the target module only in the inspection.
"""

from collections import namedtuple

from campaigns.geo_servicing import plan_table
from mc_engine.lanes import any_lane, atan2, physics, sincos, sqrt
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

BURNS = plan_table.BURNS
# servicing module, its mass [kg]; target module; integral of the longitude deviation [rad s]
State = namedtuple("State", "x y z vx vy vz mass tx ty tz tvx tvy tvz longitude_sum")
_BURN_ERRORS = [f"{error}_{k}" for k in range(1, BURNS + 1) for error in ("thrust", "normal", "radial")]
Parameters = namedtuple(  # type: ignore[misc]
    "Parameters",
    [
        *"x y z vx vy vz mass tx ty tz tvx tvy tvz".split(),  # first state
        *"thrust exhaust light target_light".split(),  # N, m/s; C_R A [m^2], of the target over its mass [m^2/kg]
        *"sidereal aim sun_moon sun_moon_time".split(),  # angles [rad] of longitude 0 and the required one; ephemeris
        *_BURN_ERRORS,  # of each burn of the phasing
        *"thrust_noise pointing_noise nav_position nav_velocity".split(),  # 1-sigma, at inspection burns and at fixes
        *"chi1 chi2 weight nominal around coast".split(),  # the inspection law
    ],
)
# due: time of what comes next, mode: what that is (`corrections`); burns so far; thrust [N] outward, ahead, normal;
# dv: commanded in the present burn; settled: 1 once the inspection counts as settled; second: 1 between two burns that
# make a pair
# end_...: at the end of the last phasing burn, and a sidereal day later
# r, s, u, w: error of the estimate, place outward and ahead [m], velocity alike [m/s]; p..: its covariance as the
# filter knows it; after_...: error of the single fix that follows the next burn; d1, d2, d3: fresh normal deviates for
# that burn
Memory = namedtuple(
    "Memory",
    "due mode burns outward ahead across dv settled second "
    "end_time end_true end_mean end_drift end_e end_inclination end_sum day_mean day_drift "
    "r s u w prr prs pru prw pss psu psw puu puw pww "
    "after_r after_s after_u after_w d1 d2 d3",
)

# settings arrive as numbers: places in the lists of words of `inputs.py`
PHASING, INSPECTION = 0.0, 1.0


@physics
def initial(p, o):
    """State at the epoch."""
    return State(
        x=p.x, y=p.y, z=p.z, vx=p.vx, vy=p.vy, vz=p.vz, mass=p.mass,
        tx=p.tx, ty=p.ty, tz=p.tz, tvx=p.tvx, tvy=p.tvy, tvz=p.tvz,
        longitude_sum=0.0,
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
    a, b, c = m.outward / s.mass, m.ahead / s.mass, m.across / s.mass
    return a * rx + b * sx + c * nx, a * ry + b * sy + c * ny, a * rz + b * sz + c * nz


@physics
def rhs(t, s, m, p, o):
    """Time derivative of the state, SI, inertial axes: gravity, Sun and Moon, light, thrust, and mass flow F / c."""
    zero = 0.0 * s.x
    sx, sy, sz, mx, my, mz = zero, zero, zero, zero, zero, zero
    if o.sun_and_moon + o.sunlight > 0.5:
        sx, sy, sz, mx, my, mz = ephemeris(p.sun_moon_time + t, o.tables, p.sun_moon)
    sun, moon = (sx, sy, sz), (mx, my, mz)
    ax, ay, az = field(t, s.x, s.y, s.z, sun, moon, p.light / s.mass, p, o)
    flow = zero
    if any_lane(abs(m.ahead) > 0.0):
        fx, fy, fz = thrust(s, m)
        ax, ay, az = ax + fx, ay + fy, az + fz
        flow = -push(m) / p.exhaust
    if o.phase == INSPECTION:
        bx, by, bz = field(t, s.tx, s.ty, s.tz, sun, moon, p.target_light, p, o)
        ux, uy, uz, away = s.tvx, s.tvy, s.tvz, zero
    else:
        ux, uy, uz, bx, by, bz = zero, zero, zero, zero, zero, zero
        away = true_deviation(t, s, p)
    return State(
        x=s.vx, y=s.vy, z=s.vz, vx=ax, vy=ay, vz=az, mass=flow,
        tx=ux, ty=uy, tz=uz, tvx=bx, tvy=by, tvz=bz,
        longitude_sum=away,
    )  # fmt: skip


@physics
def push(m):
    """Size of the thrust [N]."""
    return sqrt(m.outward * m.outward + m.ahead * m.ahead + m.across * m.across)
