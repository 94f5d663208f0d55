"""Optimal corrections under errors that grow with them: Bellman's recursion for a linear system.  NumPy.

x_{k+1} = A_k x_k + B_k (1 + mu_k) u_k + C_k + xi_k with mu_k of mean zero and 1-sigma `sigma`, independent of the
additive noise xi_k, which changes no correction.  Wanted: least mean of sum(x' G x + w u^2) + x_end' L x_end.
Equations (3.25)-(3.30) of the source (`model.SOURCE`), where they are destroyed; their remains in (3.53)-(3.57) agree.
"""

from collections import namedtuple

import numpy as np

# u_k = -gains[k] x_k - offsets[k], float64[n, 2] and [n]; costs[k]: matrix of the cost to go at step k, [n + 1, 2, 2]
Corrections = namedtuple("Corrections", "gains offsets costs")


def best_corrections(a, b, c, running, weight, terminal, sigma) -> Corrections:
    """The corrections of least mean cost, equations (3.25)-(3.30).

    a : float64[n, 2, 2];  b, c : float64[n, 2];  running, terminal : float64[2, 2];  weight : w
    """
    n = len(a)
    gains, offsets, costs = np.zeros((n, 2)), np.zeros(n), np.zeros((n + 1, 2, 2))
    costs[n], linear = terminal, np.zeros(2)
    for k in reversed(range(n)):
        pull = costs[k + 1] @ b[k]
        size = weight + (1.0 + sigma**2) * b[k] @ pull
        gains[k] = a[k].T @ pull / size
        later = costs[k + 1] @ c[k] + linear
        offsets[k] = b[k] @ later / size
        costs[k] = running + a[k].T @ costs[k + 1] @ a[k] - size * np.outer(gains[k], gains[k])
        linear = (a[k] - np.outer(b[k], gains[k])).T @ later
    return Corrections(gains, offsets, costs)


def planned_cost(b, costs, u, sigma) -> float:
    """Mean cost, in the unit of `costs`, that the execution errors of planned corrections leave if later ones answer.

    u : float64[n], the corrections.

    Derived here from the recursion: correction k adds the variance (sigma u_k)^2 along b_k, which costs_{k+1} weighs.
    """
    return float(sum(sigma**2 * u[k] ** 2 * b[k] @ costs[k + 1] @ b[k] for k in range(len(u))))
