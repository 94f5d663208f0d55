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
from mc_engine.lanes.events import Bracket, crossed, narrow
from mc_engine.lanes.extrema import PEAK, first_time
from mc_engine.lanes.functions import any_lane, floor, maximum, minimum, replace, where
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
# Of every lane: the instant that it has reached, length of its next step [s], the longest one before a suspected event
# [s], the length whose error would have been 1 in its last step [s], number of its next sample, attempts, status
Course = namedtuple("Course", "here h limit last_ideal sample attempts status")
# The event that a step has passed: where one is looked for, hopes of that step (see `arm`), bracket, and the
# instant behind the event
Search = namedtuple("Search", "closing armed bracket beyond")

_BROKEN, _CAPPED, _UNSTOPPED = float(NOT_FINITE), float(STEP_LIMIT), float(NO_STOP)
_REACH = 1e-5  # of a step: length of the tangent over which rates are taken
_CLOSED = 2e-15  # of time and length: the width at which the bracket of an event is closed
_CREST = 1e-7  # of a step: the same for a peak, which is flat and differs by the square of this
_AT_SAMPLE = 1e-12  # of the time: an event may be found so far behind a sample; a sample so near the end is not taken
_NEVER, _NONE, _NAN = 1e300, 1e-300, float("nan")


@physics
def _watched(armed, sense):
    """The sense where it is armed, else a constant, which crosses nothing."""
    return where(armed > 0.5, sense, 1.0)


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
def _nothing(value):
    return 0.0 * value


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
def _target(t, sample, sampled, period, until):
    """Time of the next sample, or the time limit."""
    due = where(sampled, sample * period, _NEVER)
    return where(due < (1.0 - _AT_SAMPLE) * until, due, until)


@physics
def _next_sample(t, sample, period):
    """Number of the first sample that is not before an event at t, and not before that one."""
    return maximum(sample, -floor(-(1.0 - _AT_SAMPLE) * t / period))


def _prepared(f, clock, atol, key, case, new, unknown, course, p, o):
    """(course, derivative) of every lane; a `new` case is at its beginning, and its senses are unknown."""
    here = course.here
    if any_lane(new):
        s, m = begin(f, p, o, key, case)
        t, s, m = where(new, 0.0, here.t), select(new, s, here.s), select(new, m, here.m)
        here = replace(here, t=t, s=s, m=m, senses=select(new, unknown, here.senses))
        limit, last_ideal = where(new, clock.longest, course.limit), where(new, _NONE, course.last_ideal)
        sample, attempts = where(new, 1.0, course.sample), where(new, 0.0, course.attempts)
        course = Course(here, course.h, limit, last_ideal, sample, attempts, where(new, 0.0, course.status))
    k = slope(f, here.t, here.s, here.m, p, o)
    if any_lane(new):
        h = length_at_start(f, clock, 0.0 * case, here.s, here.m, k, p, o, atol)
        course = replace(course, h=where(new, h, course.h))
    return course, k


prepared = compile_inline(_prepared)


def _paced(clock, course, good, poor, dip, turn, trial, length, error):
    """Course with the length of the next attempt, after a `good` or a `poor` one of length `trial` [s].

    dip : where a good attempt has perhaps passed a turn, at the length `turn` [s]
    length : of an attempt that looks for no event [s]
    """
    h = course.h
    cut = (length < h) & (not poor)
    ideal = trial * ideal_factor(error, -1.0 / clock.order)
    scaled = next_length(trial, error, ideal, where(good, course.last_ideal, _NONE))
    h = where(good, where(cut, maximum(h, scaled), scaled), where(poor, scaled, h))
    limit = where(dip, turn, where(good, clock.longest, course.limit))
    return replace(course, h=h, limit=limit, last_ideal=where(good, ideal, course.last_ideal))


paced = compile_inline(_paced)


def _acted(f, clock, key, case, course, fired, sampled, arrived, closed, ended, p, o):
    """(course, where a sample is taken, where the model changes the state) of lanes that have arrived.

    fired : events;  sampled : lanes whose control is sampled;  closed : lanes at an event
    """
    here, sample, last_ideal = course.here, course.sample, course.last_ideal
    noting = closed & f.notes_of(fired)
    if any_lane(noting):
        here = replace(here, m=noted(f, here, fired, noting, p, o))
    if any_lane(arrived & (not sampled)):
        sample = where(sampled, sample, _next_sample(here.t, sample, clock.period))
    sampling = arrived & (not ended) & (here.t >= sample * clock.period)
    switching = closed & (not ended) & f.switches_of(fired)
    altered = sampling | switching
    if any_lane(altered):
        s, m = changed(f, key, case, sample, here, fired, switching, sampling, p, o)
        here = replace(here, s=s, m=m)
        sample = where(sampling, sample + 1.0, sample)
        last_ideal = where(altered, _NONE, last_ideal)
    return replace(course, here=here, sample=sample, last_ideal=last_ideal), sampling, altered


acted = compile_inline(_acted)


def _handed_over(f, width, out, columns, parameters, cases, waiting, active, done, course, best, when, case, p, o):
    """Store the results of the lanes that are done, and give each the next case that waits, if there is one.

    active : 1 in lanes that have a case.  Returns (parameters, case, active, lanes with a new case, number of the next)
    """
    end_time, end_status, end_state, metrics = out
    here, results = course.here, finish(f, course.here, best, when, p, o)
    fresh = 0.0 * case
    for lane in range(width):
        if lane_holds(done, lane):
            column = columns[lane]
            store_lane(end_time, column, here.t, lane)
            store_lane(end_status, column, course.status, lane)
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
    return p, case, active, fresh > 0.5, waiting


handed_over = compile_inline(_handed_over)


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
    course = Course(here, zero, zero + clock.longest, zero + _NONE, zero + 1.0, zero, zero)
    search = Search(
        altered, unknown, Bracket(zero, zero, unknown, unknown, unknown, unknown, zero, zero, zero, zero), here
    )
    best, when = here.values, map_fields(first_time, here.values, zero)
    due, rows_of_step = zero, load(pace, 0, width)
    active = zero + 1.0
    flying, sampled, trial, length, error = new, altered, zero, zero, zero  # of an attempt: there is none yet
    while True:
        starting = any_lane(new | altered)
        if starting:
            course, k = prepared(f, clock, atol, key, case, new, unknown, course, p, o)
            here = course.here
            if history.shape[0] > 0:
                record_row(f, history, rows, new, here.t, here.s, here.m, p, o)
            t_end, end = here.t, here.s
        else:
            flying = active > 0.5
            sampled = zero + f.samples(here.t, here.s, here.m, p, o) > 0.5
            target = _target(here.t, course.sample, sampled, clock.period, clock.until)
            room = target - here.t
            length = minimum(where(room <= 1.001 * course.h, room, course.h), course.limit)
            trial = where(search.closing, search.bracket.look, length)
            end, k, error = leap(f, tables, trial, here, p, o, atol, clock.rtol)
            t_end = where((not search.closing) & (length == room), target, here.t + trial)
        # the largest part of many kernels: starts and steps share it, so that it is compiled once
        there = sense(f, t_end, end, k, here, p, o, _REACH * course.h)
        if starting:
            here = select(new | altered, there, here)
            when = map_fields(jump_time, kinds, when, best, here.values, here.t, altered)
            best = map_fields(best_value, kinds, best, here.values, altered)
            best = select(new, here.values, best)
            when = select(new, map_fields(first_time, here.values, zero), when)
            course = replace(course, here=here)
            new, altered = zero != zero, zero != zero
            continue
        stepping, looking = flying & (not search.closing), flying & search.closing
        good = stepping & (error <= 1.0)
        hopes = map_fields(arm, kinds, here.senses, here.values, there.senses, there.values, best, trial)
        over = any_field(map_fields(_fires, hopes, here.senses, there.senses, signs, good))
        # whether such a step met an event cannot be told: it is tried shorter, as if its error were not a number
        error = where(any_field(map_fields(is_lost, kinds, there.values)) & (not over), _NAN, error)
        good = good & (error <= 1.0)
        turn = least(map_fields(turn_length, kinds, here.senses, here.rates, there.senses, there.rates, trial))
        dip = good & (turn < trial)  # before what the step crosses, perhaps
        over = over & (not dip)
        course = paced(clock, course, good, stepping & (not good), dip, turn, trial, length, error)
        closed = flying & (not flying)
        if any_lane(over | looking):
            armed = select(over, hopes, search.armed)
            seen = map_fields(_watched, armed, there.senses)
            sharp = any_field(map_fields(_fires_sharply, kinds, armed, here.senses, there.senses, signs))
            enough = where(sharp, _CLOSED * (abs(here.t) + trial), maximum(_CREST * trial, _CLOSED * abs(here.t)))
            at_start, rates = map_fields(_watched, armed, here.senses), here.rates
            opened = Bracket(zero, trial, at_start, seen, rates, there.rates, zero, trial, zero, enough)
            bracket = select(over, opened, search.bracket)
            bracket, back, near = narrow(kinds, signs, bracket, seen, there.rates, over | looking)
            search = Search(search.closing | over, armed, bracket, select(back, there, search.beyond))
            closed = flying & search.closing & (near | (bracket.high - bracket.low <= bracket.width))
        arrived = (good & (not over) & (not dip)) | closed
        now = select(closed, search.beyond, there)
        fired = map_fields(_fires, search.armed, here.senses, now.senses, signs, closed)
        stopped = closed & f.stops_of(fired)
        when = map_fields(best_time, kinds, when, best, now.values, fired, now.t, arrived)
        best = map_fields(best_value, kinds, best, now.values, arrived)
        ended = arrived & (stopped | (now.t >= clock.until))
        attempts = course.attempts + 1.0
        stuck = stepping & (not ended) & (course.h <= 1e-14 * abs(here.t) + 1e-290)
        failed = stuck | (flying & (not ended) & (attempts >= clock.attempts))
        size = total(end) + error
        status = where(failed, where(stuck & (not (size - size == 0.0)), _BROKEN, _CAPPED), course.status)
        if must_stop:
            status = where(ended & (not stopped), _UNSTOPPED, status)
        recorded = arrived
        if history.shape[0] > 0:
            due = where(arrived, due + rows_of_step, due)
            recorded = arrived & ((due >= 1.0) | closed)
            parts = where(recorded, floor(due), 0.0)
            record_step(f, tables, history, rows, recorded, parts, here, now, p, o)
            due = due - parts
        search = replace(search, closing=search.closing & (not (arrived | failed)))
        course = replace(course, here=select(arrived, now, here), attempts=attempts, status=status)
        course, sampling, altered = acted(f, clock, key, case, course, fired, sampled, arrived, closed, ended, p, o)
        here, done, new = course.here, ended | failed, flying & (not flying)
        if history.shape[0] > 0:
            shown = (recorded & (closed | sampling)) | done
            record_change(f, history, rows, shown, closed, here.t, here.s, here.m, p, o)
        if any_lane(done):
            p, case, active, new, waiting = handed_over(
                f, width, out, columns, parameters, cases, waiting, active, done, course, best, when, case, p, o
            )
            if not any_lane(active > 0.5):
                break


fly = compile_inline(_fly)
