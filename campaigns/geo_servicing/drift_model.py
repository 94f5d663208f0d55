"""Angular motion near a geostationary place to first order, first approximations of a phasing, feedback.  NumPy.

Longitudes in the unit of the drift, drift per revolution (sidereal day), east positive; times in revolutions unless a
name says otherwise.  Numbers in brackets are equations of the source (`MODEL.source`).
"""

import numpy as np

from campaigns.geo_servicing.dynamics import RATE, V0
from mc_engine.physics.frames import TURN

DRIFT_PER_DV = -3.0 * TURN / V0  # rad/rev per m/s of a transverse impulse
E_PER_DV = 2.0 / V0  # length of the eccentricity vector per m/s of it


def perturbation_coefficients(transverse, radial):
    """(b_s [rad/rev^2], b_r [rad/rev]) of (3.46) for mean accelerations [m/s^2] ahead and outward.

    Over a coast t the longitude gains b_s t^2 + b_r t and the drift 2 b_s t.  The printed coefficients are damaged;
    derived here from Gauss's equations on a circle: drift rate -3 g_s / r0, and -2 g_r / V0 of the mean longitude.
    """
    revolution = TURN / RATE
    return -1.5 * RATE / V0 * transverse * revolution**2, -2.0 * radial / V0 * revolution


def after_correction(y, v, u, t, b_s=0.0, b_r=0.0):
    """(longitude, drift) a coast t after a correction u.  (3.46)"""
    return y + (v + u) * t + b_s * t * t + b_r * t, v + u + 2.0 * b_s * t


def largest_last(y_tolerance, v_tolerance, e_change, sigma, rest):
    """Largest last correction [deg/rev] whose execution error leaves the end within its tolerances (3 sigma).

    Tolerances in deg and deg/rev;  e_change : what it may do to the eccentricity;  rest : time to the check [rev]
    """
    return min(y_tolerance / (3.0 * sigma * rest), v_tolerance / (3.0 * sigma), 540.0 * e_change)


def braking(y, v, last, shortest):
    """(corrections, coasts before them) that only brake: the cheapest profile.  (3.32)-(3.35)

    last : size of the last correction;  shortest : float64[n], least coasts
    """
    n, sign, t = len(shortest), np.sign(v), shortest.copy()
    u = np.append(np.full(n - 1, -(abs(v) - last) / (n - 1) * sign), -last * sign)
    drift = v + np.cumsum(u)[:-1]  # in the later coasts
    t[0] = max(t[0], -(y + (drift * t[1:]).sum()) / v)
    return u, t


def fastest(y, v, last, shortest):
    """(corrections, coasts) that hurry first and brake then, in the units of `braking`.

    The first as of two that bring longitude and drift to zero, derived here: v + u1 + u2 = 0 and y + v first +
    (v + u1) later = 0; the rest as in `braking`, (3.32)-(3.35), from the state after the first.
    """
    first, later = shortest[0], shortest[1:].sum()
    u1 = -(y + v * (first + later)) / later
    after = y + v * first, v + u1
    u, rest = braking(*after, last, shortest[1:]) if len(shortest) > 2 else ([-after[1]], shortest[1:])
    return np.append(u1, u), np.append(first, rest)


def best_corrections(a, b, weight, terminal, sigma):
    """(gains [n, 2], matrices [n + 1, 2, 2] of the cost to go from each step and at the end) of u_k = -gains[k] x_k.

    Bellman's recursion, equations (3.25)-(3.30), where they are destroyed; their remains in (3.53)-(3.57) agree.  For
    x_{k+1} = A_k x_k + B_k (1 + mu_k) u_k, mu_k independent, of mean zero and 1-sigma `sigma`: least mean of
    sum(w u^2) + x_end' L x_end.  a : float64[n, 2, 2];  b : float64[n, 2];  weight : w;  terminal : L
    """
    gains, costs = np.zeros((len(a), 2)), np.array([terminal] * (len(a) + 1))
    for k in reversed(range(len(a))):
        pull = costs[k + 1] @ b[k]
        size = weight + (1.0 + sigma**2) * b[k] @ pull
        gains[k] = a[k].T @ pull / size
        costs[k] = a[k].T @ costs[k + 1] @ a[k] - size * np.outer(gains[k], gains[k])
    return gains, costs


def planned_cost(b, costs, u, sigma) -> float:
    """Mean cost, in the unit of `costs`, that errors of planned corrections u, float64[n], leave if later ones answer.

    Derived here from the recursion: correction k adds the variance (sigma u_k)^2 along b_k, which costs_{k+1} weighs.
    """
    return float(sum(sigma**2 * u[k] ** 2 * b[k] @ costs[k + 1] @ b[k] for k in range(len(u))))
