"""Powered arcs with their primer vector: fixed steps of order 8, compiled.  Canonical units.

State y of twelve: place, velocity, primer vector p (the thrust's direction, minus the costate of the velocity) and its
rate q (the costate of the place).  The steps are fixed, so an arc is a smooth function of its start and its duration:
finite differences over it are as good as their rounding.
"""

import numpy as np

from mc_engine.lanes import physics, sqrt
from mc_engine.lanes.runge_kutta_pairs import DOP853
from mc_engine.model import compiled_loop

_NODES, _STARTS, _COLUMNS, _WEIGHTS = DOP853.tables()
_STAGES = len(DOP853.nodes) + 1
STEP = 0.1  # canonical time: a sixtieth of the parking orbit's revolution
Numbers = float | np.ndarray


@physics
def _rates(y, acceleration, out):
    """Time derivative of y under a thrust acceleration along p: eqs (1) and (16) of the source, in vectors.

    r'' = -r/r^3 + f p/|p|,  p' = q,  q' = -p/r^3 + 3 (r.p) r/r^5.
    """
    r2 = y[0] * y[0] + y[1] * y[1] + y[2] * y[2]
    u3 = 1.0 / (r2 * sqrt(r2))
    push = acceleration / sqrt(y[6] * y[6] + y[7] * y[7] + y[8] * y[8])
    tide = 3.0 * (y[0] * y[6] + y[1] * y[7] + y[2] * y[8]) * u3 / r2
    for k in range(3):
        out[k] = y[3 + k]
        out[3 + k] = -u3 * y[k] + push * y[6 + k]
        out[6 + k] = y[9 + k]
        out[9 + k] = -u3 * y[6 + k] + tide * y[k]


@physics
def _fly_one(y, mass, duration, thrust, flow, n_steps, now, stages):
    """Carry y over one burn in place: DOP853's weights of order 8, Hairer, Norsett, Wanner, Solving ODEs I (1993).

    now, stages : float64[12] and float64[_STAGES, 12], room for a state and its derivatives
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


@compiled_loop
def _fly_all(y, mass, duration, thrust, flow, n_steps, now, stages):
    for case in range(y.shape[0]):
        _fly_one(y[case], mass[case], duration[case], thrust, flow, n_steps, now, stages)


def fly_burns(
    y: np.ndarray, mass: Numbers, duration: Numbers, thrust: float, flow: float, step: float = STEP
) -> np.ndarray:
    """States float64[n, 12], canonical units, at the end of burns from the states y, of that shape or [12] for all.

    mass, duration : float64[n], of the initial mass and of the canonical time, or a number for all; a negative
        duration is flown backward
    thrust, flow : per initial mass
    step : longest; a thrust that turns over, because its primer vector passes near zero, needs short ones
    """
    n = np.broadcast_shapes(np.shape(y)[:-1], np.shape(mass), np.shape(duration))
    out = np.array(np.broadcast_to(y, (*n, 12)), dtype=np.float64, order="C")
    mass, duration = (np.array(np.broadcast_to(column, n), dtype=np.float64) for column in (mass, duration))
    n_steps = max(8, int(np.ceil(np.abs(duration).max() / step)))
    room = np.empty(12), np.empty((_STAGES, 12))
    _fly_all(out, mass, duration, float(thrust), float(flow), n_steps, *room)
    return out
