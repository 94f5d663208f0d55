"""Positions about a rotating planet: altitude over its ellipsoid, local axes, relative and inertial velocity.

Planet-fixed axes: x to longitude 0, y to 90 degrees east, z to the north pole.  Latitudes are geocentric unless a
name says geodetic; a sphere is an ellipsoid of eccentricity zero.  Headings are measured clockwise from north.

Compiled functions take and return plain numbers.  NumPy functions, for whole chunks of cases, are marked as such.
"""

import numpy as np

from mc_engine.lanes import atan2, floor, physics, rint, sqrt

TURN = 6.283185307179586  # rad

# World Geodetic System 1984, NIMA TR8350.2, 3rd ed., table 3.1: equatorial radius [m] and flattening.
WGS84_RADIUS = 6_378_137.0
WGS84_FLATTENING = 1.0 / 298.257223563
WGS84_ECCENTRICITY2 = WGS84_FLATTENING * (2.0 - WGS84_FLATTENING)


@physics
def over_ellipsoid(r, inverse_r, sin2, polar_radius, e2):
    """(geodetic altitude [m], slope of the ellipsoid's radius by sin2 [m]) at distance r [m] from the centre.

    sin2 : squared sine of the latitude;  e2 : squared eccentricity, 0 for a sphere;  inverse_r : 1 / r.
    With d = r - R(sin2) and t the angle between plumb line and radius, h = d - d t^2 R / (2 r): the distance along the
    plumb line to an osculating sphere, to second order in t.  On WGS 84 the error is below 0.1 mm up to 200 km of
    altitude and below 0.1 m anywhere.
    """
    w = 1.0 / (1.0 - e2 * (1.0 - sin2))
    radius = polar_radius * sqrt(w)
    d = r - radius
    tilt = e2 * w
    bend = 0.5 * (tilt * tilt) * sin2 * (1.0 - sin2)
    return d - d * bend * radius * inverse_r, -0.5 * tilt * radius


@physics
def spherical(x, y, z):
    """(latitude, longitude) [rad] of a position in planet-fixed axes [m]."""
    return atan2(z, sqrt(x * x + y * y)), atan2(y, x)


@physics
def geodetic_latitude(x, y, z, altitude, polar_radius, e2):
    """Geodetic latitude [rad] of a position [m] whose geodetic altitude [m] is known.

    tan(latitude) = z / (p (1 - e2 N / (N + h))) with p the distance from the axis and N the radius of curvature across
    the meridian, taken at the latitude of the plumb line's foot under the radius: the error is below 1e-8 rad.
    """
    p2 = x * x + y * y
    sin2 = z * z / (z * z + p2 * (1.0 - e2) * (1.0 - e2))
    n = polar_radius / sqrt((1.0 - e2) * (1.0 - e2 * sin2))
    return atan2(z, sqrt(p2) * (1.0 - e2 * n / (n + altitude)))


@physics
def velocity_angles(x, y, z, vx, vy, vz):
    """(flight-path angle, heading) [rad] of a velocity at a position, both in the same axes, z to the north pole.

    Exactly on the axis, x = y = 0, both angles are 0 for any velocity.
    """
    p2 = x * x + y * y
    outward = x * vx + y * vy
    east = (x * vy - y * vx) * sqrt(p2 + z * z)
    north = vz * p2 - z * outward
    radial = (outward + z * vz) * sqrt(p2)
    return atan2(radial, sqrt(east * east + north * north)), atan2(east, north)


def local_axes(latitude: np.ndarray, longitude: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(north, east, up) unit vectors [3, n] in planet-fixed axes; up is away from the centre.  NumPy."""
    s, c = np.sin(latitude), np.cos(latitude)
    sl, cl = np.sin(longitude), np.cos(longitude)
    return np.array([-s * cl, -s * sl, c]), np.array([-sl, cl, np.zeros_like(s)]), np.array([c * cl, c * sl, s])


def velocity_components(speed: np.ndarray, path_angle: np.ndarray, heading: np.ndarray) -> np.ndarray:
    """North, east and up components [3, n] of a velocity.  NumPy."""
    level = speed * np.cos(path_angle)
    return np.array([level * np.cos(heading), level * np.sin(heading), speed * np.sin(path_angle)])


def carried_along(radius: np.ndarray, latitude: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """North, east and up components [3, n] of the velocity of the rotating frame: inertial less relative.  NumPy."""
    zero = np.zeros_like(radius)
    return np.array([zero, rate * radius * np.cos(latitude), zero])


def radius_at_altitude(
    altitude: np.ndarray, latitude: np.ndarray, polar_radius: np.ndarray, e2: np.ndarray
) -> np.ndarray:
    """Distance [m] from the centre of a position at a geodetic altitude [m] and a geocentric latitude [rad].  NumPy."""
    sin2 = np.sin(latitude) ** 2
    r = polar_radius + altitude
    for _ in range(6):  # altitude grows by almost a metre for a metre of radius: each step gains five digits
        r = r + altitude - over_ellipsoid(r, 1.0 / r, sin2, polar_radius, e2)[0]
    return r


@physics
def full_turn(angle):
    """The angle [rad] from 0 to 2 pi, both ends included: -1e-20 becomes 2 pi.

    It may exceed the ends by the rounding of the given angle, such as -2e-12 after 2000 turns.
    """
    return angle - TURN * floor(angle * (1.0 / TURN))


@physics
def half_turn(angle):
    """The angle [rad] from -pi to pi; it may exceed the ends by the rounding of the given angle, as in `full_turn`."""
    return angle - TURN * rint(angle * (1.0 / TURN))


@physics
def turned(x, y, cosine, sine):
    """(x, y) of the same vector in axes rotated about z by an angle, given by its cosine and sine."""
    return cosine * x + sine * y, cosine * y - sine * x


@physics
def orbital_axes(x, y, z, vx, vy, vz):
    """Unit vectors outward, transverse (ahead, across the radius) and normal to the orbit, nine numbers."""
    u = 1.0 / sqrt(x * x + y * y + z * z)
    hx, hy, hz = y * vz - z * vy, z * vx - x * vz, x * vy - y * vx
    w = 1.0 / sqrt(hx * hx + hy * hy + hz * hz)
    rx, ry, rz, nx, ny, nz = u * x, u * y, u * z, w * hx, w * hy, w * hz
    return rx, ry, rz, ny * rz - nz * ry, nz * rx - nx * rz, nx * ry - ny * rx, nx, ny, nz
