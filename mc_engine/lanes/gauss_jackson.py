"""Gauss-Jackson steps in lanes, for second-order equations: positions, and their rates, which are states too.

The method sums the accelerations twice.  Rates and positions at the end of a step are computed from both sums and the
accelerations at the last grid points, not from the state before, so rounding errors of a position do not accumulate.
"gj8" uses differences of the accelerations up to the eighth, so accelerations at 9 grid points.

Each step predicts and evaluates once (PE).  A corrector would cost a second evaluation.  Adams formulas need one, since
their prediction alone is stable for short steps only, see `multistep`.  With second sums the prediction alone is
stable: an oscillation of w rad/s does not grow while step times w is below 0.33, 0.24, 0.17, 0.12, 0.09 for gj6 to
gj10.  The acceleration may depend on the rates, which are predicted to the same order, but only weakly, as with drag in
orbit: step times damping rate must be below 0.023, 0.012, 0.006, 0.003, 0.0016, and so must step times twice the
angular velocity of a turning frame, whose Coriolis acceleration depends on the rates.  The order of the method is the
order of the differences plus two; gj10 reaches rounding errors before its order can be seen (all measured in
tests/mc_engine/lanes/test_gauss_jackson.py).

A flight begins with single steps of DOP853 on the same grid.  So does a lane after an event, or after a control sample
that changes its discrete state.  A lane continues with these steps while the derivative of a position differs from its
rate, such as after a landing.

M. Berry, L. Healy, Implementation of Gauss-Jackson integration for orbit propagation, Journal of the Astronautical
Sciences 52 (2004) 331-357: summed, in terms of the accelerations themselves ("ordinate form").
"""

from collections import namedtuple
from fractions import Fraction
from functools import cache
from math import comb
from typing import Any

import numpy as np

from mc_engine.lanes.compiler import compile_inline
from mc_engine.lanes.functions import any_lane, fma, replace, where
from mc_engine.lanes.lane_access import differ
from mc_engine.lanes.multistep import ring_columns, single
from mc_engine.lanes.physics_function import physics
from mc_engine.lanes.runge_kutta_pairs import DOP853
from mc_engine.lanes.stage_memory import put_stage, stage_sums
from mc_engine.lanes.tuples import add_scaled, first_fields, joined, map_fields, select, spread

# accelerations : at the last grid points, in a ring;  newest : index of the last in it
# known : how many of them belong to the present motion, of each lane
# first, second : sums of the accelerations, times the step [m/s], and of these sums, times the step [m]
# first_lost, second_lost : rounding errors of the sums so far;  looks : see `mc_engine.lanes.fixed_step`
Past = namedtuple("Past", "accelerations newest known first second first_lost second_lost looks")


def sum_weights(n: int, predicted: bool) -> tuple[list[Fraction], list[Fraction]]:
    """Two lists of weights of n accelerations, newest first: those added to the sum in a rate, and in a position.

    predicted : True: at the grid point after the newest acceleration; False: at that of the newest.
    With D f the backward difference, h the step: rate / h = sum f + weights f; position / h^2 = sum sum f + weights f,
    where the second sum ends at the newest acceleration if predicted, else one before it.

    Generating functions: -D / log(1 - D) and its square, over 1 - D if predicted; Berry & Healy, appendix.

    >>> [[str(weight) for weight in weights] for weights in sum_weights(2, predicted=True)]
    [['11/12', '-5/12'], ['1/6', '-1/12']]
    """
    inverse = [Fraction(1)]
    for k in range(1, n + 2):
        inverse.append(-sum((inverse[k - i] / (i + 1) for i in range(1, k + 1)), Fraction(0)))
    square = [sum((inverse[i] * inverse[k - i] for i in range(k + 1)), Fraction(0)) for k in range(n + 2)]
    if predicted:
        inverse, square = ([sum(series[: k + 1], Fraction(0)) for k in range(n + 2)] for series in (inverse, square))
    return _of_values(inverse[1 : n + 1]), _of_values(square[2:])


def _of_values(coefficients: list[Fraction]) -> list[Fraction]:
    """Weights of values, newest first, that stand for the coefficients of their backward differences."""
    return [
        sum(((-1) ** i * comb(j, i) * c for j, c in enumerate(coefficients)), Fraction(0))
        for i in range(len(coefficients))
    ]


@cache  # in rational numbers they take milliseconds, and every chunk of cases asks for them
def gauss_jackson_tables(method: str) -> tuple[Any, ...]:
    """The numbers of a method such as "gj8", as kernels take them: those of DOP853, then those of the sums.

    columns : int64[n * n], for each index of the newest of n accelerations the indices of all, newest first
    ahead : float64[2, n * n], their weights in the prediction of rates and of positions, n times
    present : float64[2, n * n], the same at the newest of them;  n
    """
    n = int(method.removeprefix("gj")) + 1
    ahead, present = (
        np.array([np.tile([float(weight) for weight in weights], n) for weights in sum_weights(n, predicted)])
        for predicted in (True, False)
    )
    return *DOP853.tables(), ring_columns(n), ahead, present, n


@physics
def _none(y):
    return 0.0 * y


@physics
def _change(h, summand, lost):
    return fma(h, summand, -lost)


@physics
def _plus(y, change):
    return y + change


@physics
def _lost(y, end, change):
    return (end - y) - change


def _begin(tables, memory, looks, s, t):
    none = tables[-2](map_fields(_none, s))
    return Past(memory, 0, 0.0 * t, none, none, none, none, looks)


def _restart(past, lanes):
    return replace(past, known=where(lanes, 0.0, past.known))


begin, restart = compile_inline(_begin), compile_inline(_restart)


def _added(h, total, summand, lost):
    """(sum after one more summand times h, its rounding error)."""
    change = map_fields(_change, h, summand, lost)
    end = map_fields(_plus, total, change)
    return end, map_fields(_lost, total, end, change)


added = compile_inline(_added)


def _advance(f, tables, past, begin, finish, h, s, m, p, o, flying):
    """(State at the end of a grid step, past): by DOP853 in lanes with too few past accelerations."""
    columns, ahead, present, n, positions_of, rates_of, in_order = tables[4:]
    slope = spread(f.rhs(begin, s, m, p, o), s[0])
    acceleration = rates_of(slope)
    newest = (past.newest if past.newest > 0 else n) - 1
    place, last = newest * n, (newest + 1) * n
    put_stage(past.accelerations, newest, acceleration)
    # the compiler sees that a derivative is the rate itself, and leaves the comparison out
    known = where(differ(positions_of(slope), rates_of(s), s[0]), 0.0, past.known + 1.0)
    ready = known >= float(n)
    starting, beginning = flying & (not ready), known == float(n)
    first, first_lost = added(h, past.first, acceleration, past.first_lost)
    second, second_lost = added(h, past.second, first, past.second_lost)
    end = s
    if any_lane(beginning):
        none = map_fields(_none, first)
        of_rates, of_positions = stage_sums(past.accelerations, none, place, last, columns, present)
        begun = add_scaled(rates_of(s), -h, of_rates)
        first, first_lost = select(beginning, begun, first), select(beginning, none, first_lost)
        begun = add_scaled(add_scaled(positions_of(s), h, begun), -h * h, of_positions)
        second, second_lost = select(beginning, begun, second), select(beginning, none, second_lost)
    if any_lane(ready):
        of_rates, of_positions = stage_sums(past.accelerations, first, place, last, columns, ahead)
        rates, positions = add_scaled(first, h, of_rates), add_scaled(second, h * h, of_positions)
        end = first_fields(in_order(joined(positions, rates)), s)
    if any_lane(starting):
        end = select(starting, single(f, tables, spread(begin, known), spread(h, known), s, m, p, o), end)
    return end, Past(past.accelerations, newest, known, first, second, first_lost, second_lost, past.looks)


advance = compile_inline(_advance)
