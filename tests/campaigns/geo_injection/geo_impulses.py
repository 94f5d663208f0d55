"""Two impulses from any ellipse to a circle in the plane z = 0, the best over all places: a bound without any theory.

Canonical units and axes of `optimal.py`.
"""

import numpy as np
from scipy.optimize import minimize


def _cost(problem, x):
    """Sum of the speed changes [n]; x [n, 3]: place of departure, longitude of arrival, logarithm of the parameter.

    The conic through two places with a given parameter: Bate, Mueller, White, Fundamentals of Astrodynamics (1971),
    section 5.3.
    """
    u, arrival, p = x[:, 0], x[:, 1], np.exp(x[:, 2])
    e, f = problem.eccentricity, u - problem.perigee
    ci, si = np.cos(problem.plane_change), np.sin(problem.plane_change)
    radial = np.stack([np.cos(u), np.sin(u) * ci, np.sin(u) * si], axis=1)
    transverse = np.stack([-np.sin(u), np.cos(u) * ci, np.cos(u) * si], axis=1)
    r1 = (1 + e) / (1 + e * np.cos(f))
    before = (e * np.sin(f)[:, None] * radial + (1 + e * np.cos(f))[:, None] * transverse) / np.sqrt(1 + e)
    r2, end = problem.ratio, np.stack([np.cos(arrival), np.sin(arrival), 0 * arrival], axis=1)
    after = np.stack([-np.sin(arrival), np.cos(arrival), 0 * arrival], axis=1) / np.sqrt(r2)
    cosine = (radial * end).sum(1)
    ahead = (np.cross(radial, end) * np.cross(radial, transverse)).sum(1) >= 0.0
    sine = np.where(ahead, 1.0, -1.0) * np.sqrt(np.maximum(1.0 - cosine**2, 1e-30))
    one = 1 - r2 / p * (1 - cosine)
    g = r1 * r2 * sine / np.sqrt(p)
    v1 = (r2 * end - one[:, None] * r1[:, None] * radial) / g[:, None]
    v2 = ((1 - r1 / p * (1 - cosine))[:, None] * r2 * end - r1[:, None] * radial) / g[:, None]
    return np.linalg.norm(v1 - before, axis=1) + np.linalg.norm(after - v2, axis=1)


def least_speed(problem):
    """The least sum of two speed changes, from a grid and a simplex search from its best points."""
    u, arrival = np.linspace(0, 2 * np.pi, 73)[:-1] + 0.013, np.linspace(0, 2 * np.pi, 73)[:-1] + 0.031
    grid = np.stack(np.meshgrid(u, arrival, np.linspace(np.log(0.8), np.log(4.0), 24), indexing="ij"), -1)
    values = np.full(grid.shape[:3], np.inf)
    for k, plane in enumerate(grid):
        values[k] = _cost(problem, plane.reshape(-1, 3)).reshape(values.shape[1:])
    best = values.min(axis=(1, 2))
    found = []
    for k in np.argsort(best)[:10]:
        start = grid[k].reshape(-1, 3)[values[k].argmin()]
        options = {"xatol": 1e-10, "fatol": 1e-13, "maxiter": 4000, "maxfev": 4000}
        found.append(minimize(lambda x: _cost(problem, x[None])[0], start, method="Nelder-Mead", options=options).fun)
    return min(found)
