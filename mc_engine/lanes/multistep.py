"""Adams-Bashforth-Moulton steps in lanes: predict, evaluate, correct, evaluate (PECE), for long smooth arcs.

"abm11" predicts by the explicit Adams formula of order 10 and corrects by the implicit one of order 11, from the same
10 slopes (derivatives of the state) at the last grid points.  A step costs two right-hand sides, whatever the order.
All slopes must belong to one smooth motion.  A flight begins with single steps of DOP853 on the same grid.  So does a
lane after an event, or after a control sample that changes its discrete state.

The methods are stable for short steps only.  An oscillation of w rad/s grows unless step times w is below 0.37, 0.26,
0.18, 0.12, 0.075 for orders 8 to 12 (measured in tests/mc_engine/lanes/test_multistep.py).

Outputs between grid points are interpolated by the polynomial through their last values, by backward differences.

E. Hairer, S. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., section III.1; a corrector one
order above the predictor: L. Shampine, M. Gordon, Computer Solution of Ordinary Differential Equations (1975); the
compensated sum of the steps: O. Moller, BIT 5 (1965) 37-50.
"""

from collections import namedtuple
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np

from mc_engine.lanes import extrema
from mc_engine.lanes.adaptive_step import attempt
from mc_engine.lanes.compiler import compile_callable, compile_inline
from mc_engine.lanes.fixed_step import LOOKS, grid_time, last_above, newest_twice, track_by_three
from mc_engine.lanes.functions import any_lane, maximum, minimum, replace, where
from mc_engine.lanes.physics_function import physics
from mc_engine.lanes.runge_kutta_pairs import DOP853, LARGEST_STAGES
from mc_engine.lanes.stage_memory import put_stage, stage_memory, stage_sum, take_stage
from mc_engine.lanes.tuples import add_scaled, any_field, map_fields, select, spread

_ITERATIONS = 3  # of Newton's method between two looks, from a parabola or a chord
# The most that each of the last three differences of an output may be, over the sum of those before: 0.15 at 7.5 steps
# a turn, more beside a jump or a corner.  Of fewer looks than nine it is the last two; of few the last one, over so
# much for each before; of four, none tells of a short pulse.
_FEW, _FADED, _FADED_OF_FEW = 6.0, 0.15, 0.9

# differences : of neighbouring slopes at the last grid points, in a ring;  newest : index of the last in it
# slope : at the last grid point;  known : how many slopes belong to the present motion, of each lane
# lost : rounding error of the sum of the steps so far;  looks : see `mc_engine.lanes.fixed_step`
Past = namedtuple("Past", "differences newest slope known lost looks")


def adams_weights(order: int, implicit: bool) -> list[Fraction]:
    """Weights of the slopes in a step, newest first: integrals of Lagrange's polynomials over the step.

    order : number of slopes; of the implicit formula the newest is at the end of the step, else at its start.

    Hairer, Norsett, Wanner, eqs (III.1.4) and (III.1.8).

    >>> [str(weight) for weight in adams_weights(3, implicit=True)]
    ['5/12', '2/3', '-1/12']
    """
    nodes = [Fraction(int(implicit) - i) for i in range(order)]
    weights = []
    for chosen in nodes:
        polynomial = [Fraction(1)]  # coefficients, lowest power first
        for node in nodes:
            if node != chosen:
                raised, same = [Fraction(0), *polynomial], [*polynomial, Fraction(0)]
                polynomial = [(a - node * b) / (chosen - node) for a, b in zip(raised, same, strict=True)]
        weights.append(sum((c / (power + 1) for power, c in enumerate(polynomial)), Fraction(0)))
    return weights


@cache  # in rational numbers they take milliseconds, and every chunk of cases asks for them
def multistep_tables(method: str) -> tuple[Any, ...]:
    """The numbers of a method such as "abm11", as kernels take them: those of DOP853, then those of the sums.

    columns : int64[n * n], for each index of the newest of n differences of slopes the indices of all, newest first
    ahead, behind : float64[n * n], their weights in the prediction and in the correction, n times
    at_end : weight of one more difference in the correction, to the slope of the predicted end;  n
    """
    order = int(method.removeprefix("abm"))
    n = order - 2
    ahead = _of_differences(adams_weights(order - 1, implicit=False))
    at_end, at_start, *older = adams_weights(order, implicit=True)
    behind = _of_differences([at_end + at_start, *older])
    return *DOP853.tables(), ring_columns(n), np.tile(ahead, n), np.tile(behind, n), float(at_end), n


def ring_columns(n: int) -> np.ndarray:
    """int64[n * n], for each index of the newest of n things in a ring the indices of all, newest first."""
    return np.array([(newest + i) % n for newest in range(n) for i in range(n)], dtype=np.int64)


def _of_differences(weights: list[Fraction]) -> list[float]:
    """Weights of the backward differences of slopes that replace the slopes, other than the newest slope.

    Differences are much smaller than slopes, and so are their weights, which reduces the rounding error several times.
    """
    return [float(-sum(weights[i:])) for i in range(1, len(weights))]


@physics
def _none(y):
    return 0.0 * y


@physics
def _plus(y, change):
    return y + change


@physics
def _difference(slope, before):
    return slope - before


@physics
def _change(h, slope, correction, lost):
    return h * (slope + correction) - lost


@physics
def _lost(y, end, change):
    return (end - y) - change


def _begin(tables, memory, looks, s, t):
    none = map_fields(_none, s)
    return Past(memory, 0, none, 0.0 * t, none, looks)


def _restart(past, lanes):
    return replace(past, known=where(lanes, 0.0, past.known))


begin, restart = compile_inline(_begin), compile_inline(_restart)


def _single(f, tables, t, h, s, m, p, o):
    """State after one step of DOP853."""
    memory = stage_memory(s, LARGEST_STAGES)
    put_stage(memory, 0, spread(f.rhs(t, s, m, p, o), t))
    return attempt(f, tables[:4], memory, t, h, s, m, p, o)


# off the main path: one copy in the kernel, called where needed
single = compile_callable(_single)


def _advance(f, tables, past, begin, finish, h, s, m, p, o, flying):
    """(State at the end of a grid step, past): by DOP853 in lanes with too few past slopes."""
    columns, ahead, behind, at_end, n = tables[4:]
    slope = spread(f.rhs(begin, s, m, p, o), s[0])
    newest = (past.newest if past.newest > 0 else n) - 1
    put_stage(past.differences, newest, map_fields(_difference, slope, past.slope))
    known = past.known + 1.0
    ready = known > float(n)
    starting = flying & (not ready)
    first, last = newest * n, (newest + 1) * n
    end, lost = s, past.lost
    if any_lane(ready):
        mean = map_fields(_plus, slope, stage_sum(past.differences, s, first, last, columns, ahead))
        predicted = spread(f.rhs(finish, add_scaled(s, h, mean), m, p, o), s[0])
        sum_behind = stage_sum(past.differences, s, first, last, columns, behind)
        correction = add_scaled(sum_behind, at_end, map_fields(_difference, predicted, slope))
        change = map_fields(_change, h, slope, correction, lost)
        end = map_fields(_plus, s, change)
        lost = map_fields(_lost, s, end, change)
    if any_lane(starting):
        end = select(starting, single(f, tables, spread(begin, known), spread(h, known), s, m, p, o), end)
        lost = select(starting, map_fields(_none, s), lost)
    return end, Past(past.differences, newest, slope, known, lost, past.looks)


advance = compile_inline(_advance)


# ---- extremes and zeros of outputs between grid points, on the polynomial through the last looks at one motion


@physics
def _at_corner(smooth, corner):
    return where(corner, smooth, 0.0)


@physics
def _smooth_crest(v0, v1, v2, best, smooth):
    return (smooth > 0.0) & extrema.crest(v0, v1, v2, best)


@physics
def _kept(difference, mask):
    return where(mask, difference, 0.0)


@physics
def _next_value(difference, value, ahead, part):
    return difference + part * (ahead * value)


@physics
def _next_slope(value, slope, ahead, part):
    return part * (value + ahead * slope)


@physics
def _next_bend(slope, bend, ahead, part):
    return part * (2.0 * slope + ahead * bend)


def _form_differences(ring, differences, newest, like):
    """Backward differences of the values in a ring buffer, at the newest, by their order."""
    for i in range(LOOKS):
        put_stage(differences, i, take_stage(ring, (newest + LOOKS - i) % LOOKS, like))
    for order in range(1, LOOKS):
        for i in range(LOOKS - 1, order - 1, -1):
            newer, older = take_stage(differences, i - 1, like), take_stage(differences, i, like)
            put_stage(differences, i, map_fields(_difference, newer, older))


form_differences = compile_callable(_form_differences)


def _interpolate(differences, count, x):
    """Value, slope and curvature, per step, of the polynomial through `count` values, x steps after the newest.

    Newton's backward formula, D0 + x (D1 + (x + 1) / 2 (D2 + (x + 2) / 3 (D3 + ...))), with its derivatives.
    E. Hairer, S. Norsett, G. Wanner, section III.1.
    """
    value = map_fields(_none, x)
    slope = bend = value
    for i in range(LOOKS):
        order = LOOKS - 1 - i
        part, ahead = 1.0 / float(order + 1), map_fields(_plus, x, float(order))
        bend = map_fields(_next_bend, slope, bend, ahead, part)
        slope = map_fields(_next_slope, value, slope, ahead, part)
        difference = map_fields(_kept, take_stage(differences, order, x), count > float(order))
        value = map_fields(_next_value, difference, value, ahead, part)
    return value, slope, bend


interpolate = compile_callable(_interpolate)


@physics
def _sum_of_sizes(total, difference, mask):
    return total + where(mask, abs(difference), 0.0)


@physics
def _largest_size(largest, difference, mask):
    return where(mask, maximum(largest, abs(difference)), largest)


@physics
def _smooth_where_faded(smooth, before, last, most, bend, change, crest):
    """`smooth` where the last differences are small and, if crest is 1, the newest curvature like the last; else 0."""
    alike = (crest * bend >= 0.0) | (bend >= extrema.ALIKE * (bend - change))
    return where((last <= most * before) & alike, smooth, 0.0)


def _smooth_of_differences(differences, count, smooth, crest):
    """`smooth` of outputs whose differences decrease with their order; 0 if their values contain a jump or corner."""
    n = minimum(count, float(LOOKS))
    late = n - where(n < _FEW, 1.0, where(n < float(LOOKS), 2.0, 3.0))
    most = where(n < _FEW, _FADED_OF_FEW / (n - 3.0), _FADED)
    before = last = map_fields(_none, smooth)
    for order in range(2, LOOKS):
        difference, mask = take_stage(differences, order, smooth), late <= float(order)
        before = map_fields(_sum_of_sizes, before, difference, not mask)
        last = map_fields(_largest_size, last, difference, mask & (n > float(order)))
    bend, change = take_stage(differences, 2, smooth), take_stage(differences, 3, smooth)
    return map_fields(_smooth_where_faded, smooth, before, last, most, bend, change, crest)


smooth_of_differences = compile_callable(_smooth_of_differences)


def _search_crest(looks, newest, back, t, h, count, lanes, smooth, best, when):
    """(best, when) with the crests next to the value that is `back` steps before the newest, at t."""
    place, newer, older = (newest - back) % LOOKS, (newest - max(back - 1, 0)) % LOOKS, (newest - back - 1) % LOOKS
    v1, v2, middle = take_stage(looks.peaks, place, best), take_stage(looks.peaks, newer, best), 0.0 * t + float(back)
    first, final = middle + 1.0 >= count, middle < 1.0
    v0 = select(first, v1, take_stage(looks.peaks, older, best))
    crests = lanes & any_field(map_fields(extrema.is_top, v0, v1, v2))
    if any_lane(crests):
        low, high = where(first, 0.0, -1.0) - middle, where(final, 0.0, 1.0) - middle
        x = map_fields(extrema.crest_start, v0, v1, v2, middle, first, final)
        for _ in range(_ITERATIONS):
            _, slope, bend = interpolate(looks.peak_differences, count, x)
            x = map_fields(extrema.nearer_crest, x, slope, bend, low, high)
        value, _, _ = interpolate(looks.peak_differences, count, x)
        inside = map_fields(extrema.is_inside, x, value, v1, low, high, smooth)
        top = map_fields(extrema.top, inside, value, v1)
        time = map_fields(extrema.top_time, inside, x, middle, t, h)
        when = map_fields(extrema.end_time, when, best, top, time, crests, t)
        best = map_fields(extrema.end_value, best, top, crests)
    return best, when


search_crest = compile_inline(_search_crest)


def _search_fall(looks, newest, back, t, h, count, lanes, last):
    """Last times above zero, with the falls between the value `back` steps before the newest and the next value."""
    w1, middle = take_stage(looks.lasts, (newest - back) % LOOKS, last), 0.0 * t + float(back)
    w2 = take_stage(looks.lasts, (newest - max(back - 1, 0)) % LOOKS, last)
    falls = map_fields(extrema.falls, w1, w2, lanes)
    if any_lane(any_field(falls)):
        form_differences(looks.lasts, looks.last_differences, newest, last)
        x = chord = map_fields(extrema.fall_start, w1, w2, middle, lanes)
        for _ in range(_ITERATIONS):
            value, slope, _ = interpolate(looks.last_differences, count, x)
            x = map_fields(extrema.nearer_zero, x, value, slope, middle)
        enough = where(count < 4.0, 0.0, 1.0)
        smooth = smooth_of_differences(looks.last_differences, count, map_fields(_kept, enough, falls), 0.0)
        last = map_fields(extrema.later_fall, last, x, chord, smooth, t, h, falls)
    return last


search_fall = compile_inline(_search_fall)


def _search(looks, number, t, h, count, closing, lanes, smooth, best, when, last):
    """Running extrema after a search on the polynomial: for crests next to the value two before the newest, as a corner
    is recognised by the values after it, and for falls next to the one before; next to all earlier ones in lanes that
    have just got enough values; if `closing`, next to the last two, or to all if there are fewer.

    number, t : of the newest value, its time [s];  count : number of values of its motion
    """
    newest, nearest = number % LOOKS, 0 if closing else 1
    form_differences(looks.peaks, looks.peak_differences, newest, best)
    smooth = smooth_of_differences(looks.peak_differences, count, map_fields(_kept, smooth, count >= 4.0), 1.0)
    everywhere = lanes & ((count < float(LOOKS)) if closing else (count == float(LOOKS)))
    for i in range(LOOKS - nearest):
        back = LOOKS - 1 - i
        is_due, known = back < 2 if closing else back == 2, count > float(back)
        crests, falls = known & (lanes if is_due else everywhere), known & (lanes if back == nearest else everywhere)
        if (closing or back > 1) and any_lane(crests):
            best, when = search_crest(looks, newest, back, t, h, count, crests, smooth, best, when)
        if any_lane(falls):
            last = search_fall(looks, newest, back, t, h, count, falls, last)
    return best, when, last


# off the main path: one copy in the kernel, called where needed
search = compile_callable(_search)


def _track_by_all(looks, number, t, h, closing, lanes, count, smooth, seen, lasts, best, when, last):
    """Running extrema after a value that may change them, or that belongs to a motion with few values.

    count : number of values of the motion, including this one
    """
    ended = lanes & (count <= looks.count) & (looks.count >= 2.0)
    if any_lane(ended):
        before = grid_time(number - 1, h, t)
        best, when, last = search(looks, number - 1, before, h, looks.count, True, ended, smooth, best, when, last)
    # of lanes that only fly beside one that ends, the look that would be overwritten here may still be needed
    place = number % LOOKS
    put_stage(looks.peaks, place, select(lanes, seen[4], take_stage(looks.peaks, place, best)))
    put_stage(looks.lasts, place, select(lanes, lasts[1], take_stage(looks.lasts, place, last)))
    # around the end of a motion the parabola has to do, one look later, when five tell of a jump
    beside = (looks.count < 3.0) | ((looks.count < 4.0) & (count <= looks.count))
    corner = map_fields(_at_corner, smooth, beside)
    best, when = track_by_three(number, t, h, False, lanes, corner, seen, best, when)
    if closing:
        corner = map_fields(_at_corner, smooth, count < 4.0)
        best, when = track_by_three(number, t, h, True, lanes, corner, newest_twice(seen), best, when)
    last = last_above(number, t, h, lanes, lanes & (count < 2.0), lasts, last)
    crests = any_field(map_fields(_smooth_crest, seen[1], seen[2], seen[3], best, smooth))
    falls = any_field(map_fields(extrema.falls, lasts[0], lasts[1], lanes))
    wanted = lanes & ((count == float(LOOKS)) | ((crests | falls) & (count > float(LOOKS))))
    if any_lane(wanted):
        best, when, last = search(looks, number, t, h, count, False, wanted, smooth, best, when, last)
    if closing:
        best, when, last = search(looks, number, t, h, count, True, lanes & (count >= 2.0), smooth, best, when, last)
    return best, when, last


track_by_all = compile_callable(_track_by_all)


def _track(past, number, t, h, closing, lanes, smooth, seen, lasts, best, when, last):
    """Running extrema and past after one more value, see `Method`; it is of the motion that its slope will be of."""
    looks, count, v1, v2, v3 = past.looks, past.known + 1.0, seen[2], seen[3], seen[4]
    crests = lanes & any_field(map_fields(extrema.crest, v1, v2, v3, best))
    if any_lane(crests):  # of outputs with corners that is all
        when = map_fields(extrema.end_time, when, best, v2, grid_time(number - 1, h, t), crests, best)
        best = map_fields(extrema.end_value, best, v2, crests)
    smooth_crests = any_field(map_fields(_smooth_crest, seen[1], v1, v2, best, smooth))
    falls = any_field(map_fields(extrema.falls, lasts[0], lasts[1], lanes))
    if closing or any_lane(lanes & (smooth_crests | falls | (count <= float(LOOKS)))):
        best, when, last = track_by_all(
            looks, number, t, h, closing, lanes, count, smooth, seen, lasts, best, when, last
        )
    else:
        put_stage(looks.peaks, number % LOOKS, v3)
        put_stage(looks.lasts, number % LOOKS, lasts[1])
        last = map_fields(extrema.above, last, lasts[1], t, lanes)
    return best, when, last, replace(past, looks=replace(looks, count=count))


track = compile_inline(_track)
