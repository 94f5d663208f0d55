"""Atmospheric density models: one function per model, density in kg/m^3.

`exponential` is a single layer; EXPONENTIALS has its numbers for several planets.  `layered` joins the layers of
Vallado's table from 100 to 700 km and is for orbits and de-orbit arcs; the variation of tens of percent from day to day
is not modelled.  `us76` is for entry: the 1976 standard, exact from the ground to 86 km, tabulated above, and with far
too low a density for orbits beyond 200 km.
"""

import math
from itertools import pairwise

import numpy as np

from mc_engine.lanes import exp, log, maximum, minimum, physics, where

# Logarithms of a density end here.  Below, drag would be a number so small that its bits are fewer (subnormal), for
# which processors of Intel take some 150 cycles: transfer orbits through such air took three times as long.
VACUUM = -600.0

# Vallado, Fundamentals of Astrodynamics and Applications, 4th ed., Table 8-4:
# base altitude [m], density there [kg/m^3], scale height [m].
LAYERS = (
    (100e3, 5.297e-7, 5_877.0),
    (110e3, 9.661e-8, 7_263.0),
    (120e3, 2.438e-8, 9_473.0),
    (130e3, 8.484e-9, 12_636.0),
    (140e3, 3.845e-9, 16_149.0),
    (150e3, 2.070e-9, 22_523.0),
    (180e3, 5.464e-10, 29_740.0),
    (200e3, 2.789e-10, 37_105.0),
    (250e3, 7.248e-11, 45_546.0),
    (300e3, 2.418e-11, 53_628.0),
    (350e3, 9.518e-12, 53_298.0),
    (400e3, 3.725e-12, 58_515.0),
    (450e3, 1.585e-12, 60_828.0),
    (500e3, 6.967e-13, 63_822.0),
    (600e3, 1.454e-13, 71_835.0),
)
_H = tuple(layer[0] for layer in LAYERS)
_RHO = tuple(layer[1] for layer in LAYERS)
_SCALE = tuple(layer[2] for layer in LAYERS)


@physics
def exponential(h, rho_ref, h_ref, scale_height):
    """Density [kg/m^3] at altitude h [m]: rho_ref exp(-(h - h_ref) / scale_height), at least rho_ref exp(-600).

    Vallado, Fundamentals of Astrodynamics and Applications, 4th ed., eq. (8-33).
    """
    # the inverse of a constant is known before the flight; a quotient would be taken at every step
    return rho_ref * exp(maximum((h_ref - h) * (1.0 / scale_height), VACUUM))


@physics
def layered(h):
    """Density [kg/m^3] at altitude h [m] from Vallado's Table 8-4; its end layers are extended below and above it."""
    rho, base, scale = _RHO[0], _H[0], _SCALE[0]
    for i in range(1, len(_H)):
        inside = h >= _H[i]
        rho, base, scale = where(inside, _RHO[i], rho), where(inside, _H[i], base), where(inside, _SCALE[i], scale)
    return exponential(h, rho, base, scale)


# Textbook atmospheres: density [kg/m^3] at the ground, scale height [m].  The one of Venus is a fit at the ground
# and far too thin aloft: a mathematical test, no model of the planet.
EXPONENTIALS = {"earth": (1.225, 7200.0), "mars": (0.020, 11_100.0), "venus": (65.0, 15_900.0)}

# U.S. Standard Atmosphere, 1976 (NOAA-S/T 76-1562), tables 2 to 4: radius for the geopotential altitude [m], gas
# constant of air R*/M0 [J/(kg K)], g0 M0 / R* [K/m], and of each layer the base [geopotential m] and the lapse rate
# [K/m].
GEOPOTENTIAL_RADIUS = 6_356_766.0
GAS_CONSTANT = 8314.32 / 28.9644
_G_OVER_R = 9.80665 / GAS_CONSTANT
_US76_LAYERS = (
    (0.0, -6.5e-3),
    (11e3, 0.0),
    (20e3, 1.0e-3),
    (32e3, 2.8e-3),
    (47e3, 0.0),
    (51e3, -2.8e-3),
    (71e3, -2.0e-3),
)
# Geometric altitude [m] and density [kg/m^3] of the same standard's table I; between them the logarithm of the
# density is linear.  The first is the top of the layers, whose density is their own.
US76_TOP = 86e3
_US76_ALOFT = (
    (90e3, 3.416e-6),
    (95e3, 1.393e-6),
    (100e3, 5.604e-7),
    (105e3, 2.325e-7),
    (110e3, 9.708e-8),
    (115e3, 4.289e-8),
    (120e3, 2.222e-8),
    (130e3, 8.152e-9),
    (150e3, 2.076e-9),
    (200e3, 2.541e-10),
)


def _layer_constants():
    """(constants of each layer, ln rho at the top of the last).

    The constants are (base, T at zero, lapse rate, a, b, c): T = T at zero + lapse x, ln rho = a + b ln T + c x.  x [m]
    is the geopotential altitude.  b is zero where the layer is isothermal, else c is.
    """
    rows = []
    temperature, log_density = 288.15, math.log(101_325.0 / (GAS_CONSTANT * 288.15))
    highest = GEOPOTENTIAL_RADIUS * US76_TOP / (GEOPOTENTIAL_RADIUS + US76_TOP)
    tops = *(base for base, _ in _US76_LAYERS[1:]), highest
    for (base, lapse), top in zip(_US76_LAYERS, tops, strict=True):
        b = -(1.0 + _G_OVER_R / lapse) if lapse else 0.0
        c = 0.0 if lapse else -_G_OVER_R / temperature
        a = log_density - b * math.log(temperature) - c * base
        rows.append((base, temperature - lapse * base, lapse, a, b, c))
        temperature += lapse * (top - base)
        log_density = a + b * math.log(temperature) + c * top
    return tuple(rows), log_density


def aloft_constants(logarithm_at_top, table):
    """Of each interval above 86 km (base [m], a, c): the logarithm of a tabulated quantity is a + c h."""
    nodes = [(US76_TOP, logarithm_at_top), *((h, math.log(value)) for h, value in table)]
    slopes = [(y1 - y0) / (h1 - h0) for (h0, y0), (h1, y1) in pairwise(nodes)]
    return tuple((h, y - c * h, c) for (h, y), c in zip(nodes, slopes, strict=False))


_LAYERS, _TOP_LOG_DENSITY = _layer_constants()
_ALOFT = aloft_constants(_TOP_LOG_DENSITY, _US76_ALOFT)
_BASE, _T0, _LAPSE, _A, _B, _C = tuple(zip(*_LAYERS, strict=True))
_ALOFT_BASE, _ALOFT_A, _ALOFT_C = tuple(zip(*_ALOFT, strict=True))


@physics
def us76_logarithm(h):
    """(ln rho, its slope [1/m], molecular-scale temperature [K]) at geometric altitude h [m].

    U.S. Standard Atmosphere, 1976, eqs (18), (23), (33a), (33b): exact to 86 km.  Above, its tabulated densities with
    linear interpolation of the logarithm: up to 8 % too high to 150 km, up to 15 % to 200 km.  Beyond, it is
    extrapolated, to ln rho = -600: a fifth of the standard's density at 300 km, a fiftieth at 400 km; use `layered`
    there.  Above 86 km the temperature is constant, fit only for a Mach number.  Below the ground the lowest layer is
    extended.
    """
    # both sides of 86 km are computed, so the altitude of each stays within its own
    low = minimum(h, US76_TOP)
    stretch = GEOPOTENTIAL_RADIUS / (GEOPOTENTIAL_RADIUS + low)
    x = stretch * low
    t0, lapse, a, b, c = _T0[0], _LAPSE[0], _A[0], _B[0], _C[0]
    for i in range(1, len(_BASE)):
        inside = x >= _BASE[i]
        t0, lapse = where(inside, _T0[i], t0), where(inside, _LAPSE[i], lapse)
        a, b, c = where(inside, _A[i], a), where(inside, _B[i], b), where(inside, _C[i], c)
    temperature = t0 + lapse * x
    value = a + b * log(temperature) + c * x
    slope = (b * lapse / temperature + c) * (stretch * stretch)
    a, c = _ALOFT_A[0], _ALOFT_C[0]
    for i in range(1, len(_ALOFT_BASE)):
        inside = h >= _ALOFT_BASE[i]
        a, c = where(inside, _ALOFT_A[i], a), where(inside, _ALOFT_C[i], c)
    aloft = h >= US76_TOP
    return where(aloft, maximum(a + c * h, VACUUM), value), where(aloft, c, slope), temperature


@physics
def us76(h):
    """Density [kg/m^3] of the U.S. Standard Atmosphere, 1976, at geometric altitude h [m]; see `us76_logarithm`."""
    return exp(us76_logarithm(h)[0])


def us76_of_array(h: np.ndarray) -> np.ndarray:
    """Density [kg/m^3] as `us76`, to nearly all digits, for float64[...] h [m].  NumPy: for designs before a flight."""
    low = np.minimum(h, US76_TOP)
    x = GEOPOTENTIAL_RADIUS / (GEOPOTENTIAL_RADIUS + low) * low
    t0, lapse, a, b, c = np.array(_LAYERS)[np.maximum(np.searchsorted(_BASE, x, "right") - 1, 0), 1:].T
    _, aloft_a, aloft_c = np.array(_ALOFT)[np.maximum(np.searchsorted(_ALOFT_BASE, h, "right") - 1, 0)].T
    below = a.T + b.T * np.log(t0.T + lapse.T * x) + c.T * x
    return np.exp(np.where(np.asarray(h) >= US76_TOP, np.maximum(aloft_a.T + aloft_c.T * h, VACUUM), below))
