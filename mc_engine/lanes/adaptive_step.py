"""One attempt of an adaptive Runge-Kutta step in lanes, its error, and the event values at its end.

Every lane has its own time, step length and error.  The stages are kept in memory, so a step is a short loop over the
tables of the method (`runge_kutta_pairs`).
"""

from collections import namedtuple

from mc_engine.lanes.compiler import compile_inline
from mc_engine.lanes.elementary import exp, log
from mc_engine.lanes.extrema import CORNER, EVENT, LAST, PEAK
from mc_engine.lanes.functions import exponent, fma, mantissa, maximum, minimum, rint, sqrt, two_to, where
from mc_engine.lanes.physics_function import physics
from mc_engine.lanes.runge_kutta_pairs import LARGEST_STAGES
from mc_engine.lanes.stage_memory import put_stage, stage_memory, stage_sum, take_stage
from mc_engine.lanes.tuples import add_scaled, joined, map_fields, spread, total

# What is known at one instant of a flight: time, state, memory, derivative of the state; then, for every event, peak
# and last time that is looked for, its sense (the function of which a zero is sought), its value and its rate.
# The sense of an event or of a last time is its value, the sense of a peak is its rate.
Instant = namedtuple("Instant", "t s m k senses rates values")

SAFETY, SHRINK, GROW = 0.9, 0.2, 6.0
_FLAT = 1e-8  # of a value: above the rounding of its rate, which is taken over 1e-5 of a step
DAMPING = 0.01  # weight of the second error estimate, Hairer's DOP853


@physics
def weight(before, after, atol, rtol):
    """One over the tolerance of a component."""
    return 1.0 / (atol + rtol * maximum(abs(before), abs(after)))


@physics
def weighted_square(error, weight):
    """Square of the error in units of the tolerance."""
    x = error * weight
    return x * x


def _attempt(f, tables, memory, t, h, s, m, p, o):
    """State after a step of length h [s] from state s, whose derivative is stage 0; fills the other stages."""
    nodes, starts, columns, weights = tables
    end = s
    for i in range(1, nodes.shape[0]):
        end = add_scaled(s, h, stage_sum(memory, s, starts[i], starts[i + 1], columns, weights))
        put_stage(memory, i, spread(f.rhs(t + nodes[i] * h, end, m, p, o), t))
    return end


attempt = compile_inline(_attempt)


def _step_error(tables, memory, h, s, end, atol, rtol):
    """Error of the step just attempted: 1 is what the tolerances allow, root mean square over the state.

    Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed., eqs (4.11) and (10.17 ff).
    """
    nodes, starts, columns, weights = tables
    n = nodes.shape[0]
    first = stage_sum(memory, s, starts[n], starts[n + 1], columns, weights)
    second = stage_sum(memory, s, starts[n + 1], starts[n + 2], columns, weights)
    per_tolerance = map_fields(weight, s, end, atol, rtol)
    high = total(map_fields(weighted_square, first, per_tolerance))
    low = total(map_fields(weighted_square, second, per_tolerance))
    both = (high + DAMPING * low) * float(len(atol))
    return abs(h) * high / sqrt(where(both == 0.0, 1.0, both))


step_error = compile_inline(_step_error)


@physics
def ideal_factor(error, power):
    """error**power to three digits: the factor from a step's length to the one whose error would be 1.

    power : -1 over the order.  log2 is a parabola over each octave, 2**f a cubic.
    """
    known = minimum(maximum(error, 1e-20), 1e20)
    m = mantissa(known)
    y = power * (exponent(known) + fma(m, fma(m, -1.0 / 3.0, 2.0), -5.0 / 3.0))
    n = rint(y)
    f = y - n
    return two_to(n) * fma(f, fma(f, fma(f, 0.0558, 0.2402), 0.6931), 1.0)


@physics
def next_length(length, error, ideal, last_ideal):
    """Length [s] of the attempt after one of this length and error.

    ideal, last_ideal : lengths whose error would have been 1, in this step and the one before.  If they decrease, the
    next one is expected to decrease by the same ratio, which avoids most rejected steps towards air or a perigee.

    K. Gustafsson, ACM Transactions on Mathematical Software 20 (1994) 496-517.
    """
    wanted = SAFETY * ideal * minimum(1.0, ideal / last_ideal)
    bounded = minimum(GROW * length, maximum(SHRINK * length, wanted))
    # an error that is no number fails the comparison and shrinks the step as much as allowed
    return where(error < 1e20, bounded, SHRINK * length)


def _first_length(f, t, s, k, m, p, o, atol, rtol, order, longest):
    """A first step length [s]: Hairer, Norsett, Wanner, section II.4, "Starting step size"."""
    n = float(len(atol))
    per_tolerance = map_fields(weight, s, s, atol, rtol)
    d0 = sqrt(total(map_fields(weighted_square, s, per_tolerance)) / n)
    d1 = sqrt(total(map_fields(weighted_square, k, per_tolerance)) / n)
    small = (d0 < 1e-5) | (d1 < 1e-5)
    h = minimum(where(small, 1e-6, 0.01 * d0 / where(small, 1.0, d1)), longest)
    later = spread(f.rhs(t + h, add_scaled(s, h, k), m, p, o), t)
    d2 = sqrt(total(map_fields(weighted_square, map_fields(_difference, later, k), per_tolerance)) / n) / h
    steep = maximum(d1, d2)
    flat = steep <= 1e-15
    guess = exp(log(0.01 / where(flat, 1.0, steep)) / order)
    length = minimum(minimum(100.0 * h, where(flat, maximum(1e-6, 1e-3 * h), guess)), longest)
    return where(length == length, length, longest)  # of a derivative that is not a number no length can be told


first_length = compile_inline(_first_length)


@physics
def _difference(a, b):
    return a - b


@physics
def _rate(kind, value, ahead, behind, inverse):
    """Central for a peak, whose place it decides; forward for what only guides a search: one look less."""
    return where(kind == PEAK, 0.5 * (ahead - behind), ahead - value) * inverse


@physics
def _sense_of(kind, value, rate, sense_before, rate_before, value_before, later, reach):
    """Rate of a peak, else the value; on zero, where an event has just ended a step, the side it is going to.

    What has left zero, and hardly `later` [s] is on the other side but still going as it did, is there by rounding.
    """
    same = (later < reach) & ((later > 0.0) | (value == value_before))  # else the model has changed the state
    rounded = same & (value * rate < 0.0) & (sense_before * rate > 0.0) & (rate_before * rate > 0.0)
    return where(kind == PEAK, rate, where((value == 0.0) | rounded, 1e-30 * rate, value))


@physics
def best_value(kind, best, value, mask):
    """Largest value of a peak, NaN once a value was NaN; for all other kinds the present value."""
    return where(mask & ((value > best) | (value != value) | (kind == LAST) | (kind == EVENT)), value, best)


@physics
def best_time(kind, when, best, value, fired, t, mask):
    """Time of the best value of a peak, of the last moment above zero, of the last event."""
    peak = (kind == PEAK) | (kind == CORNER)
    news = where(peak, where(value > best, 1.0, 0.0), where(fired | ((kind == LAST) & (value > 0.0)), 1.0, 0.0))
    lost = (kind != EVENT) & (value != value)
    return where(mask & ((news > 0.5) | lost), where(lost, value, t), when)


@physics
def jump_time(kind, when, best, value, t, mask):
    """Time of the best value of a peak that jumps, at a sample of the control or an event."""
    peak = (kind == PEAK) | (kind == CORNER)
    return where(mask & peak & (value > best), t, when)


@physics
def is_lost(kind, value):
    """Mask: the function of an event is NaN."""
    return (kind == EVENT) & (value != value)


@physics
def arm(kind, sense0, value0, sense1, value1, best, h):
    """1 where a crossing counts; a peak counts if its top may beat the best so far.

    If the tangents meet within the step, they bound the top.  Otherwise the curve has an inflection, and nothing bounds
    the top; but a peak that is tiny compared with its value comes from rounding.
    """
    hill = (sense0 > 0.0) & (sense1 < 0.0)
    x = (value1 - value0 - sense1 * h) / where(hill, sense0 - sense1, 1.0)
    steep = (sense0 - sense1) * h > _FLAT * maximum(abs(value0), abs(value1))
    promising = hill & ((value0 + sense0 * x > best) | (((x < 0.0) | (x > h)) & steep))
    return where(kind == PEAK, where(promising, 1.0, 0.0), where(kind == CORNER, 0.0, 1.0))


@physics
def turn_length(kind, sense0, rate0, sense1, rate1, h):
    """Length to the turn of a sense that may have crossed zero and come back; h where it has not.

    One of the two crossings has the direction of the event, whichever that is.  The tangents at both ends bound a sense
    without inflection; a crossing is possible only if they meet beyond zero.
    """
    down = (sense0 > 0.0) & (sense1 > 0.0) & (rate0 < 0.0) & (rate1 > 0.0)
    up = (sense0 < 0.0) & (sense1 < 0.0) & (rate0 > 0.0) & (rate1 < 0.0)
    turning = (down | up) & ((kind == EVENT) | (kind == LAST))
    x = (sense1 - sense0 - rate1 * h) / where(turning, rate0 - rate1, 1.0)
    reaches = (sense0 + rate0 * x) * sense0 <= 0.0
    return where(turning & reaches & (x > 0.02 * h) & (x < 0.98 * h), x, h)


def _watch(f, t, s, m, p, o):
    """Events, then the values of which peaks and last times are sought, in one tuple."""
    seen = spread(f.observe(t, s, m, p, o), t)
    return joined(spread(f.events(t, s, m, p, o), t), f.peaks_of(seen), f.lasts_of(seen))


watch = compile_inline(_watch)


def _sense(f, t, s, k, here, p, o, reach):
    """The `Instant` at a state and its derivative, after `here` or at the same time.

    Rates along the flight are differences over the tangent; central ones are exact up to the square of `reach` [s].
    """
    m = here.m
    values = watch(f, t, s, m, p, o)
    kinds = f.kinds_of(values)
    ahead = watch(f, t + reach, add_scaled(s, reach, k), m, p, o)
    behind = watch(f, t - reach, add_scaled(s, -reach, k), m, p, o)
    rates = map_fields(_rate, kinds, values, ahead, behind, 1.0 / reach)
    later = t - here.t
    senses = map_fields(_sense_of, kinds, values, rates, here.senses, here.rates, here.values, later, reach)
    return Instant(t, s, m, k, senses, rates, values)


# inlined, what a model does not watch costs nothing
sense = compile_inline(_sense)


def _glance(f, tables, h, here, p, o):
    """State a length h [s] after `here`, by a separate step that does not change the flight."""
    memory = stage_memory(here.s, LARGEST_STAGES)
    put_stage(memory, 0, here.k)
    return attempt(f, tables, memory, here.t, h, here.s, here.m, p, o)


def _leap(f, tables, h, here, p, o, atol, rtol):
    """(end, derivative there, error) of one attempt of length h [s] from `here`."""
    memory = stage_memory(here.s, LARGEST_STAGES)
    put_stage(memory, 0, here.k)
    end = attempt(f, tables, memory, here.t, h, here.s, here.m, p, o)
    error = step_error(tables, memory, h, here.s, end, atol, rtol)
    return end, take_stage(memory, tables[0].shape[0] - 1, here.k), error


leap = compile_inline(_leap)
glance = compile_inline(_glance)
