"""Layout of a burn program in the tables that all cases share, and its reading in flight.  SI."""

from collections import namedtuple

import numpy as np

from campaigns.geo_injection.design.program import DEGREE, Program
from mc_engine.lanes import look_up, physics

TERMS = 3 * (DEGREE + 1)
BURNS = 3  # rows; unused ones are zero
_BURN_ROW, _SEGMENT_ROW = 6, 4 + TERMS
N_BURNS, N_SEGMENTS, AIM = 0, 1, 2  # header; from AIM on: what `aiming` keeps of the nominal last burn
AIM_NUMBERS = 6
_FIRST_BURN = AIM + AIM_NUMBERS
_FIRST_SEGMENT = _FIRST_BURN + BURNS * _BURN_ROW

# ignition: after the first;  sensed: speed change that an accelerometer counts;  end_mass: nominal, at the cut-off
# first: number of the burn's first segment;  segments: how many it has
BurnRow = namedtuple("BurnRow", "ignition duration sensed end_mass first segments")
# start, length: of the time since ignition;  more: 1.0 if another segment of the same burn follows
SegmentRow = namedtuple("SegmentRow", "start length more")
# coefficients of the three components of the primer vector, powers of s rising
TERM_NAMES = tuple(f"{axis}{power}" for axis in "xyz" for power in range(DEGREE + 1))


@physics
def n_burns(tables):
    """Number of burns."""
    return look_up(tables, N_BURNS)


@physics
def burn_row(tables, burn):
    """The row of a burn, counted from 0, SI."""
    at = _FIRST_BURN + _BURN_ROW * burn
    return BurnRow(
        look_up(tables, at),
        look_up(tables, at + 1.0),
        look_up(tables, at + 2.0),
        look_up(tables, at + 3.0),
        look_up(tables, at + 4.0),
        look_up(tables, at + 5.0),
    )


@physics
def segment_row(tables, segment):
    """The row of a segment [s], counted from 0 over all burns, without its steering."""
    at = _FIRST_SEGMENT + _SEGMENT_ROW * segment
    return SegmentRow(look_up(tables, at), look_up(tables, at + 1.0), look_up(tables, at + 2.0))


@physics
def steering_row(tables, segment):
    """The steering of a segment: 36 coefficients (no unit) in the order of TERM_NAMES."""
    at = _FIRST_SEGMENT + _SEGMENT_ROW * segment + 4.0
    return (
        look_up(tables, at), look_up(tables, at + 1.0), look_up(tables, at + 2.0), look_up(tables, at + 3.0),
        look_up(tables, at + 4.0), look_up(tables, at + 5.0), look_up(tables, at + 6.0), look_up(tables, at + 7.0),
        look_up(tables, at + 8.0), look_up(tables, at + 9.0), look_up(tables, at + 10.0), look_up(tables, at + 11.0),
        look_up(tables, at + 12.0), look_up(tables, at + 13.0), look_up(tables, at + 14.0), look_up(tables, at + 15.0),
        look_up(tables, at + 16.0), look_up(tables, at + 17.0), look_up(tables, at + 18.0), look_up(tables, at + 19.0),
        look_up(tables, at + 20.0), look_up(tables, at + 21.0), look_up(tables, at + 22.0), look_up(tables, at + 23.0),
        look_up(tables, at + 24.0), look_up(tables, at + 25.0), look_up(tables, at + 26.0), look_up(tables, at + 27.0),
        look_up(tables, at + 28.0), look_up(tables, at + 29.0), look_up(tables, at + 30.0), look_up(tables, at + 31.0),
        look_up(tables, at + 32.0), look_up(tables, at + 33.0), look_up(tables, at + 34.0), look_up(tables, at + 35.0),
    )  # fmt: skip


def table_of(program: Program, aim: np.ndarray) -> np.ndarray:
    """The program as one array; aim : float64[AIM_NUMBERS], see `aiming.py`."""
    sequence = program.sequence
    out = np.zeros(_FIRST_SEGMENT + _SEGMENT_ROW * sum(len(burn.segments) for burn in program.burns))
    out[N_BURNS] = len(program.burns)
    out[AIM : AIM + AIM_NUMBERS] = aim
    mass, count = sequence.mass, 0
    for k, burn in enumerate(program.burns):
        end = mass - sequence.mass_flow * burn.duration
        sensed = sequence.exhaust * np.log(mass / end)
        row = _FIRST_BURN + _BURN_ROW * k
        out[row : row + _BURN_ROW] = burn.ignition, burn.duration, sensed, end, count, len(burn.segments)
        for i, segment in enumerate(burn.segments):
            at = _FIRST_SEGMENT + _SEGMENT_ROW * count
            out[at : at + 3] = segment.start, segment.length, float(i + 1 < len(burn.segments))
            out[at + 4 : at + _SEGMENT_ROW] = segment.steering.ravel()
            count += 1
        mass = end
    out[N_SEGMENTS] = count
    return out
