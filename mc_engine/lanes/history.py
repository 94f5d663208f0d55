"""Rows of a time history, written by the loops: the first lane's, at its own steps, events and samples of the control.

A sample of the control has two rows of one time, before and after it; an event has three, before and twice after, which
tells it apart.  Rows that find no room are counted all the same: a flight with room for one row tells how many it has.
"""

from mc_engine.lanes.adaptive_step import glance
from mc_engine.lanes.compiler import compile_callable, compile_inline
from mc_engine.lanes.tuples import record, spread


def _look(f, t, s, m, p, o):
    return spread(f.observe(t, s, m, p, o), t)


# for places off the main path: one copy in the kernel, called where needed
look_shared = compile_callable(_look)


def _record_row(f, history, rows, t, s, m, p, o):
    """Number of rows after one at this instant."""
    if rows < history.shape[0]:
        record(history, rows, t, look_shared(f, t, s, m, p, o))
    return rows + 1


record_row = compile_inline(_record_row)


def _record_change(f, history, rows, is_event, t, s, m, p, o):
    """Number of rows after those of the instant behind a sample of the control, or behind an event."""
    for _ in range(2 if is_event else 1):
        rows = record_row(f, history, rows, t, s, m, p, o)
    return rows


record_change = compile_inline(_record_change)


def _record_step(f, tables, history, rows, parts, here, now, p, o):
    """Number of rows after those of one adaptive step, at its end and between its equal parts.

    A row between is a step of its own from the same start.
    """
    for part in range(1, parts):
        length = (now.t - here.t) * (float(part) / float(parts))
        rows = record_row(f, history, rows, here.t + length, glance(f, tables, length, here, p, o), here.m, p, o)
    return record_row(f, history, rows, now.t, now.s, here.m, p, o)


record_step = compile_inline(_record_step)
