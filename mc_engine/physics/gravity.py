"""Gravitational acceleration of an oblate Earth, in inertial axes with z along the rotation axis."""

from mc_engine.lanes import physics, sqrt
from mc_engine.physics.constants import EQUATORIAL_RADIUS, J2_EARTH


@physics
def point_mass(x, y, z, mu):
    """Acceleration [m/s^2] (x, y, z components) at (x, y, z) [m] of a point of parameter mu [m^3/s^2]."""
    r2 = x * x + y * y + z * z
    g = -mu / (r2 * sqrt(r2))
    return g * x, g * y, g * z


@physics
def j2_perturbation(x, y, z, mu):
    """Acceleration [m/s^2] by the Earth's second zonal harmonic alone, to be added to `point_mass`.

    Curtis, Orbital Mechanics for Engineering Students, 3rd ed., eq. (12.30).
    """
    r2 = x * x + y * y + z * z
    q = 1.5 * J2_EARTH * mu * (EQUATORIAL_RADIUS * EQUATORIAL_RADIUS) / (r2 * r2 * sqrt(r2))
    k = 5.0 * z * z / r2
    return q * (k - 1.0) * x, q * (k - 1.0) * y, q * (k - 3.0) * z
