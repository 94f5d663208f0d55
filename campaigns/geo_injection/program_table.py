"""Layout of a burn program in the tables that all cases share, and its reading in flight.  SI.

The tables are a `Nominal`, a `BurnRow` for each of `BURNS` burns, and of each segment a `SegmentRow` with its steering.
"""

from collections import namedtuple

import numpy as np

from campaigns.geo_injection.design.program import DEGREE, Program
from mc_engine.lanes import look_up_record, physics

BURNS = 3  # rows; unused ones are zero
# burns: their number;  x, y, z, size: unit vector and size of the impulse that stands for the nominal last burn
# angle: of that impulse from the node, or, where planar is 1.0, from the perigee; see `aiming.py`
Nominal = namedtuple("Nominal", "burns x y z size angle planar")
# ignition: after the first;  sensed: speed change that an accelerometer counts;  end_mass: nominal, at the cut-off
# first: number of the burn's first segment
BurnRow = namedtuple("BurnRow", "ignition duration sensed end_mass first")
# start, length: of the time since ignition;  more: 1.0 if another segment of the same burn follows
SegmentRow = namedtuple("SegmentRow", "start length more")
# the three components of the primer vector, each with the coefficients of its powers of s
Steering = namedtuple("Steering", "x y z")
Polynomial = namedtuple("Polynomial", [f"c{power}" for power in range(DEGREE + 1)])  # type: ignore[misc]

_BURN_ROW, _TERMS = len(BurnRow._fields), len(Polynomial._fields)
_STEERING = len(SegmentRow._fields)
_SEGMENT_ROW = _STEERING + len(Steering._fields) * _TERMS
_FIRST_BURN = len(Nominal._fields)
_FIRST_SEGMENT = _FIRST_BURN + BURNS * _BURN_ROW


@physics
def nominal(tables):
    """Number of burns, and the impulse of the nominal last one [m/s, rad]."""
    return look_up_record(tables, 0, Nominal)


@physics
def burn_row(tables, burn):
    """The row of a burn, counted from 0, SI."""
    return look_up_record(tables, _FIRST_BURN + _BURN_ROW * burn, BurnRow)


@physics
def segment_row(tables, segment):
    """The row of a segment [s], counted from 0 over all burns, and its steering, no unit."""
    at = _FIRST_SEGMENT + _SEGMENT_ROW * segment
    x = look_up_record(tables, at + _STEERING, Polynomial)
    y = look_up_record(tables, at + _STEERING + _TERMS, Polynomial)
    z = look_up_record(tables, at + _STEERING + 2.0 * _TERMS, Polynomial)
    return look_up_record(tables, at, SegmentRow), Steering(x=x, y=y, z=z)


def table_of(program: Program, impulse: Nominal) -> np.ndarray:
    """The program as one array, SI; sensed speed changes by the rocket equation."""
    sequence, mass = program.sequence, program.sequence.mass
    burns = np.zeros((BURNS, _BURN_ROW))
    segments: list[list[float]] = []
    for numbers, burn in zip(burns, program.burns, strict=False):
        end = mass - sequence.mass_flow * burn.duration_s
        sensed = sequence.thrust / sequence.mass_flow * np.log(mass / end)
        numbers[:] = BurnRow(burn.ignition_s, burn.duration_s, sensed=sensed, end_mass=end, first=len(segments))
        for segment in burn.segments:
            more = float(segment is not burn.segments[-1])
            row = SegmentRow(segment.start_s, segment.length_s, more)
            segments.append([*row, *segment.x, *segment.y, *segment.z])
        mass = end
    return np.concatenate([impulse, *burns, *segments])
