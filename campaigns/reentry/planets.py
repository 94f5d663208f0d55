"""Planets of the entries: gravity, shape, rotation, textbook atmosphere, heating constant.  SI."""

from collections import namedtuple

import numpy as np

from mc_engine.physics.atmosphere import EXPONENTIALS
from mc_engine.physics.constants import EARTH_RATE, MU_EARTH
from mc_engine.physics.frames import WGS84_ECCENTRICITY2, WGS84_RADIUS
from mc_engine.physics.heating import SUTTON_GRAVES

# mu [m^3/s^2], equatorial radius [m], squared eccentricity, rate [rad/s]; air: density [kg/m^3], scale height [m].
# Only the Earth has an ellipsoid, J2 and a standard atmosphere here.
Planet = namedtuple("Planet", "mu radius e2 rate air heating")
# Mars and Venus: radii and gravitational parameters of D. R. Williams, NASA planetary fact sheets; rotation of
# B. A. Archinal et al., Celestial Mechanics and Dynamical Astronomy 130 (2018) 22.
PLANETS = {
    "earth": Planet(
        MU_EARTH, WGS84_RADIUS, WGS84_ECCENTRICITY2, EARTH_RATE, EXPONENTIALS["earth"], SUTTON_GRAVES["earth"]
    ),
    "mars": Planet(4.2828372e13, 3_396_190.0, 0.0, 7.088218e-5, EXPONENTIALS["mars"], SUTTON_GRAVES["mars"]),
    "venus": Planet(3.24858592e14, 6_051_800.0, 0.0, -2.99245e-7, EXPONENTIALS["venus"], SUTTON_GRAVES["venus"]),
}


def of_planets(codes: np.ndarray, name: str) -> np.ndarray:
    """One number of each case's planet; codes : float64[n], places in PLANETS."""
    return np.array([getattr(planet, name) for planet in PLANETS.values()])[codes.astype(int)]
