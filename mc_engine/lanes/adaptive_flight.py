"""Adaptive flight in lanes: each lane steps, locates events and ends independently, then takes the next case.

In each round of the loop every lane attempts one step, so no lane waits for the events of another.  Lanes that take a
new case, or whose state the model has changed, are prepared in a round without attempts before the next one.

state       attempt                        next state
stepping    a full step                    stepping; closing if it passed an event; shortening if it may have met zero
closing     a part of the step's length    closing; stepping once the event is located to tolerance
shortening  a step to the likely zero      stepping; closing if it passed an event

An event is a zero of a sense (see `adaptive_step`).  A peak is a zero of a rate, so it is located as exactly as events.
"""

from collections import namedtuple

from mc_engine.lanes.adaptive_step import (
    Instant,
    arm,
    best_time,
    best_value,
    first_length,
    ideal_factor,
    is_lost,
    jump_time,
    leap,
    next_length,
    sense,
    turn_length,
    watch,
)
from mc_engine.lanes.aligned_stack import align_stack
from mc_engine.lanes.compiler import compile_inline
from mc_engine.lanes.events import crossed
from mc_engine.lanes.extrema import PEAK, first_time
from mc_engine.lanes.functions import any_lane, floor, maximum, minimum, where
from mc_engine.lanes.history import record_change, record_row, record_step
from mc_engine.lanes.lane_access import lane_holds, store_lane, with_column, with_lane
from mc_engine.lanes.philox import Draws
from mc_engine.lanes.physics_function import physics
from mc_engine.lanes.tuples import (
    any_field,
    first_fields,
    least,
    load,
    load_fields,
    load_scalars,
    map_fields,
    scalars_like,
    select,
    spread,
    total,
    unset,
)
from mc_engine.status import NO_STOP, NOT_FINITE, STEP_LIMIT

# until: time limit [s]; period: of the sampled control [s]; attempts: cap; first: first length [s], or 0; longest: [s]
Clock = namedtuple("Clock", "until rtol period attempts first longest order")
# part of a step that holds an event: lengths, senses and rates at both sides, which side moved last, next length to
# look at, how often one was looked at, width at which it is closed
Bracket = namedtuple("Bracket", "low high at_low at_high rate_low rate_high side look looks width")

_BROKEN, _CAPPED, _UNSTOPPED = float(NOT_FINITE), float(STEP_LIMIT), float(NO_STOP)
_REACH = 1e-5  # of a step: length of the tangent over which rates are taken
_FEW = 3.0  # looks at an event with its width; then the width grows
_CHORDS = 8.0  # then every other look halves the bracket, and the width stays: else it would be met far from the zero
_CLOSED = 2e-15  # of time and length: the width at which the bracket of an event is closed
_CREST = 1e-7  # of a step: the same for a peak, which is flat and differs by the square of this
_AT_SAMPLE = 1e-12  # of the time: an event may be found so far behind a sample; a sample so near the end is not taken
_NEVER, _NONE, _NAN = 1e300, 1e-300, float("nan")


@physics
def _watched(armed, sense):
    """The sense where it is armed, else a constant, which crosses nothing."""
    return where(armed > 0.5, sense, 1.0)


@physics
def _root(kind, before, after, rate_before, rate_after, direction, low, high):
    """Length at which one sense meets zero: a cubic in the sense, with its rates at both sides, or its chord.

    The middle where the sense still leaves zero, as after an event of the other direction: beside that event, rounding
    decides on its sign.  `high` where the sense does not cross.  The sense of a peak has no rate.
    """
    across = crossed(before, after, direction)
    width, span = high - low, after - before
    u = before / where(across, -span, 1.0)
    v = 1.0 - u
    cubic = low + width * (u * u * (3.0 - 2.0 * u)) + u * v * span * (v / rate_before - u / rate_after)
    usable = (kind != PEAK) & (cubic > low) & (cubic < high)
    leaves = (kind != PEAK) & (before * rate_before > 0.0)
    return where(across, where(usable, cubic, low + width * where(leaves, 0.5, u)), high)


@physics
def _near(kind, root, before, after, rate, direction, high, width):
    """Not negative where the side that has crossed is within four widths of the zero; its sense and rate say so too."""
    small = (kind == PEAK) | (abs(after) < 8.0 * width * abs(rate))
    return where(crossed(before, after, direction), where(small, root + 4.0 * width - high, -1.0), 1.0)


@physics
def _fires(armed, before, after, direction, mask):
    return mask & (armed > 0.5) & crossed(before, after, direction)


@physics
def _fires_sharply(kind, armed, before, after, direction):
    """Mask: something else than a peak crosses, whose time is wanted to the last digits."""
    return (kind != PEAK) & (armed > 0.5) & crossed(before, after, direction)


@physics
def _fired_flag(mask, like):
    return where(mask, 1.0, 0.0) + 0.0 * like


@physics
def _halved_peak(kind, value, mask):
    return where(mask & (kind == PEAK), 0.5 * value, value)


@physics
def _nothing(value):
    return 0.0 * value


def _narrow(kinds, signs, bracket, seen, rates, looking):
    """(bracket after a look, where the look has crossed, where it is near enough to what it has crossed).

    The next look goes a little behind the first zero that the sides tell of, so that it finds it crossed.  The sense
    of a peak is halved at a side that stays (Illinois rule): M. Dowell, P. Jarratt, BIT 11 (1971) 168-174.
    """
    after = any_field(map_fields(crossed, bracket.at_low, seen, signs))
    ahead, back = looking & (not after), looking & after
    at_low = select(ahead, seen, map_fields(_halved_peak, kinds, bracket.at_low, back & (bracket.side > 0.0)))
    at_high = select(back, seen, map_fields(_halved_peak, kinds, bracket.at_high, ahead & (bracket.side < 0.0)))
    rate_low, rate_high = select(ahead, rates, bracket.rate_low), select(back, rates, bracket.rate_high)
    side = where(back, 1.0, where(ahead, -1.0, bracket.side))
    low, high = where(ahead, bracket.look, bracket.low), where(back, bracket.look, bracket.high)
    # many looks: the rounding of the sense is in the way
    width = where((bracket.looks > _FEW) & (bracket.looks < _CHORDS), 2.0, 1.0) * bracket.width
    roots = map_fields(_root, kinds, at_low, at_high, rate_low, rate_high, signs, low, high)
    near = least(map_fields(_near, kinds, roots, at_low, at_high, rate_high, signs, high, width)) >= 0.0
    look = minimum(maximum(least(roots), low) + 0.5 * width, high - 0.4 * width)
    every_other = bracket.looks - 2.0 * floor(0.5 * bracket.looks) < 0.5
    inside = (look > low) & (look < high) & ((bracket.looks < _CHORDS) | every_other)
    look, looks = where(inside, look, 0.5 * (low + high)), bracket.looks + 1.0
    return Bracket(low, high, at_low, at_high, rate_low, rate_high, side, look, looks, width), back, near


narrow = compile_inline(_narrow)


def _begin(f, p, o, key, case):
    """First state and memory of every lane."""
    t = case * 0.0
    s, m = f.states_of(spread(f.initial(p, o), t)), spread(f.start(p, o), t)
    # the sample in lanes, as in `_changed`: one type, for which the control is compiled once
    return s, spread(f.control(t, s, m, p, o, Draws(key, case, t)), t)


begin = compile_inline(_begin)


def _slope(f, t, s, m, p, o):
    """Derivative of the state in every lane."""
    return spread(f.rhs(t, s, m, p, o), t)


slope = compile_inline(_slope)


def _length(f, clock, t, s, m, k, p, o, atol):
    """Length [s] of the first attempt of every lane.  k : derivative of the state."""
    longest = minimum(clock.until, clock.period)
    h = first_length(f, t, s, k, m, p, o, atol, clock.rtol, clock.order, longest + t)
    return where(clock.first + t > 0.0, clock.first + t, h)


length_at_start = compile_inline(_length)


def _metrics_at_end(f, here, best, when, p, o):
    """Metrics of every lane, were it to end here."""
    return f.metrics_of(spread(f.evaluate(here.t, here.s, here.m, p, o, f.best_of(best), f.when_of(when)), here.t))


finish = compile_inline(_metrics_at_end)


def _noted(f, here, fired, noting, p, o):
    """The discrete state after what the model notes at an event, also at one that ends the case."""
    like = spread(f.events(here.t, here.s, here.m, p, o), here.t)
    hit = first_fields(map_fields(_fired_flag, fired, here.t), like)
    return select(noting, spread(f.note(here.t, here.s, here.m, p, o, hit), here.t), here.m)


noted = compile_inline(_noted)


def _changed(f, key, case, sample, here, fired, switching, sampling, p, o):
    """(state, memory) after what the model does at an instant: `switch` on events, `control` at samples."""
    t = here.t
    like = spread(f.events(t, here.s, here.m, p, o), t)
    state, memory = f.switch(t, here.s, here.m, p, o, first_fields(map_fields(_fired_flag, fired, t), like))
    s, m = select(switching, spread(state, t), here.s), select(switching, spread(memory, t), here.m)
    return s, select(sampling, spread(f.control(t, s, m, p, o, Draws(key, case, sample)), t), m)


changed = compile_inline(_changed)


@physics
def _next_sample(t, sample, period):
    """Number of the first sample that is not before an event at t, and not before that one."""
    return maximum(sample, -floor(-(1.0 - _AT_SAMPLE) * t / period))


def _fly(
    f,
    tables,
    parameter_class,
    setting_class,
    width,
    columns,
    parameters,
    settings,
    key,
    cases,
    clock,
    atol,
    must_stop,
    out,
    history,
    rows,
    pace,
):
    """Fly all cases of a chunk, the lanes taking them in turn.

    tables : of the Runge-Kutta pair.  columns : int64[width], the case that each lane begins with: 0, 1, 2, ...
    parameters : float64[n_parameters, n], SI, n at least the width
    settings : float64[n_settings];  key : uint64;  cases : float64[n], case numbers
    clock : the fields of `Clock`, float64;  atol : float64[n_states], SI
    out : (time, status) float64[n], state float64[n_states, n], metrics float64[n_metrics, n]
    history, rows : see `mc_engine.lanes.history`
    pace : float64[width], history rows of a step; below 1 one for so many steps, and events have theirs all the same
    """
    align_stack()
    end_time, end_status, end_state, metrics = out
    clock = Clock(clock[0], clock[1], clock[2], clock[3], clock[4], clock[5], clock[6])
    o = load_scalars(setting_class, settings)
    p, case = load_fields(parameter_class, parameters, 0, width), load(cases, 0, width)
    waiting = width
    zero = case * 0.0
    s, m = unset(begin, f, p, o, key, case)
    k, values = unset(slope, f, zero, s, m, p, o), unset(watch, f, zero, s, m, p, o)
    here = Instant(zero, s, m, k, values, values, values)
    atol = scalars_like(here.s, atol)
    kinds, signs, unknown = f.kinds_of(here.values), f.signs_of(here.values), map_fields(_nothing, here.values)
    new, altered = zero == zero, zero > 0.0  # lanes that begin a case, lanes that the model has changed
    active, status, attempts, sample, limit = zero + 1.0, zero, zero, zero + 1.0, zero + clock.longest
    h, last_ideal = zero, zero + _NONE  # of the step before this one: there is none
    closing, beyond, armed = zero > 0.0, here, unknown
    bracket = Bracket(zero, zero, armed, armed, armed, armed, zero, zero, zero, zero)
    best, when = here.values, map_fields(first_time, here.values, zero)
    due, rows_of_step = zero, load(pace, 0, width)
    flying, sampled, trial, length, error = active > 0.5, closing, zero, zero, zero  # of an attempt: there is none yet
    while True:
        starting = any_lane(new | altered)
        if starting:
            if any_lane(new):
                s, m = begin(f, p, o, key, case)
                t, s, m = where(new, 0.0, here.t), select(new, s, here.s), select(new, m, here.m)
                here = Instant(t, s, m, here.k, select(new, unknown, here.senses), here.rates, here.values)
                status, attempts = where(new, 0.0, status), where(new, 0.0, attempts)
                sample, limit = where(new, 1.0, sample), where(new, clock.longest, limit)
                last_ideal = where(new, _NONE, last_ideal)
                closing = closing & (not new)
                if history.shape[0] > 0:
                    record_row(f, history, rows, new, t, s, m, p, o)
            k = slope(f, here.t, here.s, here.m, p, o)
            if any_lane(new):
                h = where(new, length_at_start(f, clock, zero, here.s, here.m, k, p, o, atol), h)
            t_end, end = here.t, here.s
        else:
            flying = active > 0.5
            sampled = zero + f.samples(here.t, here.s, here.m, p, o) > 0.5
            due_sample = where(sampled, sample * clock.period, _NEVER)
            target = where(due_sample < (1.0 - _AT_SAMPLE) * clock.until, due_sample, clock.until)
            room = target - here.t
            length = minimum(where(room <= 1.001 * h, room, h), limit)
            landing = (not closing) & (length == room)
            trial = where(closing, bracket.look, length)
            end, k, error = leap(f, tables, trial, here, p, o, atol, clock.rtol)
            t_end = where(landing, target, here.t + trial)
        # the largest part of many kernels: starts and steps share it, so that it is compiled once
        there = sense(f, t_end, end, k, here, p, o, _REACH * h)
        if starting:
            here = select(new | altered, there, here)
            when = map_fields(jump_time, kinds, when, best, here.values, here.t, altered)
            best = map_fields(best_value, kinds, best, here.values, altered)
            best = select(new, here.values, best)
            when = select(new, map_fields(first_time, here.values, zero), when)
            new, altered = zero != zero, zero != zero
            continue
        attempts = attempts + 1.0
        stepping, looking = flying & (not closing), flying & closing
        good = stepping & (error <= 1.0)
        hopes = map_fields(arm, kinds, here.senses, here.values, there.senses, there.values, best, trial)
        over = any_field(map_fields(_fires, hopes, here.senses, there.senses, signs, good))
        # whether such a step met an event cannot be told: it is tried shorter, as if its error were not a number
        error = where(any_field(map_fields(is_lost, kinds, there.values)) & (not over), _NAN, error)
        good = good & (error <= 1.0)
        poor = stepping & (not good)
        turn = least(map_fields(turn_length, kinds, here.senses, here.rates, there.senses, there.rates, trial))
        dip = good & (turn < trial)  # before what the step crosses, perhaps
        over = over & (not dip)
        fits = good & (not over) & (not dip)
        cut = (length < h) & (not poor)
        ideal = trial * ideal_factor(error, -1.0 / clock.order)
        scaled = next_length(trial, error, ideal, where(good, last_ideal, _NONE))
        last_ideal = where(good, ideal, last_ideal)
        h = where(good, where(cut, maximum(h, scaled), scaled), where(poor, scaled, h))
        limit = where(dip, turn, where(good, clock.longest, limit))
        closed = flying & (not flying)
        if any_lane(over | looking):
            armed = select(over, hopes, armed)
            seen = map_fields(_watched, armed, there.senses)
            sharp = any_field(map_fields(_fires_sharply, kinds, armed, here.senses, there.senses, signs))
            enough = where(sharp, _CLOSED * (abs(here.t) + trial), maximum(_CREST * trial, _CLOSED * abs(here.t)))
            at_start, rates = map_fields(_watched, armed, here.senses), here.rates
            opened = Bracket(zero, trial, at_start, seen, rates, there.rates, zero, trial, zero, enough)
            bracket, back, near = narrow(kinds, signs, select(over, opened, bracket), seen, there.rates, over | looking)
            beyond, closing = select(back, there, beyond), closing | over
            closed = flying & closing & (near | (bracket.high - bracket.low <= bracket.width))
        arrived = fits | closed
        now = select(closed, beyond, there)
        fired = map_fields(_fires, armed, here.senses, now.senses, signs, closed)
        stopped = closed & f.stops_of(fired)
        when = map_fields(best_time, kinds, when, best, now.values, fired, now.t, arrived)
        best = map_fields(best_value, kinds, best, now.values, arrived)
        ended = arrived & (stopped | (now.t >= clock.until))
        stuck = stepping & (not ended) & (h <= 1e-14 * abs(here.t) + 1e-290)
        capped = flying & (not ended) & (attempts >= clock.attempts)
        size = total(end) + error
        status = where(stuck | capped, where(stuck & (not (size - size == 0.0)), _BROKEN, _CAPPED), status)
        if must_stop:
            status = where(ended & (not stopped), _UNSTOPPED, status)
        recorded = arrived
        if history.shape[0] > 0:
            due = where(arrived, due + rows_of_step, due)
            recorded = arrived & ((due >= 1.0) | closed)
            parts = where(recorded, floor(due), 0.0)
            record_step(f, tables, history, rows, recorded, parts, here, now, p, o)
            due = due - parts
        here = select(arrived, now, here)
        closing = closing & (not arrived)
        noting = closed & f.notes_of(fired)
        if any_lane(noting):
            m = noted(f, here, fired, noting, p, o)
            here = Instant(here.t, here.s, m, here.k, here.senses, here.rates, here.values)
        if any_lane(arrived & (not sampled)):
            sample = where(sampled, sample, _next_sample(here.t, sample, clock.period))
        sampling = arrived & (not ended) & (here.t >= sample * clock.period)
        switching = closed & (not ended) & f.switches_of(fired)
        altered = sampling | switching
        if any_lane(altered):
            s, m = changed(f, key, case, sample, here, fired, switching, sampling, p, o)
            here = Instant(here.t, s, m, here.k, here.senses, here.rates, here.values)
            sample = where(sampling, sample + 1.0, sample)
            last_ideal = where(altered, _NONE, last_ideal)
        done, new = ended | stuck | capped, flying & (not flying)
        if history.shape[0] > 0:
            shown = (recorded & (closed | sampling)) | done
            record_change(f, history, rows, shown, closed, here.t, here.s, here.m, p, o)
        if any_lane(done):
            results = finish(f, here, best, when, p, o)
            fresh = zero
            for lane in range(width):
                if lane_holds(done, lane):
                    column = columns[lane]
                    store_lane(end_time, column, here.t, lane)
                    store_lane(end_status, column, status, lane)
                    store_lane(end_state, column, here.s, lane)
                    store_lane(metrics, column, results, lane)
                    if waiting < cases.shape[0]:
                        p = with_column(p, lane, parameters, waiting)
                        case = with_lane(case, lane, cases[waiting])
                        columns[lane] = waiting
                        waiting += 1
                        fresh = with_lane(fresh, lane, 1.0)
                    else:
                        active = with_lane(active, lane, 0.0)
            if not any_lane(active > 0.5):
                break
            new = fresh > 0.5


fly = compile_inline(_fly)
