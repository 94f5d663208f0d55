"""Entries in an exponential atmosphere in closed form: straight down through it, and skipping off it.

Angles are in radians; a flight-path angle is negative down.  B is mass over drag area [kg/m^2], H0 the scale height.
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import quad
from scipy.special import erf

from campaigns.reentry.closed_forms import steep_peak


@dataclass(frozen=True)
class SteepEntry:
    """Straight entry without gravity: H. J. Allen, A. J. Eggers, NACA Rep. 1381 (1958).

    speed [m/s], angle [rad] at entry;  b : B [kg/m^2];  density [kg/m^3] at the ground;  scale : H0 [m]
    """

    speed: float
    angle: float
    b: float
    density: float
    scale: float

    @property
    def _steepness(self) -> float:
        return abs(np.sin(self.angle))

    @property
    def _depth(self) -> float:
        """rho0 H0 / (B s), without unit: how much air there is down to the ground.  Allen, Eggers (1958)."""
        return self.density * self.scale / (self.b * self._steepness)

    def speed_at(self, altitude):
        """Speed [m/s] at an altitude [m]."""
        return self.speed * np.exp(-0.5 * self._depth * np.exp(-altitude / self.scale))

    @property
    def peak_deceleration(self) -> float:
        """Largest deceleration [m/s^2]: it does not depend on B."""
        return steep_peak(self.speed, self.angle, self.scale)

    @property
    def peak_altitude(self) -> float:
        """Altitude [m] of the largest deceleration, where the speed is exp(-1/2) of that at entry."""
        return self.scale * np.log(self._depth)

    @property
    def peak_heating_altitude(self) -> float:
        """Altitude [m] of the largest heat rate k sqrt(rho/R) V^3, where the speed is exp(-1/6) of that at entry."""
        return self.scale * np.log(3.0 * self._depth)

    def heat_load(self, coefficient: float) -> float:
        """Heat load [J/m^2] down to the ground for a heat rate coefficient sqrt(rho) V^3."""
        root = np.sqrt(np.pi * self.b * self.scale / self._steepness)
        return coefficient * self.speed**2 * root * erf(np.sqrt(self._depth))


@dataclass(frozen=True)
class Skip:
    """Skip without gravity over a flat Earth: E. Sänger's bomber; the source's eqs (7)-(13).

    speed [m/s], angle [rad, negative], altitude [m] at entry;  lift_to_drag : L/D
    k : K_L H0 = C_L A rho0 H0 / (2 m);  scale : H0 [m]
    """

    speed: float
    angle: float
    altitude: float
    lift_to_drag: float
    k: float
    scale: float

    def speed_at(self, angle):
        """Speed [m/s] where the flight-path angle has come to `angle`."""
        return self.speed * np.exp(-(angle - self.angle) / self.lift_to_drag)

    @property
    def exit_speed(self) -> float:
        """Speed [m/s] at exit, where the flight-path angle is the opposite of that at entry."""
        return float(self.speed_at(-self.angle))

    def altitude_at(self, angle):
        """Altitude [m] where the flight-path angle is `angle`; the pull-out is at 0."""
        thin = np.exp(-self.altitude / self.scale) + (np.cos(angle) - np.cos(self.angle)) / self.k
        return -self.scale * np.log(thin)

    @property
    def range(self) -> float:
        """Distance [m] from entry to exit."""
        c = np.cos(self.angle) - self.k * np.exp(-self.altitude / self.scale)
        return 2.0 * self.scale * quad(lambda x: np.cos(x) / (np.cos(x) - c), 0.0, -self.angle, epsabs=0.0)[0]
