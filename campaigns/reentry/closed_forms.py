"""Closed forms of entry in an exponential atmosphere, with which flights are compared.  NumPy, SI.

Angles are in radians; a flight-path angle is negative down.  B is mass over drag area [kg/m^2], H0 the scale height.
"""

import numpy as np
import scipy  # loads its packages when they are used


def steep_peak(speed: float, angle: float, scale: float) -> float:
    """Largest deceleration [m/s^2] of a straight entry without gravity; it does not depend on B.

    speed [m/s], angle [rad] at entry;  scale : H0 [m].  H. J. Allen, A. J. Eggers, NACA Rep. 1381 (1958), eq. (15).
    """
    return speed**2 * abs(np.sin(angle)) / (2.0 * np.e * scale)


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
    path = scipy.integrate.solve_ivp(
        lambda x, y: (y[1], np.expm1(2.0 * x) / y[0]),
        (x0, 2.5),
        first,
        "DOP853",
        rtol=1e-11,
        atol=1e-16,
        dense_output=True,
    )
    top = scipy.optimize.minimize_scalar(
        lambda x: -path.sol(x)[0] * np.exp(-2.0 * x), bounds=(0.2, 2.4), method="bounded"
    )
    return -float(top.fun)


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
