"""Events of a lane: zeros of functions of the state, found to full order by shortening the lane's own step.

A step that oversteps an event is taken again from its start with a shorter length, found by a bracketed
secant search (Illinois rule) on the event function itself, so an event is as exact as the integrator.  The
side that has crossed is kept: an event never fires twice on one crossing.  Here only the signs at both ends of a step
tell of an event: a function that crosses twice within one step, or again in what its own event leaves of a step, is
not seen, so the step must be shorter than the time between two events of one kind.  Adaptive steps (`adaptive_flight`)
also end where the function turns.

M. Dowell, P. Jarratt, "A modified regula falsi method", BIT 11 (1971) 168-174.
"""

from collections import namedtuple

from mc_engine.lanes import extrema
from mc_engine.lanes.compiler import compile_callable, compile_inline
from mc_engine.lanes.functions import any_lane, floor, maximum, minimum, where
from mc_engine.lanes.history import look_shared, record_change, record_row
from mc_engine.lanes.physics_function import physics
from mc_engine.lanes.tuples import any_field, least, map_fields, select, spread

EVENTS_PER_STEP = 32
_ITERATIONS = 90
_SECANT_ITERATIONS = 40  # then bisection, which cannot stall

# Part of an adaptive step that holds an event: lengths, senses and rates at both sides, which side moved last, next
# length to look at, how often one was looked at, width at which it is closed
Bracket = namedtuple("Bracket", "low high at_low at_high rate_low rate_high side look looks width")
_FEW = 3.0  # looks at an event with its width; then the width grows
_CHORDS = 8.0  # then every other look halves the bracket, and the width stays: else it would be met far from the zero


@physics
def crossed(before, after, direction):
    """Mask: the event function went through zero; direction 1 rising, -1 falling, 0 either.

    A function that leaves zero has not crossed it: the step that arrived there has.
    """
    rising = (before < 0.0) & (after >= 0.0) & (direction >= 0.0)
    falling = (before > 0.0) & (after <= 0.0) & (direction <= 0.0)
    return rising | falling


@physics
def may_have_crossed(before, after, direction):
    """Mask: `crossed`, or it cannot be told, because the function is not a number."""
    rising = not ((before >= 0.0) | (after < 0.0) | (direction < 0.0))
    falling = not ((before <= 0.0) | (after > 0.0) | (direction > 0.0))
    return rising | falling


@physics
def is_lost(before, after, direction):
    """Mask: the function is not a number at the end, and may have crossed."""
    return may_have_crossed(before, after, direction) & (after != after)


@physics
def _secant(before, after, direction, low, high, unused):
    """Length at which the chord of one event function meets zero; `high` where it does not cross."""
    return where(crossed(before, after, direction), low + (high - low) * (before / (before - after)), high)


@physics
def _halved_where(value, mask):
    return where(mask, 0.5 * value, value)


@physics
def _one_where(mask, unused):
    return where(mask, 1.0, 0.0)


def _locate(f, method, signs, t, finish, s, m, p, o, length, end, g_start, g_end, open_lanes):
    """(length, state, event values) just past the first event of each open lane inside a step from s to `finish`."""
    low, high, side = 0.0 * length, length, 0.0 * length
    g_low, g_high, at_end = g_start, g_end, g_end
    tolerance = 4.5e-16 * (abs(t) + length)
    reach = 0.5 * tolerance
    for iteration in range(_ITERATIONS):
        if not any_lane(open_lanes):
            break
        middle = 0.5 * (low + high)
        guess = least(map_fields(_secant, g_low, g_high, signs, low, high, high))
        chord = (guess >= low) & (guess <= high)
        if iteration >= _SECANT_ITERATIONS:
            chord = chord & (not chord)
        # a chord that meets an end is tried beyond the zero: so the far end of the bracket comes; four times as far
        # each time, for where rounding or a stretch of zeros keeps the sign from changing
        away = minimum(maximum(guess, low + reach), high - reach)
        reach = where(chord & (away != guess), 4.0 * reach, reach)
        guess = where(chord & (away > low) & (away < high), away, middle)
        state = method.single(f, method.tables, t, guess, s, m, p, o)
        values = spread(f.events(minimum(t + guess, finish), state, m, p, o), t)
        after = any_field(map_fields(crossed, g_low, values, signs))
        ahead, back = open_lanes & (not after), open_lanes & after
        g_low = select(ahead, values, map_fields(_halved_where, g_low, back & (side > 0.0)))
        g_high = select(back, values, map_fields(_halved_where, g_high, ahead & (side < 0.0)))
        side = where(back, 1.0, where(ahead, -1.0, side))
        low, high = where(ahead, guess, low), where(back, guess, high)
        end, at_end = select(back, state, end), select(back, values, at_end)
        open_lanes = open_lanes & (high - low > tolerance)
    return high, end, at_end


locate = compile_inline(_locate)


def _look_once(f, lanes, t, s, m, p, o, reached):
    """(best, when, last) with the outputs at an instant that is no grid point, as they are, in some lanes."""
    best, when, last = reached
    seen = look_shared(f, t, s, m, p, o)
    value = f.peaks_of(seen)
    when = map_fields(extrema.end_time, when, best, value, t, lanes, t)
    best = map_fields(extrema.end_value, best, value, lanes)
    return best, when, map_fields(extrema.above, last, f.lasts_of(seen), t, lanes)


look_once = compile_callable(_look_once)


def _follow(f, method, t, finish, h, s, end, m, p, o, g_start, g_end, flying, reached, history, rows):
    """What becomes of a step [t, finish] of length h in which some flying lane meets events.

    s, end : states at both ends of the step as if there were no events; g_start, g_end : event values there.
    reached : running extrema (best, when, last), which look at both sides of each event that does not stop the lane.
    Returns (state, memory, time, stopped, overrun, lost, reached): lanes that stop end at their event, the others at
    `finish`; those are lost of which the values there do not tell whether they have met another.
    Event functions of time see `finish` itself at the end, not the sum t + h: the next step starts from the same
    number, so an event on the grid is met once, neither missed nor met twice by a rounding.
    """
    signs = f.signs_of(g_start)
    pending = flying & any_field(map_fields(crossed, g_start, g_end, signs))
    stopped = pending & (not pending)
    rest, time = t * 0.0 + h, finish
    for _ in range(EVENTS_PER_STEP):
        if not any_lane(pending):
            break
        length, state, values = locate(f, method, signs, t, finish, s, m, p, o, rest, end, g_start, g_end, pending)
        fired = map_fields(crossed, g_start, values, signs)
        now = where(length < rest, minimum(t + length, finish), finish)
        stops = pending & f.stops_of(fired)
        stopped = stopped | stops
        time, end = where(stops, now, time), select(stops, state, end)
        on, hit = pending & (not stops), map_fields(_one_where, fired, t)
        m = select(pending, spread(f.note(now, state, m, p, o, hit), t), m)
        reached = look_once(f, on, now, state, m, p, o, reached)
        if history.shape[0] > 0:
            record_row(f, history, rows, on, now, state, m, p, o)
        switched, memory = f.switch(now, state, m, p, o, hit)
        s, m = select(on, spread(switched, t), s), select(on, spread(memory, t), m)
        t, rest = where(on, now, t), where(on, rest - length, rest)
        reached = look_once(f, on, t, s, m, p, o, reached)
        if history.shape[0] > 0:
            record_change(f, history, rows, on, on, t, s, m, p, o)
        g_start = select(on, spread(f.events(t, s, m, p, o), t), g_start)
        end = select(on, method.single(f, method.tables, t, rest, s, m, p, o), end)
        g_end = select(on, spread(f.events(finish, end, m, p, o), t), g_end)
        pending = on & any_field(map_fields(crossed, g_start, g_end, signs))
    lost = flying & (not stopped) & any_field(map_fields(is_lost, g_start, g_end, signs))
    return end, m, time, stopped, pending, lost, reached


follow = compile_inline(_follow)


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
    usable = (kind != extrema.PEAK) & (cubic > low) & (cubic < high)
    leaves = (kind != extrema.PEAK) & (before * rate_before > 0.0)
    return where(across, where(usable, cubic, low + width * where(leaves, 0.5, u)), high)


@physics
def _near(kind, root, before, after, rate, direction, high, width):
    """Not negative where the side that has crossed is within four widths of the zero; its sense and rate say so too."""
    small = (kind == extrema.PEAK) | (abs(after) < 8.0 * width * abs(rate))
    return where(crossed(before, after, direction), where(small, root + 4.0 * width - high, -1.0), 1.0)


@physics
def _halved_peak(kind, value, mask):
    return where(mask & (kind == extrema.PEAK), 0.5 * value, value)


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
