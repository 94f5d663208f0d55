"""scipy's DOP853, one case after the other, its right-hand side on plain floats (faster there than on small arrays)."""

import math

import numpy as np
from scipy.integrate import solve_ivp

from tests.benchmarks.peer_codes.entrant import TOLERANCES, Entrant, Flight
from tests.benchmarks.peer_codes.problems import Problem


def flown(problem: Problem, case: int, tolerance: float) -> np.ndarray:
    """End state of one case; the tolerance is relative, and absolute to match the engine's."""
    events = None
    if problem.height is not None:
        events = _event(problem.height)
    first, span = problem.first[:, case], (0.0, problem.duration)
    absolute = 1e-9 if problem.rate is not None else tolerance
    derivative = problem.derivative(case)
    got = solve_ivp(derivative, span, first, "DOP853", events=events, rtol=max(tolerance, 3e-14), atol=absolute)
    return got.y_events[0][0] if events else got.y[:, -1]


def _event(height):
    def reached(t, s):
        return height(math, s)

    reached.terminal, reached.direction = True, -1.0
    return reached


def entrant(problem: Problem) -> Entrant:
    """The peer on a problem; it flies one case in a turn."""

    def build(cases: Problem, value: float, threads: int) -> Flight:
        return lambda: np.array([flown(cases, case, value) for case in range(cases.first.shape[1])]).T

    # on the sliding satellite anything finer stands still
    ladder = (1e-4,) if problem.rate is None else tuple(value for value in TOLERANCES if value > 3e-14)
    return Entrant("scipy", "DOP853", problem, "tolerance", ladder, build, cases=1, checked=2, parallel=False)
