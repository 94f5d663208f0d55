"""Elements of closed orbits.  SI, radians.

Equinoctial : a [m]; k, h, the eccentricity times cosine and sine of the longitude of the pericentre; q, p, tan(i/2)
    times cosine and sine of the node; mean, true: mean and true longitude [rad]

Equinoctial elements are regular for circular and equatorial orbits, but not near 180 degrees of inclination.  States
from classical elements, and Kepler's equation, are in NumPy, for whole chunks of cases.
"""

from collections import namedtuple

import numpy as np

from mc_engine.lanes import atan2, physics, sqrt

Equinoctial = namedtuple("Equinoctial", "a k h q p mean true")


@physics
def equinoctial(x, y, z, vx, vy, vz, mu):
    """Osculating equinoctial elements at an inertial position [m] and velocity [m/s]; a [m], angles [rad].

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


def state_of_elements(a, e, inclination, node, pericentre, anomaly, mu: float) -> np.ndarray:
    """Position [m] and velocity [m/s], float64[6, n], from classical elements: a [m], true anomaly and angles [rad].

    Montenbruck, Gill, Satellite Orbits, eqs (2.43)-(2.51).
    """
    parameter = a * (1.0 - e * e)
    r, speed = parameter / (1.0 + e * np.cos(anomaly)), np.sqrt(mu / parameter)
    ci, si, cn, sn = np.cos(inclination), np.sin(inclination), np.cos(node), np.sin(node)
    cp, sp = np.cos(pericentre), np.sin(pericentre)
    p = np.array([cp * cn - sp * ci * sn, cp * sn + sp * ci * cn, sp * si])
    q = np.array([-sp * cn - cp * ci * sn, -sp * sn + cp * ci * cn, cp * si])
    place = r * (np.cos(anomaly) * p + np.sin(anomaly) * q)
    return np.concatenate([place, speed * (-np.sin(anomaly) * p + (e + np.cos(anomaly)) * q)])


def mean_anomaly(anomaly, e):
    """Mean anomaly [rad] of a true anomaly [rad], for eccentricity e < 1: Kepler's equation, M = E - e sin E."""
    eccentric = 2.0 * np.arctan2(np.sqrt(1.0 - e) * np.sin(0.5 * anomaly), np.sqrt(1.0 + e) * np.cos(0.5 * anomaly))
    return eccentric - e * np.sin(eccentric)


def true_anomaly(mean, e):
    """True anomaly [rad], -pi to pi, of a mean anomaly [rad], by 12 Newton steps.  For eccentricities up to 0.95."""
    mean = np.mod(np.asarray(mean) + np.pi, 2.0 * np.pi) - np.pi
    eccentric = mean + e * np.sin(mean)
    for _ in range(12):
        eccentric = eccentric - (eccentric - e * np.sin(eccentric) - mean) / (1.0 - e * np.cos(eccentric))
    return 2.0 * np.arctan2(np.sqrt(1.0 + e) * np.sin(0.5 * eccentric), np.sqrt(1.0 - e) * np.cos(0.5 * eccentric))
