"""Pressure of sunlight on a satellite that is the same from all sides, with the Earth's shadow.

The Earth is a sphere without atmosphere; its shadow has an umbra and a penumbra.  The shadow of the Moon and the light
reflected by the Earth are not modelled.  A spacecraft with large panels that do not face the Sun needs a panel model.
"""

from mc_engine.lanes import acos, asin, maximum, minimum, physics, sqrt, where
from mc_engine.physics.constants import AU

PRESSURE = 4.56e-6  # N/m^2 on a black surface at one astronomical unit: Montenbruck, Gill, section 3.4
RADIUS_SUN, RADIUS_EARTH = 6.96e8, 6_378_137.0
PI = 3.141592653589793


@physics
def discs(x, y, z, sx, sy, sz):
    """Angles [rad] seen from (x, y, z) [m]: radius of the Sun's disc, radius of the Earth's, distance of their centres.

    s : position of the Sun [m], both from the Earth's centre
    """
    dx, dy, dz = sx - x, sy - y, sz - z
    r, d = sqrt(x * x + y * y + z * z), sqrt(dx * dx + dy * dy + dz * dz)
    a, b = asin(RADIUS_SUN / d), asin(minimum(RADIUS_EARTH / r, 1.0))
    return a, b, acos(minimum(maximum(-(x * dx + y * dy + z * dz) / (r * d), -1.0), 1.0))


@physics
def sunlit(x, y, z, sx, sy, sz):
    """Fraction, 0 to 1, of the Sun's disc visible from (x, y, z) [m]; s: the Sun [m], both from the Earth's centre.

    Valid within a million kilometres of the Earth, where its disc is the larger one.  The slope of the fraction jumps
    where penumbra and umbra begin and end: for full accuracy let steps end there, by events at the zeros of c - b - a
    and c - b + a of `discs`.  Montenbruck, Gill, Satellite Orbits, section 3.4.2, eqs (3.85)-(3.94).
    """
    a, b, c = discs(x, y, z, sx, sy, sz)
    partly = (c < a + b) & (c > b - a)
    safe = where(partly, c, a + b)  # keeps the arguments below in range
    x1 = (safe * safe + a * a - b * b) / (2.0 * safe)
    y1 = sqrt(maximum(a * a - x1 * x1, 0.0))
    first = a * a * acos(minimum(maximum(x1 / a, -1.0), 1.0))
    second = b * b * acos(minimum(maximum((safe - x1) / b, -1.0), 1.0))
    dark = 0.0 * (a + b + c)  # not a number where an angle is not one
    return where(partly, 1.0 - (first + second - safe * y1) / (PI * a * a), where(c >= a + b, 1.0, dark))


@physics
def solar_pressure(x, y, z, sx, sy, sz, area_to_mass, reflectivity):
    """Acceleration [m/s^2] at (x, y, z) [m] by light from the Sun at s [m]: P C_R (A/m) (AU/d)^2, away from it.

    area_to_mass : m^2/kg;  reflectivity : C_R, 1 for a black body, 2 for a mirror that faces the Sun
    """
    dx, dy, dz = x - sx, y - sy, z - sz
    d2 = dx * dx + dy * dy + dz * dz
    k = PRESSURE * area_to_mass * reflectivity * (AU * AU) * sunlit(x, y, z, sx, sy, sz) / (d2 * sqrt(d2))
    return k * dx, k * dy, k * dz
