"""Layout of a stored reference path in the tables, one for all cases of a plan, and its reading in flight.

Two tables of eight columns, one over the speed, one over the speed lost W that an accelerometer has counted.  Rows
are equally spaced in ln(1 + x / SPREAD) with x the speed lost since the first row: close where the air is thin and
the range runs fast, wide where all is slow.  Between rows everything is linear.
"""

from collections import namedtuple

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
# the flown table of the Apollo final phase: influence of drag, climb and lift-to-drag ratio on the range
Influence = namedtuple("Influence", "climb drag range by_drag by_climb by_lift unused also_unused")


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
