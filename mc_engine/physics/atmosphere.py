"""Atmospheric density models: one function per model, density in kg/m^3.

`exponential` is one layer; `layered` joins the layers of Vallado's table from 100 to 700 km and is for
orbits and de-orbit arcs (tens of percent of day-to-day variation are not modelled).
"""

from mc_engine.lanes import exp, physics, where

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
    """Density [kg/m^3] at altitude h [m]: rho_ref exp(-(h - h_ref) / scale_height).

    Vallado, Fundamentals of Astrodynamics and Applications, 4th ed., eq. (8-33).
    """
    # the inverse of a constant is known before the flight; a quotient would be taken at every step
    return rho_ref * exp((h_ref - h) * (1.0 / scale_height))


@physics
def layered(h):
    """Density [kg/m^3] at altitude h [m] from Vallado's Table 8-4; the end layers go on below and above it."""
    rho, base, scale = _RHO[0], _H[0], _SCALE[0]
    for i in range(1, len(_H)):
        inside = h >= _H[i]
        rho, base, scale = where(inside, _RHO[i], rho), where(inside, _H[i], base), where(inside, _SCALE[i], scale)
    return exponential(h, rho, base, scale)
