"""Osculating elements of the flown orbit, and the Gauss equations that check them.  SI, radians."""

from collections import namedtuple

from mc_engine.lanes import atan2, cos, physics, sin, sqrt
from mc_engine.physics.constants import MU_EARTH

Elements = namedtuple("Elements", "node inclination omega a e f")


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


@physics
def gauss_rates(elements, u_radial, u_transverse, u_normal):
    """Rates of the six elements under an acceleration [m/s^2] in the orbital frame: eqs (3)-(10) of the source."""
    inclination, omega, a, e, f = elements.inclination, elements.omega, elements.a, elements.e, elements.f
    p = a * (1.0 - e * e)  # (7)
    h = sqrt(MU_EARTH * p)  # (8)
    sin_f, cos_f = sin(f), cos(f)
    r = p / (1.0 + e * cos_f)  # (9)
    theta = omega + f  # (10)
    normal = r * sin(theta) / sin(inclination) * u_normal
    apse = (-p * cos_f * u_radial + (p + r) * sin_f * u_transverse) / e
    return Elements(
        normal / h,
        r * cos(theta) * u_normal / h,
        (apse - normal * cos(inclination)) / h,
        (2.0 * a * a * e * sin_f * u_radial + 2.0 * a * a * p / r * u_transverse) / h,
        (p * sin_f * u_radial + ((p + r) * cos_f + r * e) * u_transverse) / h,
        h / (r * r) - apse / h,
    )
