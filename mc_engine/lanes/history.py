"""Rows of time histories, written by the loops: each lane has its own rows, at its own steps, events and samples.

A control sample has two rows at the same time, before and after it.  An event has three, one before and two after, by
which it is recognised.  Rows beyond the space are counted too, so a flight with space for one row finds their number.

history : float64[n_lanes * (1 + n_quantities), n_rows], for each lane the times [s] and every output, each contiguous
rows : int64[n_lanes], how many rows each lane has so far

Further lanes record nothing, nor does a flight with an empty history.  A flight with a history has no more cases than
lanes, because a lane would add the rows of its next case to those of the first.
"""

from mc_engine.lanes.adaptive_step import glance
from mc_engine.lanes.compiler import compile_callable, compile_inline
from mc_engine.lanes.functions import any_lane, where
from mc_engine.lanes.lane_access import record
from mc_engine.lanes.tuples import spread


def _look(f, t, s, m, p, o):
    return spread(f.observe(t, s, m, p, o), t)


# for places off the main path: one copy in the kernel, called where needed
look_shared = compile_callable(_look)


def _record_row(f, history, rows, lanes, t, s, m, p, o):
    """Write one row at this instant, in the lanes where the mask holds."""
    if any_lane(lanes):
        record(history, rows, lanes, t, look_shared(f, t, s, m, p, o))


record_row = compile_callable(_record_row)


def _record_change(f, history, rows, lanes, events, t, s, m, p, o):
    """Write the rows of the instant behind a sample of the control or, in the lanes `events`, behind an event."""
    for _ in range(2):
        record_row(f, history, rows, lanes, t, s, m, p, o)
        lanes = lanes & events


record_change = compile_inline(_record_change)


def _record_step(f, tables, history, rows, lanes, parts, here, now, p, o):
    """Write the rows of one adaptive step, at its end and between its equal parts, of which each lane has its own.

    A row between is a step of its own from the same start.
    """
    part = 0.0 * parts + 1.0
    between = lanes & (part < parts)
    while any_lane(between):
        length = where(between, (now.t - here.t) * (part / parts), 0.0)
        end = glance(f, tables, length, here, p, o)
        record_row(f, history, rows, between, here.t + length, end, here.m, p, o)
        part = part + 1.0
        between = between & (part < parts)
    record_row(f, history, rows, lanes, now.t, now.s, here.m, p, o)


record_step = compile_inline(_record_step)
