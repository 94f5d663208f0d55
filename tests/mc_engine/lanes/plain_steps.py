"""Steps over Python floats, for the twins of multistep methods, and the cases that they fly."""

import numpy as np

from mc_engine.lanes.functions import fma
from mc_engine.lanes.runge_kutta_pairs import DOP853

RANDOM = np.random.default_rng(4)
MIXED = {
    "rate_rad_s": RANDOM.uniform(0.2, 0.9, 21),
    "x0_km": RANDOM.normal(size=21),
    "v0_m_s": 1e3 * RANDOM.normal(size=21),
    "gain_1_s": RANDOM.uniform(0.0, 0.5, 21),
    "noise_m_s2": np.where(np.arange(21) % 3 == 0, 0.0, 100.0),
    "until_s": 5.3,
    "every": 17.0,
}


def ahead(s, h, slopes):
    """State plus h times its slopes, rounded once."""
    return type(s)(*(fma(h, slope, y) for y, slope in zip(s, slopes, strict=True)))


def weighted(weights, slopes, start):
    """Weighted sum of slopes, one rounding a term."""
    for weight, slope in zip(weights, slopes, strict=True):
        start = ahead(start, weight, slope)
    return start


def fields(function, *states):
    """function of each field of some states."""
    return type(states[0])(*(function(*row) for row in zip(*states, strict=True)))


def dop853(rhs, t, h, s):
    """State after one step of DOP853."""
    slopes, nothing = [rhs(t, s)], fields(lambda y: 0.0 * y, s)
    for node, row in zip(DOP853.nodes, DOP853.rows, strict=True):
        end = ahead(s, h, weighted(row.values(), [slopes[stage] for stage in row], nothing))
        slopes.append(rhs(t + node * h, end))
    return ahead(s, h, weighted(DOP853.weights.values(), [slopes[stage] for stage in DOP853.weights], nothing))
