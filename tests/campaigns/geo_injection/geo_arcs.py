"""The arcs of an optimum with the mass costate integrated along them, which the design does without."""

from collections import namedtuple

import numpy as np

from campaigns.geo_injection.design.coast import coast
from campaigns.geo_injection.design.optimal import coast_hamiltonian
from campaigns.geo_injection.design.powered_arc import fly_burns

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(48)
# A burn or a coast.  t: after the first ignition, [n];  switching: negative where thrust pays, positive where it does
# not;  hamiltonian: zero on an optimum
Arc = namedtuple("Arc", "burning t switching hamiltonian")


def arcs(solution, n=200):
    """All arcs in turn, n instants each.

    By eq. (13) of the source with a mass costate l, in canonical units:
    H = s (k - T |p| / m - flow l) + q.v - p.g with s = 1 on burns, l' = -s T |p| / m^2, and k such that the bracket,
    the switching function, is zero at the last cut-off.  The mass costate l is 0 at the end, so the arcs are found from
    the last to the first; its rate is integrated by Gauss's rule.
    """
    problem, states = solution.problem, solution.states
    masses = 1.0 - problem.flow * np.concatenate([[0.0], np.cumsum(solution.durations)])
    costate, found = np.zeros(1), []

    def keep(burning, t, y, mass):
        """Append the arc through the states y [n, 12], canonical units."""
        push = problem.thrust * np.linalg.norm(y[:, 6:9], axis=1) / mass
        switching = problem.thrust / masses[-1] - push - problem.flow * costate
        found.append(Arc(burning, t, switching, burning * switching + coast_hamiltonian(y)))

    for k in reversed(range(problem.burns)):
        start, duration, ignition = states[2 * k], solution.durations[k], solution.ignitions[k]
        t = np.linspace(0.0, duration, n)
        half = 0.5 * (duration - t[:, None])
        times = (duration - half + half * _POINTS).ravel()  # [n * 48], from each instant to the cut-off
        primer = fly_burns(start, masses[k], times, problem.thrust, problem.flow)[:, 6:9]
        rates = problem.thrust * np.linalg.norm(primer, axis=1) / (masses[k] - problem.flow * times) ** 2
        costate = costate[0] + (half * _WEIGHTS * rates.reshape(n, -1)).sum(axis=1)
        flown = fly_burns(start, masses[k], t, problem.thrust, problem.flow)
        keep(True, ignition + t, flown, masses[k] - problem.flow * t)
        if k > 0:
            t = np.linspace(0.0, solution.coasts[k - 1], n)
            costate = costate[:1]
            keep(False, ignition - t[-1] + t, coast(states[2 * k - 1], t), masses[k])
    return found[::-1]
