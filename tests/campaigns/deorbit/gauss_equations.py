"""The Gauss equations, against which the flown elements are held.  SI, radians."""

from collections import namedtuple
from math import cos, sin, sqrt

from mc_engine.physics.constants import MU_EARTH

Elements = namedtuple("Elements", "node inclination omega a e f")


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
