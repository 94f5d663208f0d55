"""The standard air: density, pressure, temperature and speed of sound over altitude; dynamic pressure.

An `Air` has density [kg/m^3], pressure [Pa], temperature [K] and speed_of_sound [m/s].

`us76_air` follows the standard exactly up to 86 km, and its tables of density and pressure above.  For densities alone
and for other planets see `mc_engine.physics.atmosphere`, for wind `wind_profile` of `mc_engine.physics.curves`.
"""

import math
from collections import namedtuple

from mc_engine.lanes import exp, maximum, minimum, physics, sqrt, where
from mc_engine.physics.atmosphere import GAS_CONSTANT, US76_TOP, VACUUM, aloft_constants, us76_logarithm

Air = namedtuple("Air", "density pressure temperature speed_of_sound")

# U.S. Standard Atmosphere, 1976 (NOAA-S/T 76-1562): ratio of specific heats, table 2; geometric altitude [m] and
# pressure [Pa] above 86 km, table I.
HEAT_RATIO = 1.4
_ALOFT = (
    (90e3, 1.8359e-1),
    (95e3, 7.5966e-2),
    (100e3, 3.2011e-2),
    (105e3, 1.4477e-2),
    (110e3, 7.1042e-3),
    (115e3, 4.0096e-3),
    (120e3, 2.5382e-3),
    (130e3, 1.2505e-3),
    (150e3, 4.5422e-4),
    (200e3, 8.4736e-5),
)


def _top_pressure_logarithm():
    logarithm, _, temperature = us76_logarithm(US76_TOP * (1.0 - 1e-15))
    return logarithm + math.log(GAS_CONSTANT * temperature)


_BASE, _A, _C = zip(*aloft_constants(_top_pressure_logarithm(), _ALOFT), strict=True)


@physics
def us76_air(h):
    """Air of the U.S. Standard Atmosphere, 1976, at geometric altitude h [m], in SI.

    Up to 86 km p = rho R T and a^2 = 1.4 R T; below the ground the lowest layer is extended.  T is the molecular-scale
    temperature, which differs from the kinetic one above 80 km and is 0.04 % higher at 86 km.  Above 86 km densities
    and pressures are those of table I, with their logarithms interpolated linearly.  They are extrapolated beyond
    200 km, where the density is far too low (see `us76_logarithm`).  Temperature and speed of sound stay at their
    values at 86 km, as the standard defines no speed of sound above.
    """
    logarithm, _, temperature = us76_logarithm(h)
    a, c = _A[0], _C[0]
    for i in range(1, len(_BASE)):
        inside = h >= _BASE[i]
        a, c = where(inside, _A[i], a), where(inside, _C[i], c)
    density = exp(logarithm)
    pressure = where(
        h >= US76_TOP, exp(maximum(minimum(a + c * h, 50.0), VACUUM)), density * (GAS_CONSTANT * temperature)
    )
    return Air(density, pressure, temperature, sqrt(HEAT_RATIO * GAS_CONSTANT * temperature))


@physics
def dynamic_pressure(density, speed):
    """Dynamic pressure [Pa] of a flow: rho v^2 / 2."""
    return 0.5 * density * speed * speed
