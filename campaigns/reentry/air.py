"""Air along an entry: the atmosphere of the scenario and the slow part of its uncertainty."""

import math

from campaigns.reentry.inputs import CHOICES
from mc_engine.lanes import any_lane, physics, sqrt, where
from mc_engine.physics.atmosphere import us76_logarithm

GAS_CONSTANT = 287.05287  # of air [J/(kg K)], U.S. Standard Atmosphere, 1976
HEAT_RATIO = 1.4

# Slow density uncertainty, of the class of the Global Reference Atmosphere Models (Leslie, Justus,
# NASA/TM-2011-216467): three sigma in five bands of altitude.  Log-normal, so that +3 sigma is exactly the share
# below; linear between the middles of the bands, so that the density has no steps, and constant above the last.
_BASE = (15e3, 45e3, 70e3, 90e3, 110e3)
_SIGMA = tuple(math.log1p(share) / 3.0 for share in (0.10, 0.15, 0.30, 0.45, 0.60))
_SLOPE = (*((_SIGMA[i + 1] - _SIGMA[i]) / (_BASE[i + 1] - _BASE[i]) for i in range(4)), 0.0)


@physics
def slow_sigma(h):
    """(1-sigma of the logarithm of the density, its slope [1/m]) of the slow part at altitude h [m]."""
    base, sigma, slope = _BASE[0], _SIGMA[0], 0.0
    for i in range(len(_SLOPE)):
        inside = h >= _BASE[i]
        base, sigma = where(inside, _BASE[i], base), where(inside, _SIGMA[i], sigma)
        slope = where(inside, _SLOPE[i], slope)
    return sigma + slope * (h - base), slope


@physics
def logarithm_of_density(h, p, o):
    """(ln rho, its slope [1/m], temperature [K]) at altitude h [m], without the constant density factor."""
    if o.atmosphere == CHOICES.atmosphere.us76:
        value, slope, temperature = us76_logarithm(h)
    else:
        value, slope, temperature = p.log_density - p.inverse_scale * h, -p.inverse_scale, p.temperature
    if any_lane(abs(p.density_deviation) > 0.0):
        sigma, change = slow_sigma(h)
        value, slope = value + p.density_deviation * sigma, slope + p.density_deviation * change
    return value, slope, temperature


@physics
def sound_speed(temperature):
    """Speed of sound in air [m/s]; an exponential atmosphere has the temperature that its scale height belongs to."""
    return sqrt(HEAT_RATIO * GAS_CONSTANT * temperature)
