"""Frames at the rotating Earth: inertial, Earth-fixed, geodetic, north-east-down, wind, orbital; in both directions.

ECI    inertial, x to where longitude 0 is at angle 0, z to the north pole
ECEF   Earth-fixed, x to longitude 0 on the equator, y to 90 degrees east, z to the north pole
NED    north, east, down at a location: down is opposite to the normal of the ellipsoid
body   x ahead, y to the right, z down, as in the drawings of a vehicle
wind   x along the velocity through the air, z in the body's plane of symmetry, downwards
RIC    radial (outward), in-track (ahead, across the radius), cross-track (along the angular momentum)
LVLH   x ahead, y against the angular momentum, z to the centre of the Earth

A matrix `ned_from_ecef` takes components in ECEF to components in NED by `matrix_times`, and back by
`transposed_times`; `from_matrix` of `mc_engine.physics.rotations` makes a quaternion of it.  Vectors are `Vector`s, SI
and radians.  Other records are

Geodetic : latitude, longitude [rad], altitude [m] over WGS 84
Flow : speed [m/s], alpha (angle of attack), beta (sideslip) [rad]
Course : speed [m/s], path_angle above the horizontal, heading from north to the east [rad]
Relative : position [m], velocity [m/s]

Precession, nutation and polar motion are not modelled in flight.  Since the epoch 2000 they are tens of
kilometres at the ground, so start from axes of date, or use `ecef_from_gcrs` before a flight.
"""

from collections import namedtuple

import numpy as np

from mc_engine.lanes import atan2, cos, floor, physics, sin, sincos, sqrt
from mc_engine.physics.constants import EARTH_RATE
from mc_engine.physics.frames import TURN, WGS84_ECCENTRICITY2, WGS84_FLATTENING, WGS84_RADIUS, orbital_axes
from mc_engine.physics.sun_moon import terrestrial_time
from mc_engine.physics.vectors import (
    Matrix,
    Vector,
    added,
    cross,
    dot,
    matrix_times,
    scaled,
    subtracted,
    transposed_times,
)

Geodetic = namedtuple("Geodetic", "latitude longitude altitude")
Flow = namedtuple("Flow", "speed alpha beta")
Course = namedtuple("Course", "speed path_angle heading")
Relative = namedtuple("Relative", "position velocity")

_MJD = 2_400_000.5


# ---- the Earth's rotation


@physics
def earth_rotation_angle(days):
    """Earth rotation angle [rad], 0 to 2 pi, at `days` of UT1 since 2000 January 1, 12 h (Julian date 2451545.0).

    Measured from the celestial intermediate origin; for the equinox see `sidereal_angle` of
    `mc_engine.physics.sun_moon`.  IERS Conventions (2010), eq. (5.15), with whole turns subtracted first.
    """
    turns = (days - floor(days)) + (0.7790572732640 + 0.00273781191135448 * days)
    return TURN * (turns - floor(turns))


@physics
def eci_to_ecef(v_eci, angle):
    """Components in ECEF of a vector given in ECI, at the rotation angle [rad] of the Earth."""
    s, c = sincos(angle)
    return Vector(c * v_eci.x + s * v_eci.y, c * v_eci.y - s * v_eci.x, v_eci.z)


@physics
def ecef_to_eci(v_ecef, angle):
    """Components in ECI of a vector given in ECEF, at the rotation angle [rad] of the Earth."""
    s, c = sincos(angle)
    return Vector(c * v_ecef.x - s * v_ecef.y, c * v_ecef.y + s * v_ecef.x, v_ecef.z)


@physics
def velocity_eci_to_ecef(r_eci, v_eci, angle, rate=EARTH_RATE):
    """Velocity relative to the Earth, rotating at a rate [rad/s], in ECEF, of an inertial velocity: v - rate x r."""
    return eci_to_ecef(Vector(v_eci.x + rate * r_eci.y, v_eci.y - rate * r_eci.x, v_eci.z), angle)


@physics
def velocity_ecef_to_eci(r_ecef, v_ecef, angle, rate=EARTH_RATE):
    """Inertial velocity, in ECI, of a velocity relative to the Earth, rotating at a rate [rad/s]: v + rate x r."""
    return ecef_to_eci(Vector(v_ecef.x - rate * r_ecef.y, v_ecef.y + rate * r_ecef.x, v_ecef.z), angle)


def ecef_from_gcrs(mjd_utc: np.ndarray, ut1_less_utc: float = 0.0, xp: float = 0.0, yp: float = 0.0) -> np.ndarray:
    """Matrix [n, 3, 3] from the celestial (GCRS) to the terrestrial axes (ITRS) by IAU 2006/2000A, `erfa.c2t06a`.

    mjd_utc : modified Julian dates [n];  ut1_less_utc : UT1 - UTC [s];  xp, yp : coordinates of the pole [rad].  NumPy:
    use it before a flight, in which the axes of the start then rotate at the Earth's rate.
    """
    import erfa

    utc = np.atleast_1d(np.asarray(mjd_utc, dtype=np.float64))
    ut1 = erfa.utcut1(_MJD, utc, ut1_less_utc)
    return np.asarray(erfa.c2t06a(_MJD, terrestrial_time(utc), *ut1, xp, yp))


# ---- places


@physics
def geodetic_to_ecef(place):
    """ECEF position [m] of a Geodetic position."""
    s, c = sincos(place.latitude)
    n = WGS84_RADIUS / sqrt(1.0 - WGS84_ECCENTRICITY2 * s * s)
    level = (n + place.altitude) * c
    z = (n * (1.0 - WGS84_ECCENTRICITY2) + place.altitude) * s
    return Vector(level * cos(place.longitude), level * sin(place.longitude), z)


@physics
def ecef_to_geodetic(r_ecef):
    """Geodetic latitude, longitude [rad] and altitude [m] of an ECEF position [m].

    Three of Bowring's steps: latitude within 1e-15 rad and altitude within 5e-9 m or, farther out, the rounding of the
    position, from 10 km below the ellipsoid to 3e8 m above it.  Not for the Earth's interior.
    B. R. Bowring, Survey Review 23 (1976) 323-327;  start and altitude: Bowring, Survey Review 28 (1985) 202-206.
    """
    x, y, z = r_ecef.x, r_ecef.y, r_ecef.z
    p = sqrt(x * x + y * y)
    polar = WGS84_RADIUS * (1.0 - WGS84_FLATTENING)
    rise = WGS84_ECCENTRICITY2 / (1.0 - WGS84_ECCENTRICITY2) * polar
    # sine and cosine of the reduced latitude, then of the latitude
    start = 1.0 + rise / sqrt(p * p + z * z)
    s, c = _direction((1.0 - WGS84_FLATTENING) * z * start, p)
    for _ in range(3):
        s, c = _direction(z + rise * s * s * s, p - WGS84_ECCENTRICITY2 * WGS84_RADIUS * c * c * c)
        sine, cosine = s, c
        s, c = _direction((1.0 - WGS84_FLATTENING) * s, c)
    altitude = p * cosine + z * sine - WGS84_RADIUS * sqrt(1.0 - WGS84_ECCENTRICITY2 * sine * sine)
    return Geodetic(atan2(sine, cosine), atan2(y, x), altitude)


@physics
def _direction(a, b):
    """(sine, cosine) of the angle whose tangent is a / b."""
    u = 1.0 / sqrt(a * a + b * b)
    return a * u, b * u


@physics
def geodetic_rates(latitude, altitude, v_ned):
    """Rates of a Geodetic position [rad/s, rad/s, m/s] at a velocity over the ground [m/s]; singular at the poles."""
    s, c = sincos(latitude)
    w2 = 1.0 - WGS84_ECCENTRICITY2 * s * s
    n = WGS84_RADIUS / sqrt(w2)
    meridian = n * (1.0 - WGS84_ECCENTRICITY2) / w2
    return Geodetic(v_ned.x / (meridian + altitude), v_ned.y / ((n + altitude) * c), -v_ned.z)


# ---- north, east, down


@physics
def ned_from_ecef(latitude, longitude):
    """Matrix from ECEF to NED at a geodetic latitude and longitude [rad]."""
    s, c = sincos(latitude)
    sl, cl = sincos(longitude)
    return Matrix(-s * cl, -s * sl, c, -sl, cl, 0.0, -c * cl, -c * sl, -s)


@physics
def ned_from_eci(latitude, longitude, angle):
    """Matrix from ECI to NED, at a geodetic latitude and longitude and the rotation angle of the Earth [rad]."""
    return ned_from_ecef(latitude, longitude + angle)


@physics
def ecef_to_ned(r_ecef, origin):
    """Position [m] north, east and down from an origin, a Geodetic position, in its local level frame."""
    away = subtracted(r_ecef, geodetic_to_ecef(origin))
    return matrix_times(ned_from_ecef(origin.latitude, origin.longitude), away)


@physics
def ned_to_ecef(r_ned, origin):
    """ECEF position [m] of a position [m] given north, east and down from an origin, a Geodetic position."""
    away = transposed_times(ned_from_ecef(origin.latitude, origin.longitude), r_ned)
    return added(geodetic_to_ecef(origin), away)


@physics
def ned_to_course(v_ned):
    """Speed [m/s], flight-path angle and heading [rad] of a velocity in NED."""
    level2 = v_ned.x * v_ned.x + v_ned.y * v_ned.y
    speed = sqrt(level2 + v_ned.z * v_ned.z)
    return Course(speed, atan2(-v_ned.z, sqrt(level2)), atan2(v_ned.y, v_ned.x))


@physics
def course_to_ned(course):
    """Velocity in NED of a speed, path angle and heading."""
    s, c = sincos(course.path_angle)
    level = course.speed * c
    return Vector(level * cos(course.heading), level * sin(course.heading), -course.speed * s)


# ---- wind


@physics
def body_to_flow(v_body):
    """Speed [m/s], angles of attack and sideslip [rad] of a velocity relative to the air, given in body axes.

    B. L. Stevens and F. L. Lewis, Aircraft Control and Simulation, 2nd ed. (2003), chapter 2: alpha = atan2(w, u),
    beta = asin(v / speed).
    """
    ahead2 = v_body.x * v_body.x + v_body.z * v_body.z
    return Flow(sqrt(ahead2 + v_body.y * v_body.y), atan2(v_body.z, v_body.x), atan2(v_body.y, sqrt(ahead2)))


@physics
def flow_to_body(flow):
    """Velocity [m/s] relative to the air, in body axes, from speed, angle of attack and sideslip."""
    s, c = sincos(flow.beta)
    return Vector(flow.speed * c * cos(flow.alpha), flow.speed * s, flow.speed * c * sin(flow.alpha))


@physics
def wind_from_body(alpha, beta):
    """Matrix from body to wind axes: drag is along -x, side force along y, lift along -z of the latter."""
    sa, ca = sincos(alpha)
    sb, cb = sincos(beta)
    return Matrix(ca * cb, sb, sa * cb, -ca * sb, cb, -sa * sb, -sa, 0.0, ca)


# ---- orbital frames


@physics
def ric_from_eci(r_eci, v_eci):
    """Matrix from ECI to RIC of an orbit at a position and velocity."""
    return Matrix(*orbital_axes(r_eci.x, r_eci.y, r_eci.z, v_eci.x, v_eci.y, v_eci.z))


@physics
def lvlh_from_eci(r_eci, v_eci):
    """Matrix from ECI to LVLH of an orbit at a position and velocity."""
    m = ric_from_eci(r_eci, v_eci)
    return Matrix(m.yx, m.yy, m.yz, -m.zx, -m.zy, -m.zz, -m.xx, -m.xy, -m.xz)


@physics
def ric_rate(r_eci, v_eci):
    """Angular rate [rad/s] of RIC relative to ECI in RIC axes, without force normal to the orbit: h / r^2."""
    h = cross(r_eci, v_eci)
    return Vector(0.0, 0.0, sqrt(dot(h, h)) / dot(r_eci, r_eci))


@physics
def eci_to_ric(r_eci, v_eci, r_other, v_other):
    """Position and velocity [m, m/s] of another body, given in ECI, relative to the rotating RIC of the first."""
    m, rate = ric_from_eci(r_eci, v_eci), ric_rate(r_eci, v_eci)
    position = matrix_times(m, subtracted(r_other, r_eci))
    velocity = matrix_times(m, subtracted(v_other, v_eci))
    return Relative(position, subtracted(velocity, cross(rate, position)))


@physics
def ric_to_eci(r_eci, v_eci, relative):
    """Position and velocity [m, m/s] in ECI of another body that is given relative to the rotating RIC of the first."""
    m, rate = ric_from_eci(r_eci, v_eci), ric_rate(r_eci, v_eci)
    velocity = added(relative.velocity, cross(rate, relative.position))
    return Relative(
        added(r_eci, transposed_times(m, relative.position)), added(v_eci, transposed_times(m, velocity))
    )  # fmt: skip


@physics
def acceleration_in_ecef(r_ecef, v_ecef, rate=EARTH_RATE):
    """Coriolis and centrifugal acceleration [m/s^2] in ECEF: -2 rate x v - rate x (rate x r)."""
    across = scaled(rate * rate, r_ecef)
    return Vector(2.0 * rate * v_ecef.y + across.x, across.y - 2.0 * rate * v_ecef.x, 0.0)
