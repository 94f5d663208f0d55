"""The burns of tables 2 to 8 one by one, in the source's own conventions, between the orbits that it prints.

M. Alavipour, A. A. Nikkhah, J. Roshanian.  Each burn takes the least time from its old orbit to its new one.  The mass
at its ignition is what the printed propellant of the burns before it leaves.

- The first burn is ignited on the node of the parking orbit; size, shape and inclination of the new orbit and its node
  are given, its apse line is free.
- A second burn at perigee is centred in time on the perigee of the printed orbit, which is on the node; the apse line
  of the new orbit is free.
- The last burn, to the geostationary circle, begins where it lasts shortest about the apogee of the printed orbit,
  which is on the node.

So the printed burns do not make one continuous flight, and neither do these.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from campaigns.geo_injection.design.kept_programs import SEQUENCES
from campaigns.geo_injection.design.sequence import source_orbits
from campaigns.geo_injection.design.single_burn import Burn, Stage, circle, orbit
from campaigns.geo_injection.design.staged import Orbit, shortest

# propellant [kg] used by the end of each burn but the last: tables 2, 3, 4, 7 and 8
USED_KG = {
    "two_burns_28_5": [12_683.0],
    "two_burns_55": [12_772.0],
    "two_burns_planar": [12_480.0],
    "three_burns_28_5": [6022.4, 6022.4 + 6429.8],
    "three_burns_planar": [5554.6, 5554.6 + 6429.5],
}


def printed_orbits(sequence: str) -> tuple[Orbit, ...]:
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
def _burn(sequence: str, number: int) -> Burn:
    """The burn of least time, searched from an impulse at the apsis; canonical units."""
    problem, between = SEQUENCES[sequence].problem(), printed_orbits(sequence)
    before = (Orbit(1.0, 0.0, problem.plane_change), *between)[number - 1]
    mass = 1.0 - (0.0, *USED_KG[sequence])[number - 1] / SEQUENCES[sequence].mass
    if number > len(between):
        reached, placing, inclination = circle(problem.ratio), "free", 0.0
        start, wanted = before.apsis(-1.0), -np.sqrt(1.0 / problem.ratio)
    else:
        new, placing = between[number - 1], "fixed" if number == 1 else "centred"
        reached, inclination = orbit(new.a, new.e, new.inclination, apse_on_node=False), new.inclination
        start = before.apsis(1.0)
        wanted = np.sqrt(2.0 / np.linalg.norm(start[:3]) - 1.0 / new.a)  # vis-viva
    return shortest(Stage(start, mass, problem.thrust, problem.flow, reached, placing), wanted, inclination)
