"""Random numbers inside kernels: normal deviates from the uniform ones of `philox`."""

from mc_engine.lanes.elementary import log, sincos
from mc_engine.lanes.functions import sqrt
from mc_engine.lanes.philox import uniform_pair
from mc_engine.lanes.physics_function import physics


@physics
def normal_pair(draws, index):
    """Two independent standard normal deviates.

    Box and Muller, Annals of Mathematical Statistics 29 (1958) 610-611.
    """
    u, v = uniform_pair(draws, index)
    radius = sqrt(-2.0 * log(1.0 - u))
    s, c = sincos(6.283185307179586 * v)
    return radius * c, radius * s
