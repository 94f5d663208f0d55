"""Our values of the example of table 1, of the searches, of the optimum's totals and of the engine.

M. Alavipour, A. A. Nikkhah, J. Roshanian.  The records of `*.toml` name these functions; each returns its value in the
unit of the record.
"""

from functools import lru_cache

import numpy as np

from campaigns.geo_injection.design.kept_programs import SEQUENCES
from campaigns.geo_injection.design.program import program_for
from campaigns.geo_injection.design.single_burn import Burn, Rise, Stage, circle, fly_shortest, rise_guess
from campaigns.geo_injection.design.staged import staged
from campaigns.geo_injection.published.burns import USED_KG, printed_orbits
from mc_engine.physics.constants import MU_EARTH, STANDARD_GRAVITY

# The example of table 1: a satellite near the geostationary circle evades by a small rise in one burn.  The source
# gives "42178 km" without saying of which circle; what its analytic row determines is RISE.
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


def avoidance_analytic(column: str) -> float:
    """Row 1 of table 1, eq. (18), canonical.  column : of `Rise`"""
    return getattr(rise_guess(RISE), column)


def avoidance_converged(column: str) -> float:
    """Row 4 of table 1, the solution of the boundary-value problem, canonical, in the scale and sign of the table."""
    burn = avoidance()
    return getattr(Rise(burn.duration, *(burn.start[6:8] / -burn.start[9])), column)


def avoidance_iterations() -> int:
    """Steps of our search (Levenberg–Marquardt, to 1e-9) for row 4 of table 1."""
    return avoidance().iterations


@lru_cache
def _iterations() -> list[int]:
    """Steps of our search for each burn of the staged sequences over the printed orbits."""
    flown = [staged(SEQUENCES[name].problem(), printed_orbits(name)) for name in USED_KG]
    return [stage.burn.iterations for stages in flown for stage in stages]


def most_iterations() -> int:
    """Most steps a burn takes; text on the solution."""
    return max(_iterations())


def fewest_iterations() -> int:
    """Fewest steps a burn takes; text on the solution."""
    return min(_iterations())


def optimal_burns_s(sequence: str) -> float:
    """Sum [s] of the burns of the continuous optimal flight; to compare with the sums of tables 2 to 8."""
    return sum(burn.duration_s for burn in program_for(SEQUENCES[sequence]).burns)


def engine() -> str:
    """Thrust [kN] and specific impulse [s] that the campaign assumes."""
    stage = SEQUENCES["two_burns_28_5"]
    return f"{stage.thrust / 1e3:g} kN, {stage.thrust / (stage.mass_flow * STANDARD_GRAVITY):.2f} s"
