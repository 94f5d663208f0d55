"""The block loop on a fixed time grid: W cases side by side, sampled control, events, running extrema.

All lanes of a block share the grid; a lane that meets an event takes its own way to the end of the step and
rejoins.  Lanes never look at each other: a lane that has ended or failed keeps its last values.  Of its memory, most of
what a model holds, they are set aside: to choose between old and new at every sample costs copies of all of it.

The loop is handed its `Method`: the classical Runge-Kutta method of fourth order, which is here, or one that uses
earlier steps (`multistep`, `gauss_jackson`).  W. Kutta, Zeitschrift für Mathematik und Physik 46 (1901) 435-453.
"""

from collections import namedtuple

from mc_engine.lanes import extrema
from mc_engine.lanes.aligned_stack import align_stack
from mc_engine.lanes.compiler import compile_callable, compile_inline
from mc_engine.lanes.events import follow, may_have_crossed
from mc_engine.lanes.functions import any_lane, fma, where
from mc_engine.lanes.history import look_shared, record_row
from mc_engine.lanes.lane_access import unequal
from mc_engine.lanes.philox import Draws
from mc_engine.lanes.physics_function import physics
from mc_engine.lanes.stage_memory import put_stage, stage_memory
from mc_engine.lanes.tuples import (
    add_scaled,
    any_field,
    load,
    load_fields,
    load_scalars,
    map_fields,
    select,
    spread,
    store,
    store_fields,
    total_in_pairs,
)
from mc_engine.status import EVENT_LIMIT, NO_STOP, NOT_FINITE

# How a state is taken along the grid.  `past` is what a method knows of earlier steps; `tables` are its numbers.
# begin(tables, memory, looks, s, t) : past of the first state; memory : room for `MOST_SLOPES` derivatives
# restart(past, lanes) : past without the earlier steps of some lanes, whose discrete state has changed
# advance(f, tables, past, t, finish, h, s, m, p, o, flying) : (state at the end of a grid step, past)
# single(f, tables, t, h, s, m, p, o) : state after a step of length h [s], lanes, from a state alone
# track(past, number, closing, lanes, h, smooth, seen, times, lasts, best, when, last) : running extrema and past after
# one more look at the outputs, the `number`th of the flight, the newest of `seen`; closing : it is the last of `lanes`
Method = namedtuple("Method", "begin restart advance single track tables")
MOST_SLOPES = 11
# What a multistep method keeps of the tracked outputs at the last grid points, the latest of number n in place
# n % LOOKS, and room for their differences.  count : how many looks the motion had that the latest look belonged to
Looks = namedtuple("Looks", "peaks peak_differences lasts last_differences count")
LOOKS = 9

_OVERRUN, _BROKEN, _UNSTOPPED = float(EVENT_LIMIT), float(NOT_FINITE), float(NO_STOP)


@physics
def _weighted(y, sixth, k1, k2, k3, k4):
    return fma(sixth, fma(2.0, k2 + k3, k1 + k4), y)


def _rk4(f, tables, t, h, s, m, p, o):
    """State after one step of length h [s] (a number or lanes) from state s at time t."""
    half = 0.5 * h
    k1 = spread(f.rhs(t, s, m, p, o), t)
    k2 = spread(f.rhs(t + half, add_scaled(s, half, k1), m, p, o), t)
    k3 = spread(f.rhs(t + half, add_scaled(s, half, k2), m, p, o), t)
    k4 = spread(f.rhs(t + h, add_scaled(s, h, k3), m, p, o), t)
    return map_fields(_weighted, s, h * (1.0 / 6.0), k1, k2, k3, k4)


rk4 = compile_inline(_rk4)
# for places off the main path: one copy in the kernel, called where needed
single = compile_callable(_rk4)


def _begin(tables, memory, looks, s, t):
    """RK4 knows nothing of earlier steps."""
    return 0


def _restart(past, lanes):
    return past


def _advance(f, tables, past, t, finish, h, s, m, p, o, flying):
    return rk4(f, tables, t, h, s, m, p, o), past


begin, restart, advance = compile_inline(_begin), compile_inline(_restart), compile_inline(_advance)


def _track_by_three(lanes, chords, smooth, seen, times, lasts, best, when, last):
    """Running extrema after one more look, by the parabola through three looks; last times by a chord in `chords`."""
    v0, v1, v2 = seen
    t0, t1, t2 = times
    crests = lanes & any_field(map_fields(extrema.crest, v0, v1, v2, best))
    if any_lane(crests):
        when = map_fields(extrema.crest_time, when, best, v0, v1, v2, t0, t1, t2, smooth, crests)
        best = map_fields(extrema.crest_value, best, when, v0, v1, v2, t0, t1, t2, smooth, crests)
    w1, w2 = lasts
    last = map_fields(extrema.above, last, w2, t2, lanes)
    if any_lane(any_field(map_fields(extrema.falls, w1, w2, chords))):
        last = map_fields(extrema.fall_time, last, w1, w2, t1, t2, chords)
    return best, when, last


track_by_three = compile_inline(_track_by_three)


def _track(past, number, closing, lanes, h, smooth, seen, times, lasts, best, when, last):
    return *track_by_three(lanes, lanes, smooth, seen, times, lasts, best, when, last), past


track = compile_inline(_track)


def _looks_from(v, w, t):
    """Looks of a flight that begins, with the first in every place."""
    peaks, lasts = stage_memory(v, LOOKS), stage_memory(w, LOOKS)
    for place in range(LOOKS):
        put_stage(peaks, place, v)
        put_stage(lasts, place, w)
    return Looks(peaks, stage_memory(v, LOOKS), lasts, stage_memory(w, LOOKS), 0.0 * t)


looks_from = compile_inline(_looks_from)


def _step(f, method, past, has_events, t, finish, h, s, m, p, o, flying, history, rows):
    """One grid step from t to `finish`: (state, memory, time, stopped, overrun, broken, past) of every lane.

    The event values at the start are taken anew, not handed on: they share what the first derivative computes.
    """
    end, past = method.advance(f, method.tables, past, t, finish, h, s, m, p, o, flying)
    now, stopped = finish, flying & (not flying)
    overrun = lost = stopped
    if has_events:
        g, g_end = spread(f.events(t, s, m, p, o), t), spread(f.events(now, end, m, p, o), t)
        met = flying & any_field(map_fields(may_have_crossed, g, g_end, f.signs_of(g)))
        if any_lane(met):
            end, m, now, stopped, overrun, lost = follow(
                f, method, t, finish, h, s, end, m, p, o, g, g_end, flying, history, rows
            )
            past = method.restart(past, met)
    size = total_in_pairs(end)
    broken = lost | (flying & (not (size - size == 0.0)))
    return end, m, now, stopped, overrun & (not broken), broken, past


step = compile_inline(_step)


def _fly_block(f, method, p, o, key, case, n_steps, h, control_every, has_events, history, rows, stride):
    """Fly one block from its first state to the stop or the time limit.

    The outputs are looked at where a step begins, beside its first derivative, with which they share most of
    their work, and where a flight ends.
    A history has the start, every `stride` steps and their samples, all events, and the end.
    Returns (time, state, memory, status, unstopped, best, when, last) of every lane.
    """
    t = case * 0.0
    flying, status = t == t, t
    s, m = f.states_of(spread(f.initial(p, o), t)), spread(f.start(p, o), t)
    m = spread(f.control(t, s, m, p, o, Draws(key, case, 0.0)), t)
    seen = look_shared(f, t, s, m, p, o)
    v0 = v1 = best = f.peaks_of(seen)
    w1 = f.lasts_of(seen)
    when, last = map_fields(extrema.first_time, v1, t), map_fields(extrema.first_time, w1, t)
    t0 = t1 = t2 = t
    past = method.begin(method.tables, stage_memory(s, MOST_SLOPES), looks_from(v1, w1, t), s, t)
    last_memory = m
    for k in range(n_steps):
        recorded = history.shape[0] > 0 and k % stride == 0
        if k > 0 and k % control_every == 0:
            if recorded:
                record_row(f, history, rows, flying, t2, s, m, p, o)
            held = spread(f.control(t2, s, m, p, o, Draws(key, case, float(k // control_every))), t)
            past = method.restart(past, unequal(m, held, t))
            m = held  # of lanes that have ended, too: what they held then is in `last_memory`
        seen = spread(f.observe(t2, s, m, p, o), t)
        v2, w2 = f.peaks_of(seen), f.lasts_of(seen)
        smooth, values, times, lasts = f.smooth_of(v2), (v0, v1, v2), (t0, t1, t2), (w1, w2)
        best, when, last, past = method.track(past, k, False, flying, h, smooth, values, times, lasts, best, when, last)
        if recorded:  # looked at anew: so the outputs that only a history wants cost nothing where there is none
            record_row(f, history, rows, flying, t2, s, m, p, o)
        # the grid's own time, not a sum of steps: no rounding piles up, and a sample falls where it belongs
        finish = case * 0.0 + float(k + 1) * h
        end, memory, now, stopped, overrun, broken, past = step(
            f, method, past, has_events, t2, finish, h, s, m, p, o, flying, history, rows
        )
        moved = flying & (not broken)
        if any_lane(not moved):  # a branch, which the processor predicts: the next step need not wait for the check
            end, memory, now = select(moved, end, s), select(moved, memory, m), where(moved, now, t)
        s, m, t = end, memory, now
        status = where(overrun, _OVERRUN, where(broken, _BROKEN, status))
        ended = moved & (stopped | overrun)
        flying = moved & (not ended)
        at_end = ended | (flying & (k + 1 == n_steps))
        if any_lane(at_end | broken):
            last_memory = select(at_end | broken, m, last_memory)
            seen = look_shared(f, t, s, m, p, o)
            v3, w3 = f.peaks_of(seen), f.lasts_of(seen)
            values, times, lasts = (v1, v2, v3), (t1, t2, t), (w2, w3)
            best, when, last, _ = method.track(
                past, k + 1, True, at_end, h, smooth, values, times, lasts, best, when, last
            )
            when = map_fields(extrema.end_time, when, best, v3, t, at_end, t)
            best = map_fields(extrema.end_value, best, v3, at_end)
            if history.shape[0] > 0:
                record_row(f, history, rows, at_end, t, s, m, p, o)
        if not any_lane(flying):
            break
        v0, v1, w1, t0, t1, t2 = v1, v2, w2, t1, t2, finish
    return t, s, last_memory, status, flying, best, when, last


fly_block = compile_inline(_fly_block)


def _fly(
    f,
    method,
    parameter_class,
    setting_class,
    width,
    parameters,
    settings,
    key,
    cases,
    grid,
    kinds,
    out,
    history,
    rows,
    stride,
):
    """Fly all cases of a chunk by a `Method`.

    parameters : float64[n_parameters, n], SI, n a multiple of the width
    settings : float64[n_settings];  key : uint64;  cases : float64[n], case numbers
    grid : (n_steps, h [s], control_every);  kinds : (has_events, must_stop), both literal truths
    out : (time, status) float64[n], state float64[n_states, n], metrics float64[n_metrics, n]
    history, rows : see `mc_engine.lanes.history`;  stride : grid steps from row to row
    """
    align_stack()
    n_steps, h, control_every = grid
    has_events, must_stop = kinds
    end_time, end_status, end_state, metrics = out
    o = load_scalars(setting_class, settings)
    for first in range(0, cases.shape[0], width):
        p = load_fields(parameter_class, parameters, first, width)
        case = load(cases, first, width)
        t, s, m, status, unstopped, best, when, last = fly_block(
            f, method, p, o, key, case, n_steps, h, control_every, has_events, history, rows, stride
        )
        if must_stop:
            status = where(unstopped, _UNSTOPPED, status)
        extreme, instant = f.best_of(best + last), f.when_of(when + last)
        values = f.metrics_of(spread(f.evaluate(t, s, m, p, o, extreme, instant), t))
        store(end_time, first, t)
        store(end_status, first, status)
        store_fields(end_state, first, s)
        store_fields(metrics, first, values)


fly = compile_inline(_fly)
