"""Sun and Moon relative to the Earth's centre, and their gravity on a satellite.

Positions come from pyerfa, in a table that compiled flights interpolate: the Sun by the Earth's motion of
`erfa.epv00` (better than 0.1"), the Moon by `erfa.moon98` (3" r.m.s. and up to 13", J. Meeus, Astronomical Algorithms,
2nd ed., chapter 47, after ELP 2000-82).  Interpolation adds less than 0.02" to the Moon.

Axes: mean equator and equinox of date, z to the pole.  They rotate by 4" in 30 days, which flights neglect.  UT1 is
replaced by UTC, which differs by up to 0.9 s or 14".
"""

import erfa
import numpy as np

from mc_engine.lanes import floor, look_up, physics, sqrt
from mc_engine.physics.constants import AU

# Gravitational parameters [m^3/s^2]: IERS Conventions (2010), table 1.1, and the Moon's by its mass ratio there.
MU_SUN, MU_MOON = 1.32712440041e20, 4.902800e12
SPACING = 0.25  # days between the nodes of a table
COLUMNS = 12  # of a node: place of the Sun [m] and its change over SPACING, then the same of the Moon
_MJD = 2_400_000.5
_DAY = 86_400.0


def terrestrial_time(mjd_utc: np.ndarray) -> np.ndarray:
    """Modified Julian date in terrestrial time of one in UTC.

    After the last leap second that pyerfa knows none is added, and before 1960 UTC is taken as TAI: half a minute at
    most, in which the Moon goes on by 17".
    """
    # the bare function: `erfa.utctai` warns of every date before 1960 or some years ahead
    *tai, status = erfa.ufunc.utctai(_MJD, np.asarray(mjd_utc, dtype=np.float64))
    if np.any(status < 0):  # then `tai` is what an earlier call left in memory
        raise ValueError(f"{mjd_utc} is no modified Julian date from -2431738 to 997599999")
    tt = erfa.taitt(*tai)
    return (tt[0] - _MJD) + tt[1]


def sidereal_angle(mjd_utc: np.ndarray) -> np.ndarray:
    """Greenwich mean sidereal time [rad], 0 to 2 pi, by `erfa.gmst06`: from the mean equinox of date to longitude 0."""
    utc = np.asarray(mjd_utc, dtype=np.float64)
    return np.asarray(erfa.gmst06(_MJD, utc, _MJD, terrestrial_time(utc)))


def sun_and_moon(mjd_tt: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(position, velocity) [m, m/s] of Sun and Moon, float64[n, 2, 3] each, mean equator and equinox of their own date.

    Geometric: light time, 20" of the Sun's longitude, is neglected for gravity and radiation pressure.
    """
    tt = np.atleast_1d(np.asarray(mjd_tt, dtype=np.float64))
    earth = erfa.epv00(_MJD, tt)[0]
    moon = erfa.moon98(_MJD, tt)
    turn = erfa.pmat06(_MJD, tt)[:, None]
    place = AU * np.stack([-earth["p"], moon["p"]], axis=1)
    velocity = AU / _DAY * np.stack([-earth["v"], moon["v"]], axis=1)
    return (turn @ place[..., None])[..., 0], (turn @ velocity[..., None])[..., 0]


def node_before(mjd_utc: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(number of the last node of the grid before a UTC date, time [s] from that node to it).

    The grid is the same for all dates, so a case reads the same numbers, whichever other cases are flown with it.
    """
    since = terrestrial_time(mjd_utc) / SPACING
    number = np.floor(since)
    return number, (since - number) * SPACING * _DAY


def ephemeris_table(first: int, last: int) -> np.ndarray:
    """The table that `ephemeris` reads: float64[last - first + 1, COLUMNS], a row for every node of the grid."""
    place, velocity = sun_and_moon(SPACING * np.arange(first, last + 1))
    return np.concatenate([place, SPACING * _DAY * velocity], axis=2).reshape(-1, COLUMNS)


@physics
def _between(tables, at, u):
    """Cubic through places and changes at two nodes, at the share u of the way."""
    a, da = look_up(tables, at), look_up(tables, at + 3.0)
    b, db = look_up(tables, at + 12.0), look_up(tables, at + 15.0)
    w = 1.0 - u
    return w * w * ((1.0 + 2.0 * u) * a + u * da) + u * u * ((1.0 + 2.0 * w) * b - w * db)


@physics
def ephemeris(t, tables, first):
    """Positions of Sun and Moon [m], six numbers, at t [s] after the node whose row begins at index `first`."""
    since = t * (1.0 / (SPACING * _DAY))
    node = floor(since)
    u, at = since - node, first + COLUMNS * node
    return (
        _between(tables, at, u), _between(tables, at + 1.0, u), _between(tables, at + 2.0, u),
        _between(tables, at + 6.0, u), _between(tables, at + 7.0, u), _between(tables, at + 8.0, u),
    )  # fmt: skip


@physics
def third_body(x, y, z, bx, by, bz, mu):
    """Acceleration [m/s^2] at (x, y, z) [m] by a body at b [m] with mu [m^3/s^2], less that of the Earth's centre.

    With q = r.(r - 2 b)/b^2 the difference of the two terms loses no digits: R. H. Battin, An Introduction to the
    Mathematics and Methods of Astrodynamics, revised ed. (1999), eqs (8.60)-(8.62).
    """
    b2 = bx * bx + by * by + bz * bz
    inverse2 = 1.0 / b2
    q = (x * (x - 2.0 * bx) + y * (y - 2.0 * by) + z * (z - 2.0 * bz)) * inverse2
    w = sqrt(1.0 + q)
    f = q * (3.0 + q * (3.0 + q)) / (1.0 + (1.0 + q) * w)
    g = -mu * inverse2 * (sqrt(b2) * inverse2) / ((1.0 + q) * w)
    return g * (x + f * bx), g * (y + f * by), g * (z + f * bz)
