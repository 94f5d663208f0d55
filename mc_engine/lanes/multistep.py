"""Adams-Bashforth-Moulton steps in lanes: predict, evaluate, correct, evaluate (PECE), for long smooth arcs.

"abm11" predicts by the explicit Adams formula of order 10 and corrects by the implicit one of order 11, from the same
10 slopes (derivatives of the state) at the last grid points.  A step costs two right-hand sides, whatever the order.
All slopes must belong to one smooth motion.  A flight begins by single steps of DOP853 on the same grid, and so does a
lane anew that has met an event, or whose discrete state a sample of the control has changed.

The methods are stable for short steps only.  An oscillation of w rad/s grows unless step times w is below 0.37, 0.26,
0.18, 0.12, 0.08 for orders 8 to 12 (measured in tests/mc_engine/lanes/test_multistep.py).

E. Hairer, S. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., section III.1; a corrector one
order above the predictor: L. Shampine, M. Gordon, Computer Solution of Ordinary Differential Equations (1975); the
compensated sum of the steps: O. Moller, BIT 5 (1965) 37-50.
"""

from collections import namedtuple
from fractions import Fraction
from typing import Any

import numpy as np

from mc_engine.lanes.adaptive_step import attempt
from mc_engine.lanes.compiler import compile_callable, compile_inline
from mc_engine.lanes.functions import any_lane, where
from mc_engine.lanes.physics_function import physics
from mc_engine.lanes.runge_kutta_pairs import DOP853, LARGEST_STAGES
from mc_engine.lanes.stage_memory import put_stage, stage_memory, stage_sum
from mc_engine.lanes.tuples import add_scaled, map_fields, select, spread

# differences : of neighbouring slopes at the last grid points, in a ring;  newest : index of the last in it
# slope : at the last grid point;  known : how many slopes belong to the present motion, of each lane
# lost : rounding error of the sum of the steps so far
Past = namedtuple("Past", "differences newest slope known lost")


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
    """Weights of the backward differences of slopes that stand for the slopes, besides the newest slope itself.

    A difference is a small part of a slope and its weight is smaller, so the sum is rounded several times more finely.
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


def _begin(tables, memory, s, t):
    none = map_fields(_none, s)
    return Past(memory, 0, none, 0.0 * t, none)


def _restart(past, lanes):
    return Past(past.differences, past.newest, past.slope, where(lanes, 0.0, past.known), past.lost)


begin, restart = compile_inline(_begin), compile_inline(_restart)


def _single(f, tables, t, h, s, m, p, o):
    """State after one step of DOP853."""
    memory = stage_memory(s, LARGEST_STAGES)
    put_stage(memory, 0, spread(f.rhs(t, s, m, p, o), t))
    return attempt(f, tables[:4], memory, t, h, s, m, p, o)


# off the main path: one copy in the kernel, called where needed
single = compile_callable(_single)


def _advance(f, tables, past, t, finish, h, s, m, p, o, flying):
    """(State at the end of a grid step, past): by DOP853 in lanes that do not know enough slopes yet."""
    columns, ahead, behind, at_end, n = tables[4:]
    slope = spread(f.rhs(t, s, m, p, o), t)
    newest = (past.newest if past.newest > 0 else n) - 1
    put_stage(past.differences, newest, map_fields(_difference, slope, past.slope))
    known = past.known + 1.0
    ready = known > float(n)
    starting = flying & (not ready)
    first, last = newest * n, (newest + 1) * n
    end, lost = s, past.lost
    if any_lane(ready):
        mean = map_fields(_plus, slope, stage_sum(past.differences, s, first, last, columns, ahead))
        predicted = spread(f.rhs(finish, add_scaled(s, h, mean), m, p, o), t)
        sum_behind = stage_sum(past.differences, s, first, last, columns, behind)
        correction = add_scaled(sum_behind, at_end, map_fields(_difference, predicted, slope))
        change = map_fields(_change, h, slope, correction, lost)
        end = map_fields(_plus, s, change)
        lost = map_fields(_lost, s, end, change)
    if any_lane(starting):
        end = select(starting, single(f, tables, t, 0.0 * t + h, s, m, p, o), end)
        lost = select(starting, map_fields(_none, s), lost)
    return end, Past(past.differences, newest, slope, known, lost)


advance = compile_inline(_advance)
