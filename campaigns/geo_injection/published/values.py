"""Our values of the burns, of the example of table 1, of the searches, of the optimum's totals and of the engine.

M. Alavipour, A. A. Nikkhah, J. Roshanian.  The records of `*.toml` name these functions; each returns its value in the
unit of the record.

The burns of tables 2 to 8 take the least time each, in the source's own conventions, between the orbits that it prints.
The mass at ignition is what the printed propellant of the burns before leaves.

- The first burn is ignited on the node of the parking orbit; size, shape, inclination and node of the new orbit are
  given, its apse line is free.
- A second burn at perigee is centred in time on the perigee of the printed orbit, which is on the node; the apse line
  of the new orbit is free.
- The last burn begins where it lasts shortest about the apogee of the printed orbit, which is on the node.

So the printed burns do not make one continuous flight, and neither do these.
"""

from dataclasses import replace
from functools import lru_cache, partial

import numpy as np

from campaigns.geo_injection.design import staged
from campaigns.geo_injection.design.kept_programs import SEQUENCES
from campaigns.geo_injection.design.program import program_for, source_orbits
from mc_engine.physics.constants import MU_EARTH, STANDARD_GRAVITY

# propellant [kg] used by the end of each burn but the last: tables 2, 3, 4, 7 and 8
USED_KG = {
    "two_burns_28_5": [12_683.0],
    "two_burns_55": [12_772.0],
    "two_burns_planar": [12_480.0],
    "three_burns_28_5": [6022.4, 6022.4 + 6429.8],
    "three_burns_planar": [5554.6, 5554.6 + 6429.5],
}

# The example of table 1: a satellite near the geostationary circle evades by a small rise in one burn.  The source
# gives "42178 km" without saying of which circle; what its analytic row determines is RISE.
RADIUS, MASS, THRUST, MASS_FLOW = 42_164_137.0, 2400.0, 1.3, 0.00069  # m, kg, N, kg/s
RISE = 0.138454  # canonical rise over the acceleration
_STEP = 0.002  # canonical: the thrust turns over in the middle of the burn, within a hundredth of the time
_ACCELERATION = THRUST / MASS / (MU_EARTH / RADIUS**2)  # over the first weight, the f of eq. (18)
_FLOW = MASS_FLOW / MASS * float(np.sqrt(RADIUS**3 / MU_EARTH))


def printed_orbits(sequence: str) -> tuple[staged.Orbit, ...]:
    """The orbits between the burns of a sequence of USED_KG, in canonical units."""
    flown = SEQUENCES[sequence]
    return replace(flown, between=source_orbits(flown.burns, flown.initial_inclination)).orbits_between()


def burn_s(sequence: str, number: int | None = None) -> float:
    """Least time [s] of a burn of a sequence, counted from 1, or of all its burns."""
    numbers = range(1, SEQUENCES[sequence].burns + 1) if number is None else [number]
    return SEQUENCES[sequence].time_unit * sum(_burn(sequence, burn).duration for burn in numbers)


def burn_propellant_kg(sequence: str, number: int | None = None) -> float:
    """Propellant [kg] of that burn, or of all."""
    return SEQUENCES[sequence].mass_flow * burn_s(sequence, number)


def burn_share_pct(larger: str, smaller: str, number: int | None = None) -> float:
    """By how much [%] a burn, or all of them, is shorter in another sequence; tables 4 to 6 and 8."""
    return 100.0 * (1.0 - burn_s(smaller, number) / burn_s(larger, number))


@lru_cache
def _burn(sequence: str, number: int) -> staged.Burn:
    """The burn of least time, searched from an impulse at the apsis; canonical units."""
    problem, between = SEQUENCES[sequence].problem(), printed_orbits(sequence)
    before = (staged.Orbit(1.0, 0.0, problem.plane_change), *between)[number - 1]
    mass = 1.0 - (0.0, *USED_KG[sequence])[number - 1] / SEQUENCES[sequence].mass
    if number > len(between):
        reached, placing, inclination = partial(staged.circle_reached, problem.ratio), "free", 0.0
        start, wanted = before.apsis(np.pi), -np.sqrt(1.0 / problem.ratio)
    else:
        new, placing = between[number - 1], "fixed" if number == 1 else "centred"
        reached, inclination = partial(new.reached, apse_on_node=False), new.inclination
        start = before.apsis(0.0)
        wanted = np.sqrt(2.0 / np.linalg.norm(start[:3]) - 1.0 / new.a)  # vis-viva
    stage = staged.Stage(start, mass, problem.thrust, problem.flow, reached, placing)
    return staged.shortest(stage, wanted, inclination)


@lru_cache
def avoidance() -> staged.Burn:
    """The burn of least time, searched from eq. (18); canonical, the radial place costate being 1."""
    start = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 0.0])
    reached = partial(staged.circle_reached, 1.0 + RISE * _ACCELERATION)
    stage = staged.Stage(start, 1.0, _ACCELERATION, _FLOW, reached, placing="fixed", step=_STEP)
    time, radial, transverse = staged.rise_guess(RISE)
    return staged.fly_shortest(stage, np.array([radial, transverse, 0.0]), np.array([-1.0, -radial, 0.0]), time, 0.0)


def avoidance_analytic(column: str) -> float:
    """Row 1 of table 1, eq. (18), canonical.  column : of `staged.Rise`"""
    return getattr(staged.rise_guess(RISE), column)


def avoidance_converged(column: str) -> float:
    """Row 4 of table 1, the solution of the boundary-value problem, canonical, in the scale and sign of the table."""
    burn = avoidance()
    return getattr(staged.Rise(burn.duration, *(burn.start[6:8] / -burn.start[9])), column)


def avoidance_iterations() -> int:
    """Steps of our search (Levenberg–Marquardt) for row 4 of table 1."""
    return avoidance().iterations


def iterations(which: str) -> int:
    """Steps of our search for a burn of the staged sequences over the printed orbits: the "least" or the "most"."""
    sequences = [staged.staged(SEQUENCES[name].problem(), printed_orbits(name)) for name in USED_KG]
    return {"least": min, "most": max}[which](burn.iterations for burns in sequences for burn in burns)


def optimal_burns_s(sequence: str) -> float:
    """Sum [s] of the burns of the continuous optimal flight; to compare with the sums of tables 2 to 8."""
    return sum(burn.duration_s for burn in program_for(SEQUENCES[sequence]).burns)


def engine() -> str:
    """Thrust [kN] and specific impulse [s] that the campaign assumes."""
    stage = SEQUENCES["two_burns_28_5"]
    return f"{stage.thrust / 1e3:g} kN, {stage.thrust / (stage.mass_flow * STANDARD_GRAVITY):.2f} s"
