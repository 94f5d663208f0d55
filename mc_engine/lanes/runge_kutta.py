"""Steps of the classical Runge-Kutta method of fourth order on named tuples of lanes.

W. Kutta, Zeitschrift für Mathematik und Physik 46 (1901) 435-453.
"""

from mc_engine.lanes.compiler import compile_callable, compile_inline
from mc_engine.lanes.functions import fma
from mc_engine.lanes.physics_function import physics
from mc_engine.lanes.tuples import add_scaled, map_fields, spread


@physics
def _advance(y, sixth, k1, k2, k3, k4):
    return fma(sixth, fma(2.0, k2 + k3, k1 + k4), y)


def _rk4(rhs, t, h, s, m, p, o):
    """State after one step of length h [s] (a number or lanes) from state s at time t."""
    half = 0.5 * h
    k1 = spread(rhs(t, s, m, p, o), t)
    k2 = spread(rhs(t + half, add_scaled(s, half, k1), m, p, o), t)
    k3 = spread(rhs(t + half, add_scaled(s, half, k2), m, p, o), t)
    k4 = spread(rhs(t + h, add_scaled(s, h, k3), m, p, o), t)
    return map_fields(_advance, s, h * (1.0 / 6.0), k1, k2, k3, k4)


rk4 = compile_inline(_rk4)
# for places off the main path: one copy in the kernel, called where needed
rk4_shared = compile_callable(_rk4)
