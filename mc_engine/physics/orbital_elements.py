"""Equinoctial elements: those of an orbit that may be circular and may lie in the equator.  SI, radians.

Not for orbits near 180 degrees of inclination, and not for open ones.
"""

from collections import namedtuple

from mc_engine.lanes import atan2, physics, sqrt

# a [m]; k, h: eccentricity vector in the orbit's plane, e cos and e sin of the longitude of the pericentre;
# q, p: tan(i/2) cos and sin of the node; mean: mean longitude; true: true longitude
Equinoctial = namedtuple("Equinoctial", "a k h q p mean true")


@physics
def equinoctial(x, y, z, vx, vy, vz, mu):
    """Osculating elements at an inertial place [m] and velocity [m/s].

    R. A. Broucke, P. J. Cefola, Celestial Mechanics 5 (1972) 303-310; D. A. Danielson et al., Semianalytic Satellite
    Theory, NPS-MA-95-002 (1995), section 2.1.4.
    """
    r2 = x * x + y * y + z * z
    v2 = vx * vx + vy * vy + vz * vz
    r = sqrt(r2)
    a = 1.0 / (2.0 / r - v2 / mu)
    hx, hy, hz = y * vz - z * vy, z * vx - x * vz, x * vy - y * vx
    c = sqrt(hx * hx + hy * hy + hz * hz)
    q, p = -hy / (c + hz), hx / (c + hz)
    # axes of the orbit's plane: f towards the direction from which longitudes count, g across
    n = 1.0 / (1.0 + p * p + q * q)
    fx, fy, fz = n * (1.0 - p * p + q * q), n * (2.0 * p * q), n * (-2.0 * p)
    gx, gy, gz = n * (2.0 * p * q), n * (1.0 + p * p - q * q), n * (2.0 * q)
    rv = (x * vx + y * vy + z * vz) / mu
    s = v2 / mu - 1.0 / r
    ex, ey, ez = s * x - rv * vx, s * y - rv * vy, s * z - rv * vz
    k, h = ex * fx + ey * fy + ez * fz, ex * gx + ey * gy + ez * gz
    along, across = x * fx + y * fy + z * fz, x * gx + y * gy + z * gz
    root = sqrt(1.0 - h * h - k * k)
    b = 1.0 / (1.0 + root)
    cosine = k + ((1.0 - k * k * b) * along - h * k * b * across) / (a * root)
    sine = h + ((1.0 - h * h * b) * across - h * k * b * along) / (a * root)
    mean = atan2(sine, cosine) + h * cosine - k * sine
    return Equinoctial(a, k, h, q, p, mean, atan2(across, along))
