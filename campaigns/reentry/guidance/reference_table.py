"""Layout of a stored reference path in the tables, one for all cases of a plan, and its reading in flight; SI.

Two tables of eight columns, one over the speed, one over the speed lost W that an accelerometer has counted.  Rows
are equally spaced in ln(1 + x / SPREAD) with x the speed lost since the first row: close where the air is thin and
the range runs fast, wide where all is slow.  Between rows everything is linear.
"""

from collections import namedtuple

import numpy as np

from mc_engine.lanes import floor, log, look_up, look_up_record, maximum, minimum, physics
from mc_engine.physics.constants import STANDARD_GRAVITY

FELT = 0.05 * STANDARD_GRAVITY  # axial deceleration from which on the speed lost is counted
STEERED = 0.15 * STANDARD_GRAVITY  # drag from which on a law commands: earlier the speed may still rise
LAST_SPEED = 400.0  # m/s, below which the reference bank is held

ROWS, COLUMNS = 512, 8
LAST_PLACE = ROWS - 1.000001  # among the rows
SPREAD = 60.0  # m/s
# speed of the first row [m/s]; rows per unit of the logarithm, of both tables; range of the whole reference [m]; the
# same quantities as the clock tells them before the air is felt (see `clocked_range`)
Header = namedtuple(
    "Header", "first_speed speed_density lost_density range clock_time clock_range clock_rate clock_bend"
)
SPEED_TABLE = len(Header._fields)
LOST_TABLE = SPEED_TABLE + ROWS * COLUMNS

# SI; drag is an acceleration, climb the rate of the altitude; k_..: gains on the three differences
BySpeed = namedtuple("BySpeed", "altitude path range drag climb k_altitude k_path k_range")
ByLoss = namedtuple("ByLoss", "axial log_axial speed range_rate range k_altitude k_path k_range")
# over the speed for the Apollo final phase: influence of drag, climb and lift-to-drag ratio on the range
Influence = namedtuple("Influence", "climb drag range by_drag by_climb by_lift unused also_unused")
# Its numbers as flown: R. Morth, Reentry guidance for Apollo, MIT Instrumentation Laboratory R-532 (1966), converted to
# speed [m/s], climb [m/s], drag [m/s^2], range to go [km], influences [km s^2/m], [km s/m], [km]
FLOWN = (
    (303.0, -210.5, 12.538, 4.0, -0.211, 0.01524, 22.5),
    (641.0, -219.1, 18.288, 16.5, -0.337, 0.02176, 40.4),
    (1195.4, -211.4, 24.841, 40.9, -0.549, 0.04277, 80.2),
    (1918.7, -185.5, 28.621, 85.7, -0.857, 0.08786, 179.1),
    (2600.2, -150.2, 30.023, 139.6, -1.202, 0.15063, 347.1),
    (3078.8, -126.7, 31.181, 185.0, -1.441, 0.20604, 522.6),
    (4271.5, -107.2, 36.180, 316.5, -2.008, 0.37301, 610.0),
    (4861.9, -126.7, 38.161, 389.5, -2.190, 0.46683, 862.1),
    (5595.2, -172.4, 36.698, 494.1, -3.011, 0.60652, 1264.4),
    (6348.7, -238.0, 29.078, 637.6, -3.939, 0.81116, 1815.9),
    (7037.8, -282.4, 8.565, 934.9, -12.280, 1.32155, 2565.0),
    (7162.8, -249.8, 1.951, 1190.8, -20.379, 1.85078, 2792.8),
)
REFERENCE_LIFT_TO_DRAG, OVERCONTROL = 0.18, 4.0


def influence_rows() -> tuple[np.ndarray, list[np.ndarray]]:
    """(falling speed [m/s], columns of `Influence` in SI), finely resampled between the flown rows."""
    rows = np.array(FLOWN)[::-1]
    speed = np.union1d(np.linspace(rows[-1, 0], rows[0, 0], 4001), rows[:, 0])[::-1]
    columns = [np.interp(-speed, -rows[:, 0], column) for column in rows.T[1:]]
    scales = (1.0, 1.0, 1e3, 1e3, 1e3, 1e3)
    zero = np.zeros_like(speed)
    return speed, [*(scale * column for scale, column in zip(scales, columns, strict=True)), zero, zero]


@physics
def between_rows(tables, at, columns, f):
    """Linear interpolation, at the fraction f, from the number at index `at` to the one below it in the next row."""
    here = look_up(tables, at)
    return here + f * (look_up(tables, at + columns) - here)


@physics
def _interpolated_row(tables, start, density, x):
    """The eight columns at a speed lost x [m/s]; the first and the last row stand for what lies beyond."""
    place = log(1.0 + maximum(x, 0.0) * (1.0 / SPREAD)) * density
    place = minimum(maximum(place, 0.0), LAST_PLACE)
    row = floor(place)
    f, at = place - row, start + COLUMNS * row
    return (
        between_rows(tables, at, COLUMNS, f), between_rows(tables, at + 1.0, COLUMNS, f),
        between_rows(tables, at + 2.0, COLUMNS, f), between_rows(tables, at + 3.0, COLUMNS, f),
        between_rows(tables, at + 4.0, COLUMNS, f), between_rows(tables, at + 5.0, COLUMNS, f),
        between_rows(tables, at + 6.0, COLUMNS, f), between_rows(tables, at + 7.0, COLUMNS, f),
    )  # fmt: skip


@physics
def by_speed(tables, first, speed):
    """The row of the speed table at a speed [m/s]; here and below, first : place where the reference begins."""
    h = look_up_record(tables, first, Header)
    return _interpolated_row(tables, first + SPEED_TABLE, h.speed_density, h.first_speed - speed)


@physics
def by_loss(tables, first, lost):
    """The row of the other table at a speed lost W [m/s]."""
    h = look_up_record(tables, first, Header)
    return ByLoss(*_interpolated_row(tables, first + LOST_TABLE, h.lost_density, lost))


@physics
def clocked_range(tables, first, t):
    """Range [m] of the reference at a time t [s] after entry, before the air is felt; then on at the last rate."""
    h = look_up_record(tables, first, Header)
    early = minimum(t, h.clock_time) - h.clock_time
    return h.clock_range + h.clock_rate * (t - h.clock_time) + h.clock_bend * (early * early)
