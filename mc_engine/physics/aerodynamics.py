"""Lift, drag and axial force of a vehicle at its trim angle of attack, with coefficients that may go by Mach number.

A table of two columns over the Mach number lies in a model's tables at equal steps, as `mach_table` writes it, and
`over_mach` reads it.
"""

from collections.abc import Sequence

import numpy as np

from mc_engine.lanes import floor, look_up, maximum, physics, sqrt, where

FADING = 0.01  # rad from the vertical
STEPS_PER_MACH = 20.0  # rows of a table, close enough that every printed Mach number of two digits is one of them
_HEADER = 2  # Mach number of the first row, place of the last row


@physics
def lift_direction(vx, vy, vz, ux, uy, uz, speed, cos_bank, sin_bank):
    """Unit vector of the lift, across the velocity v.

    u : unit vector up;  speed : length of v.  At bank 0 the lift is in the vertical plane and points up, at 90 degrees
    it is level and points to the right of the flight.  In vertical flight that has no meaning: within 0.01 rad of the
    vertical the vector becomes shorter, down to nothing.
    """
    rx, ry, rz = vy * uz - vz * uy, vz * ux - vx * uz, vx * uy - vy * ux  # to the right, as long as the level speed
    level = maximum(sqrt(rx * rx + ry * ry + rz * rz), FADING * speed)
    still = speed <= 0.0
    side = sin_bank / where(still, 1.0, level)
    ahead = cos_bank / where(still, 1.0, level * speed)
    return (
        ahead * (ry * vz - rz * vy) + side * rx,
        ahead * (rz * vx - rx * vz) + side * ry,
        ahead * (rx * vy - ry * vx) + side * rz,
    )


@physics
def axial_coefficient(drag_coefficient, lift_coefficient, cos_trim, sin_trim):
    """Force coefficient along the body axis at the trim angle of attack: C_D cos + C_L sin."""
    return drag_coefficient * cos_trim + lift_coefficient * sin_trim


def mach_table(points: Sequence[tuple[float, float, float]]) -> np.ndarray:
    """What `over_mach` reads: two columns, linear in the Mach number between the points (Mach, first, second).

    points : rising Mach numbers, each a multiple of 0.05; ValueError if not.  NumPy.
    """
    mach, first, second = np.array(points, dtype=float).T
    places = STEPS_PER_MACH * mach
    if (np.diff(mach) <= 0.0).any() or np.abs(places - np.rint(places)).max() > 1e-9:
        raise ValueError("the Mach numbers of a table rise, in multiples of 0.05")
    rows = np.arange(np.rint(places[0]), np.rint(places[-1]) + 1.0) / STEPS_PER_MACH
    columns = np.array([np.interp(rows, mach, first), np.interp(rows, mach, second)]).T
    return np.concatenate([[rows[0], rows.size - 1.0], columns.ravel()])


@physics
def over_mach(tables, first, mach):
    """The two columns at a Mach number, of the table that begins at place `first`.

    The first and the last row stand for what lies beyond them.
    """
    last = look_up(tables, first + 1.0)
    place = maximum(0.0, (mach - look_up(tables, first)) * STEPS_PER_MACH)
    # one instruction in place of the three of `minimum`; a place that is not a number is handed on as well
    place = where(place > last, last, place)
    row = floor(place)
    row = where(row > last - 1.0, last - 1.0, row)
    f, at = place - row, first + _HEADER + 2.0 * row
    a, b = look_up(tables, at), look_up(tables, at + 1.0)
    return a + f * (look_up(tables, at + 2.0) - a), b + f * (look_up(tables, at + 3.0) - b)
