"""The source's example of table 1: a satellite near the geostationary circle evades by a small rise in one burn.

The source gives "42178 km" without saying of which circle; what its analytic row determines is `RISE`.
"""

from functools import lru_cache

import numpy as np

from campaigns.geo_injection.design.single_burn import Burn, Stage, circle, fly_shortest, rise_guess
from mc_engine.physics.constants import MU_EARTH

RADIUS, MASS, THRUST, MASS_FLOW = 42_164_137.0, 2400.0, 1.3, 0.00069  # m, kg, N, kg/s
RISE = 0.138454  # canonical rise over the acceleration
_STEP = 0.002  # canonical: the thrust turns over in the middle of the burn, within a hundredth of the time
_ACCELERATION = THRUST / MASS / (MU_EARTH / RADIUS**2)  # over the first weight, the f of eq. (18)
_FLOW = MASS_FLOW / MASS * float(np.sqrt(RADIUS**3 / MU_EARTH))


@lru_cache
def avoidance() -> Burn:
    """The burn of least time, searched from eq. (18); canonical, the radial place costate being 1."""
    start, reached = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 0.0]), circle(1.0 + RISE * _ACCELERATION)
    stage = Stage(start, 1.0, _ACCELERATION, _FLOW, reached, placing="fixed", step=_STEP)
    time, radial, transverse = rise_guess(RISE)
    return fly_shortest(stage, np.array([radial, transverse, 0.0]), np.array([-1.0, -radial, 0.0]), time, 0.0)
