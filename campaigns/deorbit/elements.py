"""Osculating elements of the flown orbit.  SI, radians."""

from mc_engine.lanes import atan2, physics, sqrt
from mc_engine.physics.constants import MU_EARTH


@physics
def osculating(x, y, z, vx, vy, vz):
    """(a [m], e, omega [rad]) of the orbit through an inertial position [m] and velocity [m/s].

    omega from the eccentricity vector's components along and across the node, by atan2: near-circular orbits
    keep all digits.  Curtis, Orbital Mechanics for Engineering Students, 3rd ed., algorithm 4.2.
    """
    r2 = x * x + y * y + z * z
    w = (vx * vx + vy * vy + vz * vz) * (1.0 / MU_EARTH)
    u, rv = 1.0 / sqrt(r2), x * vx + y * vy + z * vz
    hx, hy, hz = y * vz - z * vy, z * vx - x * vz, x * vy - y * vx
    k, q = w - u, rv * (1.0 / MU_EARTH)
    ex, ey, ez = k * x - q * vx, k * y - q * vy, k * z - q * vz
    # node vector (-hy, hx, 0); across it in the orbital plane lies h x node
    along = hx * ey - hy * ex
    h = sqrt(hx * hx + hy * hy + hz * hz)
    across = hz * (-hx * ex - hy * ey) + (hx * hx + hy * hy) * ez  # times h
    return 1.0 / (2.0 * u - w), sqrt(ex * ex + ey * ey + ez * ez), atan2(across, along * h)
