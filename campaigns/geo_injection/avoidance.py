"""The source's example of table 1: a satellite near the geostationary circle evades by a small rise in one burn."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from campaigns.geo_injection.design.single_burn import Burn, Stage, circle, fly_shortest, rise_guess
from mc_engine.physics.constants import MU_EARTH

# The thrust turns over in the middle of the burn, within a hundredth of the canonical time.
_STEP = 0.002


@dataclass(frozen=True)
class Rise:
    """radius [m] of the first circle, mass [kg], thrust [N], mass flow [kg/s], canonical rise over acceleration.

    The source gives "42178 km" without saying of which circle; what its analytic row determines is the last number.
    """

    radius: float
    mass: float
    thrust: float
    mass_flow: float
    rise: float

    @property
    def acceleration(self) -> float:
        """Thrust over the first weight, the f of eq. (18)."""
        return self.thrust / self.mass / (MU_EARTH / self.radius**2)

    @property
    def flow(self) -> float:
        """Mass flow over mass, per canonical time."""
        return self.mass_flow / self.mass * float(np.sqrt(self.radius**3 / MU_EARTH))


AVOIDANCE = Rise(42_164_137.0, 2400.0, 1.3, 0.00069, 0.138454)


def analytic_guess(rise: Rise) -> tuple[float, float, float]:
    """(burn time, radial and transverse velocity costates): eq. (18), canonical, the radial place costate being 1."""
    return rise_guess(rise.rise)


@lru_cache(maxsize=8)
def burn_of(rise: Rise) -> Burn:
    """The burn of least time, searched from eq. (18)."""
    time, radial, transverse = analytic_guess(rise)
    start = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 0.0])
    target = circle(1.0 + rise.rise * rise.acceleration)
    stage = Stage(start, 1.0, rise.acceleration, rise.flow, target, "fixed", _STEP)
    return fly_shortest(stage, np.array([radial, transverse, 0.0]), np.array([-1.0, -radial, 0.0]), time, 0.0)


def converged(rise: Rise) -> tuple[float, float, float]:
    """(burn time, radial and transverse velocity costates) of the solution, in the scale and sign of table 1."""
    burn = burn_of(rise)
    scale = -burn.start[9]
    return burn.duration, float(burn.start[6] / scale), float(burn.start[7] / scale)
