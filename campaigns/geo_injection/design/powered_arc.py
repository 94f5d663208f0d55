"""Powered arcs with their primer vector: fixed steps of order 8, compiled.  Canonical units.

Importing this module imports numba, so whoever designs imports it when a design is wanted and not before.

State y of twelve: place, velocity, primer vector p (the thrust's direction, minus the costate of the velocity) and its
rate q (the costate of the place).  The steps are fixed, so an arc is a smooth function of its start and its duration:
finite differences over it are as good as their rounding.
"""

import numpy as np

from mc_engine.flight.kernel import kernel_of
from mc_engine.lanes.compiler import compile_inline
from mc_engine.lanes.runge_kutta_pairs import DOP853

_NODES, _STARTS, _COLUMNS, _WEIGHTS = DOP853.tables()
_STAGES = len(DOP853.nodes) + 1
STEP = 0.1  # canonical time: a sixtieth of the parking orbit's revolution


@compile_inline
def _rates(y, acceleration, out):
    """Time derivative of y under a thrust acceleration along p: eqs (1) and (16) of the source, in vectors.

    r'' = -r/r^3 + f p/|p|,  p' = q,  q' = -p/r^3 + 3 (r.p) r/r^5.
    """
    r2 = y[0] * y[0] + y[1] * y[1] + y[2] * y[2]
    u3 = 1.0 / (r2 * np.sqrt(r2))
    push = acceleration / np.sqrt(y[6] * y[6] + y[7] * y[7] + y[8] * y[8])
    tide = 3.0 * (y[0] * y[6] + y[1] * y[7] + y[2] * y[8]) * u3 / r2
    for k in range(3):
        out[k] = y[3 + k]
        out[3 + k] = -u3 * y[k] + push * y[6 + k]
        out[6 + k] = y[9 + k]
        out[9 + k] = -u3 * y[6 + k] + tide * y[k]


@compile_inline
def _fly_one(y, mass, duration, thrust, flow, n_steps, now, stages):
    """Carry y over one burn in place, canonical.  mass : at its start;  thrust, flow : per initial mass.

    now, stages : float64[12] and float64[_STAGES, 12], room for a state and its derivatives.

    Weights of order 8 of DOP853: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I (1993).
    """
    h = duration / n_steps
    for step in range(n_steps):
        for stage in range(_STAGES + 1):
            for i in range(y.size):
                now[i] = y[i]
            for k in range(_STARTS[stage], _STARTS[stage + 1]):
                for i in range(now.size):
                    now[i] += h * _WEIGHTS[k] * stages[_COLUMNS[k], i]
            if stage == _STAGES:
                for i in range(y.size):
                    y[i] = now[i]
            else:
                _rates(now, thrust / (mass - flow * (step * h + _NODES[stage] * h)), stages[stage])


def _fly_all(y, mass, duration, thrust, flow, n_steps, now, stages):
    for case in range(y.shape[0]):
        _fly_one(y[case], mass[case], duration[case], thrust, flow, n_steps, now, stages)


_KERNEL = kernel_of(_fly_all)


def fly_burns(
    y: np.ndarray, mass: np.ndarray, duration: np.ndarray, thrust: float, flow: float, step: float = STEP
) -> np.ndarray:
    """States at the end of burns that begin at the states y [n, 12].

    mass, duration : float64[n], of the initial mass and of the canonical time;  thrust, flow : canonical, per
    initial mass.  step : longest; a thrust that turns over, because its primer vector passes near zero, wants short
    ones.  A burn may last a negative time: it is then flown backward.
    """
    out = np.array(y, dtype=np.float64)
    mass, duration = (np.broadcast_to(column, len(out)).astype(np.float64) for column in (mass, duration))
    n_steps = max(8, int(np.ceil(np.abs(duration).max() / step)))
    room = np.empty(out.shape[1]), np.empty((_STAGES, out.shape[1]))
    _KERNEL(out, mass, duration, float(thrust), float(flow), n_steps, *room)
    return out
