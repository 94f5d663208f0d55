"""Closed forms of entry in the Earth's exponential atmosphere, with which flights are compared.  NumPy.

Speeds are in m/s, angles in degrees; a flight-path angle is negative down.  H0 is the scale height.
"""

import numpy as np
import scipy  # loads its packages when they are used

from mc_engine.physics.atmosphere import EXPONENTIALS
from mc_engine.physics.constants import MU_EARTH, STANDARD_GRAVITY
from mc_engine.physics.frames import WGS84_RADIUS

GROUND_DENSITY, SCALE_M = EXPONENTIALS["earth"]  # kg/m^3, m


def circular_speed(altitude_km):
    """Circular speed [m/s] at an altitude over the sphere."""
    return np.sqrt(MU_EARTH / (WGS84_RADIUS + 1e3 * altitude_km))


def steep_load_g(speed, angle_deg):
    """Largest load [g] of a straight entry without gravity, whatever the vehicle: V^2 sin(angle) / (2 e H0).

    H. J. Allen, A. J. Eggers, NACA Rep. 1381 (1958), eq. (15).
    """
    return speed**2 * abs(np.sin(np.radians(angle_deg))) / (2.0 * np.e * SCALE_M) / STANDARD_GRAVITY


def shallow_peak(slope: float) -> float:
    """Largest Y exp(-2 x) of a ballistic entry at circular speed: Y Y'' = exp(2 x) - 1, Y(0) = 0, Y'(0) = slope.

    Times g sqrt(R/H0) it is the largest deceleration; slope = -angle [rad] sqrt(R/H0).  V. A. Yaroshevsky (1964);
    D. R. Chapman, NASA TR R-11 (1959), whose Z is Y exp(-x).
    """
    # away from the singular start on the series Y = sqrt(8/3) x^1.5 (1 + x/6 ...), or slope x + x^2/slope ...
    if slope == 0.0:
        x0, c = 1e-5, np.sqrt(8.0 / 3.0)
        first = [c * x0**1.5 * (1.0 + x0 / 6.0), 1.5 * c * x0**0.5 * (1.0 + 5.0 / 18.0 * x0)]
    else:
        x0 = min(1e-5, 1e-4 * slope**2)
        first = [slope * x0 + x0**2 / slope, slope + 2.0 * x0 / slope]

    def rates(x, y):
        """(Y', Y'') of (Y, Y') by Y Y'' = exp(2 x) - 1; x and Y have no unit."""
        return y[1], np.expm1(2.0 * x) / y[0]

    # beyond x = 2.5 the speed is below a twelfth of the first
    path = scipy.integrate.solve_ivp(rates, (x0, 2.5), first, "DOP853", rtol=1e-11, atol=1e-16, dense_output=True).sol
    top = scipy.optimize.minimize_scalar(lambda x: -path(x)[0] * np.exp(-2.0 * x), bounds=(0.2, 2.4), method="bounded")
    return -float(top.fun)


def grazing_load_g(root_beta_r: float) -> float:
    """Largest load [g] of a grazing ballistic entry, as Chapman has it; root_beta_r : sqrt(R/H0)."""
    return root_beta_r * shallow_peak(0.0)


def critical_roll_deg(entry_angle_deg: float) -> float:
    """Climb angle [deg] up to which a roll to lift down keeps a skip below its entry altitude, whatever K_L and L/D.

    cos = (1 + cos(entry angle)) / 2; from eqs (10)-(16) of the source.
    """
    return float(np.degrees(np.arccos(0.5 * (1.0 + np.cos(np.radians(entry_angle_deg))))))


def glide_range_km(speed: float = 0.95) -> float:
    """Range [km] of an equilibrium glide at L/D 1, from a speed in circular speeds.

    A. J. Eggers, H. J. Allen, S. E. Neice, NACA Rep. 1382 (1958).
    """
    return 0.5 * 1e-3 * WGS84_RADIUS * float(np.log(1.0 / (1.0 - speed**2)))


def glide_angle_deg(speed: float, radius: float) -> float:
    """Flight-path angle of the same glide at a distance from the centre [m]: -2 H0 / (R V^2) in radians."""
    return float(np.degrees(-2.0 * SCALE_M / (radius * speed**2)))
