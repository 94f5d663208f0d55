"""The block loop on a fixed time grid: W cases side by side, sampled control, events, running extrema.

All lanes of a block share the grid, so the time of a grid point is one number, and what depends on time alone is
computed once.  A lane in which an event happens flies to the end of the step on its own, and rejoins the others there.
Lanes are independent: one that has ended or failed keeps its last values.  Its discrete state is saved apart, because
a choice between old and new at every sample would copy all of it.

The loop takes a `Method`: the classical Runge-Kutta method of fourth order, which is here, or one that uses earlier
steps (`multistep`, `gauss_jackson`).  W. Kutta, Zeitschrift für Mathematik und Physik 46 (1901) 435-453.
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
# advance(f, tables, past, begin, finish, h, s, m, p, o, flying) : (state at the end of a grid step, past); the times of
# its ends are numbers, not lanes
# single(f, tables, t, h, s, m, p, o) : state after a step of length h [s], lanes, from a state alone
# track(past, number, t, h, closing, lanes, smooth, seen, lasts, best, when, last) : running extrema and past after one
# more look at the outputs, the `number`th of the flight, at t, the newest of five `seen`; closing : the last of `lanes`
Method = namedtuple("Method", "begin restart advance single track tables")
MOST_SLOPES = 11
# What a multistep method keeps of the tracked outputs at the last grid points, the latest of number n in place
# n % LOOKS, and room for their differences.  count : how many looks the motion had that the latest look belonged to
Looks = namedtuple("Looks", "peaks peak_differences lasts last_differences count")
LOOKS = 9

_OVERRUN, _BROKEN, _UNSTOPPED = float(EVENT_LIMIT), float(NOT_FINITE), float(NO_STOP)


@physics
def _weighted(y, sixth, k1, k2, k3, k4):
    middle = k2 + k3  # twice by a sum: processors have more room for sums than for products
    return fma(sixth, (middle + middle) + (k1 + k4), y)


def _rk4(f, tables, t, h, s, m, p, o):
    """State after one step of length h [s] from state s at time t, each a number or lanes."""
    half = 0.5 * h
    k1 = spread(f.rhs(t, s, m, p, o), s[0])
    k2 = spread(f.rhs(t + half, add_scaled(s, half, k1), m, p, o), s[0])
    k3 = spread(f.rhs(t + half, add_scaled(s, half, k2), m, p, o), s[0])
    k4 = spread(f.rhs(t + h, add_scaled(s, h, k3), m, p, o), s[0])
    return map_fields(_weighted, s, h * (1.0 / 6.0), k1, k2, k3, k4)


rk4 = compile_inline(_rk4)
# for places off the main path: one copy in the kernel, called where needed
single = compile_callable(_rk4)


def _begin(tables, memory, looks, s, t):
    """RK4 knows nothing of earlier steps."""
    return 0


def _restart(past, lanes):
    return past


def _advance(f, tables, past, begin, finish, h, s, m, p, o, flying):
    return rk4(f, tables, begin, h, s, m, p, o), past


begin, restart, advance = compile_inline(_begin), compile_inline(_restart), compile_inline(_advance)


def _grid_time(number, h, t):
    """Time [s] of a grid point in every lane, of one before the first that of the first.  t : any number in lanes."""
    return 0.0 * t + float(max(number, 0)) * h


grid_time = compile_inline(_grid_time)


def _last_five(number, t, h, closing):
    """Times of the last five values, see `track_by_three`."""
    before, ago = number - 1, grid_time(number - 2, h, t)
    if closing:  # the last twice: nothing is known of what comes after it
        return grid_time(number - 3, h, t), ago, grid_time(before, h, t), t, t
    return grid_time(number - 4, h, t), grid_time(number - 3, h, t), ago, grid_time(before, h, t), t


last_five = compile_inline(_last_five)


def _track_by_three(number, t, h, closing, lanes, smooth, seen, best, when):
    """Running extrema (best, when) after one more value, by the parabola through three values that show no jump.

    seen : the last five values, of which the third may be a crest.  The newest one has this number and is at t.  If
    `closing`, the newest one is there twice, so that the one before it may be the crest.
    """
    v0, v1, v2, v3, v4 = seen
    crests = lanes & any_field(map_fields(extrema.crest, v1, v2, v3, best))
    if any_lane(crests):
        t0, t1, t2, t3, t4 = last_five(number, t, h, closing)
        curved = map_fields(extrema.smooth_where_bent_alike, smooth, v0, v1, v2, v3, v4, t0, t1, t2, t3, t4)
        when = map_fields(extrema.crest_time, when, best, v1, v2, v3, t1, t2, t3, curved, crests)
        best = map_fields(extrema.crest_value, best, when, v1, v2, v3, t1, t2, t3, curved, crests)
    return best, when


track_by_three = compile_inline(_track_by_three)


def _last_above(number, t, h, lanes, chords, lasts, last):
    """Last times above zero after one more value; if it fell since the one before, by a chord in lanes `chords`."""
    w1, w2 = lasts
    last = map_fields(extrema.above, last, w2, t, lanes)
    if any_lane(any_field(map_fields(extrema.falls, w1, w2, chords))):
        last = map_fields(extrema.fall_time, last, w1, w2, grid_time(number - 1, h, t), t, chords)
    return last


last_above = compile_inline(_last_above)


def _track(past, number, t, h, closing, lanes, smooth, seen, lasts, best, when, last):
    best, when = track_by_three(number, t, h, False, lanes, smooth, seen, best, when)
    if closing:
        best, when = track_by_three(number, t, h, True, lanes, smooth, newest_twice(seen), best, when)
    return best, when, last_above(number, t, h, lanes, lanes, lasts, last), past


def _newest_twice(seen):
    """The last four of five values, and the newest again."""
    return seen[1], seen[2], seen[3], seen[4], seen[4]


newest_twice, track = compile_inline(_newest_twice), compile_inline(_track)


def _looks_from(v, w, t):
    """Looks of a flight that begins, with the first in every place."""
    peaks, lasts = stage_memory(v, LOOKS), stage_memory(w, LOOKS)
    for place in range(LOOKS):
        put_stage(peaks, place, v)
        put_stage(lasts, place, w)
    return Looks(peaks, stage_memory(v, LOOKS), lasts, stage_memory(w, LOOKS), 0.0 * t)


looks_from = compile_inline(_looks_from)


def _step(f, method, past, has_events, begin, finish, h, s, m, p, o, flying, reached, history, rows):
    """One grid step: (state, memory, time, stopped, overrun, broken, past, reached) of every lane.

    The event values at the start are computed again, not passed on: they share computations with the first derivative.
    """
    end, past = method.advance(f, method.tables, past, begin, finish, h, s, m, p, o, flying)
    now, stopped = spread(finish, s[0]), flying & (not flying)
    overrun = lost = stopped
    if has_events:
        g, g_end = spread(f.events(begin, s, m, p, o), now), spread(f.events(finish, end, m, p, o), now)
        met = flying & any_field(map_fields(may_have_crossed, g, g_end, f.signs_of(g)))
        if any_lane(met):
            end, m, now, stopped, overrun, lost, reached = follow(
                f, method, spread(begin, now), now, h, s, end, m, p, o, g, g_end, flying, reached, history, rows
            )
            past = method.restart(past, met)
    size = total_in_pairs(end)
    broken = lost | (flying & (not (size - size == 0.0)))
    return end, m, now, stopped, overrun & (not broken), broken, past, reached


step = compile_inline(_step)


def _fly_block(f, method, p, o, key, case, n_steps, h, control_every, has_events, history, rows, stride):
    """Fly one block from its first state to the stop or the time limit.

    The outputs are computed at the start of a step, with its first derivative, with which they share most of their
    work; also on both sides of an event, and at the end of a flight.
    A history has the start, every `stride` steps and their samples, all events, and the end.
    Returns (time, state, memory, status, unstopped, best, when, last) of every lane.
    """
    t = case * 0.0
    flying, status = t == t, t
    s, m = f.states_of(spread(f.initial(p, o), t)), spread(f.start(p, o), t)
    m = spread(f.control(t, s, m, p, o, Draws(key, case, 0.0)), t)
    seen = look_shared(f, t, s, m, p, o)
    v0 = v1 = v2 = v3 = best = f.peaks_of(seen)
    w3 = f.lasts_of(seen)
    when, last = map_fields(extrema.first_time, v3, t), map_fields(extrema.first_time, w3, t)
    past = method.begin(method.tables, stage_memory(s, MOST_SLOPES), looks_from(v3, w3, t), s, t)
    last_memory = m
    for k in range(n_steps):
        # the grid's own time, not a sum of steps: no rounding piles up, and a sample falls where it belongs
        begin, finish = float(k) * h, float(k + 1) * h  # of lanes that fly, `begin` is the time t
        recorded = history.shape[0] > 0 and k % stride == 0
        if k > 0 and k % control_every == 0:
            if recorded:
                record_row(f, history, rows, flying, t, s, m, p, o)
            held = spread(f.control(begin, s, m, p, o, Draws(key, case, float(k // control_every))), t)
            past = method.restart(past, unequal(m, held, t))
            m = held  # of lanes that have ended, too: what they held then is in `last_memory`
        seen = spread(f.observe(begin, s, m, p, o), t)
        v4, w4 = f.peaks_of(seen), f.lasts_of(seen)
        smooth, looks, lasts = f.smooth_of(v4), (v0, v1, v2, v3, v4), (w3, w4)
        best, when, last, past = method.track(past, k, t, h, False, flying, smooth, looks, lasts, best, when, last)
        if recorded:  # looked at anew: so the outputs that only a history wants cost nothing where there is none
            record_row(f, history, rows, flying, t, s, m, p, o)
        end, memory, now, stopped, overrun, broken, past, (best, when, last) = step(
            f, method, past, has_events, begin, finish, h, s, m, p, o, flying, (best, when, last), history, rows
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
            v5, w5 = f.peaks_of(seen), f.lasts_of(seen)
            looks, lasts = (v1, v2, v3, v4, v5), (w4, w5)
            best, when, last, _ = method.track(past, k + 1, t, h, True, at_end, smooth, looks, lasts, best, when, last)
            when = map_fields(extrema.end_time, when, best, v5, t, at_end, t)
            best = map_fields(extrema.end_value, best, v5, at_end)
            if history.shape[0] > 0:
                record_row(f, history, rows, at_end, t, s, m, p, o)
        if not any_lane(flying):
            break
        v0, v1, v2, v3, w3 = v1, v2, v3, v4, w4
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
