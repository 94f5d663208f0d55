"""The two-burn problem without costates: thrust angles as polynomials, a general optimiser, a fixed-step integrator.

Nothing of the shooting method is in here; canonical units and axes are those of `optimal.py`.
"""

import numpy as np
from scipy.optimize import minimize

DEGREES = (6, 2)  # of the two angles, in the first and the last burn
STEPS = (80, 30)


def _coast(y, dt):
    """Kepler's motion by Stumpff's series in universal variables: Curtis, 3rd ed., algorithms 3.3, 3.4."""
    r, v = y[:, :3], y[:, 3:6]
    r0, vr = np.linalg.norm(r, axis=1), (r * v).sum(1) / np.linalg.norm(r, axis=1)
    alpha = 2.0 / r0 - (v * v).sum(1)
    x = alpha * dt
    for _ in range(60):
        z = alpha * x * x
        c, s = (1 - np.cos(np.sqrt(z))) / z, (np.sqrt(z) - np.sin(np.sqrt(z))) / z**1.5
        f = r0 * vr * x * x * c + (1 - alpha * r0) * x**3 * s + r0 * x - dt
        slope = r0 * vr * x * (1 - z * s) + (1 - alpha * r0) * x * x * c + r0
        x = x - f / slope
    f, g = 1 - x * x / r0 * c, dt - x**3 * s
    place = f[:, None] * r + g[:, None] * v
    r1 = np.linalg.norm(place, axis=1)
    f1, g1 = (z * s - 1) * x / (r0 * r1), 1 - x * x / r1 * c
    return np.concatenate([place, f1[:, None] * r + g1[:, None] * v], axis=1)


def _burn(y, mass, duration, angles, problem, steps):
    """RK4 over equal steps; angles [n, 2, degree + 1] in powers of the share of the burn."""
    h = duration / steps
    powers = np.arange(angles.shape[2])

    def rate(share, y):
        phi, psi = np.einsum("nak,k->an", angles, share**powers)
        push = problem.thrust / (mass - problem.flow * share * duration)
        pointing = np.stack([np.cos(psi) * np.cos(phi), np.cos(psi) * np.sin(phi), np.sin(psi)], axis=1)
        r3 = (y[:, :3] ** 2).sum(1) ** 1.5
        return np.concatenate([y[:, 3:], -y[:, :3] / r3[:, None] + push[:, None] * pointing], axis=1)

    for k in range(steps):
        a, b = k / steps, (k + 0.5) / steps
        h1 = h[:, None]
        k1 = rate(a, y)
        k2 = rate(b, y + 0.5 * h1 * k1)
        k3 = rate(b, y + 0.5 * h1 * k2)
        k4 = rate((k + 1.0) / steps, y + h1 * k3)
        y = y + h1 / 6.0 * (k1 + 2 * k2 + 2 * k3 + k4)
    return y


def _misses(problem, x):
    """The five conditions of the final circle, [n, 5]; x [n, ...]: place, two burns, coast, angles."""
    c, s = np.cos(x[:, 0]), np.sin(x[:, 0])
    ci, si = np.cos(problem.plane_change), np.sin(problem.plane_change)
    y = np.stack([c, s * ci, s * si, -s, c * ci, c * si], axis=1)
    n1 = 2 * (DEGREES[0] + 1)
    first, last = x[:, 4 : 4 + n1].reshape(len(x), 2, -1), x[:, 4 + n1 :].reshape(len(x), 2, -1)
    y = _burn(y, 1.0, x[:, 1], first, problem, STEPS[0])
    y = _coast(y, x[:, 3])
    y = _burn(y, 1.0 - problem.flow * x[:, 1], x[:, 2], last, problem, STEPS[1])
    r, v = y[:, :3], y[:, 3:]
    h = np.cross(r, v)
    size = np.sqrt(problem.ratio)
    speed, rate = (v * v).sum(1) * problem.ratio - 1.0, (r * v).sum(1) / size
    return np.stack([h[:, 0] / size, h[:, 1] / size, (r * r).sum(1) / problem.ratio**2 - 1.0, rate, speed], axis=1)


def shortest(problem, guess):
    """(total burn time, largest miss) of the optimiser's best; guess: place, two burns, coast.

    The first thrust begins along the velocity and turns with the place; the last one begins against the y axis.
    """
    start = np.zeros(4 + 2 * (DEGREES[0] + 1) + 2 * (DEGREES[1] + 1))
    start[:4] = guess
    start[4], start[5] = guess[0] + 0.5 * np.pi, guess[1]
    start[4 + DEGREES[0] + 1] = 0.35
    last = 4 + 2 * (DEGREES[0] + 1)
    start[last], start[last + DEGREES[1] + 1] = -0.5 * np.pi, 0.4

    def slopes(x):
        steps = 1e-6 * np.eye(x.size)
        both = _misses(problem, np.concatenate([x + steps, x - steps]))
        return (both[: x.size] - both[x.size :]).T / 2e-6

    weights = np.eye(start.size)[1] + np.eye(start.size)[2]
    conditions = {"type": "eq", "fun": lambda x: _misses(problem, x[None])[0], "jac": slopes}
    found = minimize(
        lambda x: x[1] + x[2], start, jac=lambda x: weights, constraints=conditions, method="SLSQP",
        options={"maxiter": 400, "ftol": 1e-9},
    )  # fmt: skip
    return found.fun, np.abs(_misses(problem, found.x[None])).max()
