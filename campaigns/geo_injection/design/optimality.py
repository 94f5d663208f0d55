"""Check that a sequence is an optimum: Hamiltonian and switching function along the flight, canonical units."""

from collections import namedtuple
from collections.abc import Iterator
from typing import Any

import numpy as np

from campaigns.geo_injection.design.coast import coast
from campaigns.geo_injection.design.optimal import Problem, Solution, coast_hamiltonian

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(48)


# A burn or a coast.  t: canonical, after the first ignition, [n];  states: [n, 12];  mass: over the initial one
# switching: negative where thrust pays, positive where it does not;  hamiltonian: zero on an optimum
Arc = namedtuple("Arc", "burning t states mass switching hamiltonian")


def _flown(problem: Problem, start: np.ndarray, mass: float, times: np.ndarray) -> np.ndarray:
    """States [n, 12] at the times [n] of a burn, canonical."""
    from campaigns.geo_injection.design.powered_arc import fly_burns  # imports numba

    repeated = np.repeat(start[None], times.size, axis=0)
    return fly_burns(repeated, np.full(times.size, mass), times, problem.thrust, problem.flow)


def arcs(solution: Solution, n: int = 200) -> list[Arc]:
    """All arcs in turn, n instants each.

    H = s (k - T |p| / m - flow l) + q.v - p.g with s = 1 on burns, l' = -s T |p| / m^2, l = 0 at the end, and k such
    that the bracket, the switching function, is zero at the last cut-off.
    """
    return list(_backward(solution, n))[::-1]


def _backward(solution: Solution, n: int) -> Iterator[Arc]:
    """The arcs from the last to the first, canonical units: the mass costate is known at the end, where it is 0."""
    problem = solution.problem
    masses = 1.0 - problem.flow * np.concatenate([[0.0], np.cumsum(solution.durations)])
    mass_costate, unit = 0.0, problem.thrust / masses[-1]

    def arc(burning: bool, begin: float, t: np.ndarray, states: np.ndarray, mass: np.ndarray, costate: Any) -> Arc:
        size = np.linalg.norm(states[:, 6:9], axis=1)
        switching = unit - problem.thrust * size / mass - problem.flow * costate
        return Arc(burning, begin + t, states, mass, switching, burning * switching + coast_hamiltonian(states))

    for k in reversed(range(problem.burns)):
        start, duration, begin = solution.states[2 * k], solution.durations[k], solution.ignitions[k]
        t = np.linspace(0.0, duration, n)
        costate = mass_costate + np.array([_push(problem, start, masses[k], low, duration) for low in t])
        yield arc(True, begin, t, _flown(problem, start, masses[k], t), masses[k] - problem.flow * t, costate)
        mass_costate = float(costate[0])
        if k > 0:
            t = np.linspace(0.0, solution.coasts[k - 1], n)
            states = coast(np.repeat(solution.states[2 * k - 1][None], n, axis=0), t)
            yield arc(False, begin - t[-1], t, states, np.full(n, masses[k]), mass_costate)


def _push(problem: Problem, start: np.ndarray, mass: float, low: float, high: float) -> float:
    """Integral of T |p| / m^2, the mass costate's rate, over a part of a burn, by Gauss's rule; canonical units."""
    times = 0.5 * (high - low) * _POINTS + 0.5 * (high + low)
    size = np.linalg.norm(_flown(problem, start, mass, times)[:, 6:9], axis=1)
    return float(0.5 * (high - low) * (_WEIGHTS * problem.thrust * size / (mass - problem.flow * times) ** 2).sum())


def is_optimal(solution: Solution, tolerance: float = 1e-9) -> bool:
    """Whether the switching function has its right sign all along: else another burn would pay, or one too many is."""
    return all(bool(((arc.switching if arc.burning else -arc.switching) < tolerance).all()) for arc in arcs(solution))
