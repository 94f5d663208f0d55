"""Closed forms of entry in an exponential atmosphere, with which flights are compared.  NumPy, SI.

Angles are in radians; a flight-path angle is negative down.  B is mass over drag area [kg/m^2], H0 the scale height.
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import quad, solve_ivp
from scipy.optimize import minimize_scalar
from scipy.special import erf


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
        return self.speed**2 * self._steepness / (2.0 * np.e * self.scale)

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


def shallow_peak(slope: float) -> float:
    """Largest Y exp(-2 x) of a ballistic entry at circular speed: Y Y'' = exp(2 x) - 1, Y(0) = 0, Y'(0) = slope.

    Times g sqrt(R/H0) it is the largest deceleration; slope = -angle sqrt(R/H0).  V. A. Yaroshevsky (1964);
    D. R. Chapman, NASA TR R-11 (1959), whose Z is Y exp(-x).
    """
    # away from the singular start on the series Y = sqrt(8/3) x^1.5 (1 + x/6 ...), or slope x + x^2/slope ...
    if slope == 0.0:
        x0, c = 1e-5, np.sqrt(8.0 / 3.0)
        first = [c * x0**1.5 * (1.0 + x0 / 6.0), 1.5 * c * x0**0.5 * (1.0 + 5.0 / 18.0 * x0)]
    else:
        x0 = min(1e-5, 1e-4 * slope**2)
        first = [slope * x0 + x0**2 / slope, slope + 2.0 * x0 / slope]
    # beyond x = 2.5 the speed is below a twelfth of the first
    path = solve_ivp(
        lambda x, y: (y[1], np.expm1(2.0 * x) / y[0]),
        (x0, 2.5),
        first,
        "DOP853",
        rtol=1e-11,
        atol=1e-16,
        dense_output=True,
    )
    top = minimize_scalar(lambda x: -path.sol(x)[0] * np.exp(-2.0 * x), bounds=(0.2, 2.4), method="bounded")
    return -float(top.fun)


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


def critical_roll_angle(angle: float) -> float:
    """Climb angle [rad] up to which a roll to lift down keeps a skip below its entry altitude.

    cos = (1 + cos(entry angle)) / 2, whatever K_L and L/D; from eqs (10)-(16) of the source.
    """
    return float(np.arccos(0.5 * (1.0 + np.cos(angle))))


def glide_range(lift_to_drag: float, first: float, last: float, radius: float) -> float:
    """Range [m] of an equilibrium glide between two speeds, in circular speeds, at a distance `radius` [m].

    A. J. Eggers, H. J. Allen, S. E. Neice, NACA Rep. 1382 (1958).
    """
    return 0.5 * radius * lift_to_drag * float(np.log((1.0 - last**2) / (1.0 - first**2)))


def glide_angle(lift_to_drag: float, speed: float, radius: float, scale: float) -> float:
    """Flight-path angle [rad] of an equilibrium glide at a speed in circular speeds."""
    return -2.0 * scale / (radius * lift_to_drag * speed**2)
