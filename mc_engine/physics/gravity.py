"""Gravitational acceleration of an oblate Earth, in inertial axes with z along the rotation axis; gravity at rest.

Powers of the distance are made of 1/r**2 and r: a division takes as long as twenty products, and the compiler
then divides once for all functions that are called with the same position.
"""

from mc_engine.lanes import fma, physics, sqrt
from mc_engine.physics.constants import EQUATORIAL_RADIUS, J2_EARTH


@physics
def point_mass(x, y, z, mu):
    """Acceleration [m/s^2] (x, y, z components) at (x, y, z) [m] of a point of parameter mu [m^3/s^2]."""
    r2 = x * x + y * y + z * z
    u2 = 1.0 / r2
    g = -mu * (u2 * u2) * sqrt(r2)
    return g * x, g * y, g * z


@physics
def j2_perturbation(x, y, z, mu):
    """Acceleration [m/s^2] by the Earth's second zonal harmonic alone, to be added to `point_mass`.

    Curtis, Orbital Mechanics for Engineering Students, 3rd ed., eq. (12.30).
    """
    r2 = x * x + y * y + z * z
    u2 = 1.0 / r2
    q = 1.5 * J2_EARTH * mu * (EQUATORIAL_RADIUS * EQUATORIAL_RADIUS) * (u2 * u2 * u2) * sqrt(r2)
    k = 5.0 * z * z * u2
    return q * (k - 1.0) * x, q * (k - 1.0) * y, q * (k - 3.0) * z


@physics
def oblate(x, y, z, mu):
    """Acceleration [m/s^2] by a point mass and J2: as `point_mass` plus `j2_perturbation`, with fewer operations.

    Curtis, Orbital Mechanics for Engineering Students, 3rd ed., eq. (12.30) added to the point's.
    """
    z2 = z * z
    r2 = fma(x, x, fma(y, y, z2))
    u2 = 1.0 / r2
    u3 = u2 * u2 * sqrt(r2)
    g = -mu * u3
    q = 1.5 * J2_EARTH * mu * (EQUATORIAL_RADIUS * EQUATORIAL_RADIUS) * u2 * u3
    k = 5.0 * u2 * z2
    across, along = fma(q, k - 1.0, g), fma(q, k - 3.0, g)
    return across * x, across * y, along * z


@physics
def normal_gravity(sine2, h):
    """Gravity [m/s^2] at rest on the rotating Earth, h [m] above the WGS 84 ellipsoid.  sine2 : sin^2 of the latitude.

    NIMA TR8350.2, 3rd ed. (2000), eqs (4-1) and (4-3): good to 20 km.
    """
    ground = 9.7803253359 * (1.0 + 1.931852652458e-3 * sine2) / sqrt(1.0 - 6.694379990141e-3 * sine2)
    fall = 2.0 / 6378137.0 * (1.0 + 3.352810665e-3 + 3.449786506841e-3 - 2.0 * 3.352810665e-3 * sine2)
    return ground * (1.0 - fall * h + 3.0 / 6378137.0**2 * h * h)
