"""The source's procedure: burn by burn between given orbits, each of least time and centred on an apsis of the old one.

The burns make one continuous flight, which the source's do not (its first burns begin on the node and its last ones
are computed as if their apogee were there): the first burn leaves its perigee on the node, and begins where it lasts
shortest if the parking orbit is a circle, which has no apsis.  The others are centred in time on the apsis that they
reach and leave the perigee on the node again.  Canonical units, axes as in `optimal.py`.
"""

from collections import namedtuple
from dataclasses import dataclass

import numpy as np

from campaigns.geo_injection.design.coast import coast
from campaigns.geo_injection.design.optimal import Problem, parking_orbit
from campaigns.geo_injection.design.single_burn import Burn, Stage, circle, fly_shortest, orbit, rise_guess
from mc_engine.errors import ModelError
from mc_engine.physics.orbital_elements import state_of_elements


@dataclass(frozen=True)
class Orbit:
    """An orbit between two burns: semi-major axis, eccentricity, inclination [rad] against the final orbit."""

    a: float
    e: float
    inclination: float

    def apsis(self, anomaly: float) -> np.ndarray:
        """Place and velocity [6] at perigee (0, on the ascending node) or apogee (pi, on the descending one)."""
        return state_of_elements(self.a, self.e, self.inclination, 0.0, 0.0, anomaly, 1.0)


# ignition: time after the first;  burn: as `single_burn` found it
StagedBurn = namedtuple("StagedBurn", "ignition burn")


def staged(problem: Problem, between: tuple[Orbit, ...]) -> list[StagedBurn]:
    """The burns over the given orbits, canonical units; ModelError where one is not found, without saying which.

    A last burn that is not found from an impulse at the apsis is guessed by eq. (23).
    """
    circle_first = problem.eccentricity == 0.0
    if not circle_first and abs(np.sin(0.5 * problem.perigee)) > 1e-9:
        raise ModelError(
            "the staged procedure has all perigees on the ascending node: an elliptic parking orbit needs "
            'parking_argument_of_perigee_deg = 0, or method = "optimal"'
        )
    burns: list[StagedBurn] = []
    mass, reference, lead = 1.0, parking_orbit(problem, np.zeros(1))[0], 0.0
    for k, new in enumerate(between):
        placing = "free" if k == 0 and circle_first else "centred"
        reached = orbit(new.a, new.e, new.inclination)
        stage = Stage(reference, mass, problem.thrust, problem.flow, reached, placing)
        burn = shortest(stage, float(np.linalg.norm(new.apsis(0.0)[3:])), new.inclination)
        ignition = lead + burn.ignition if burns else 0.0
        burns.append(StagedBurn(ignition, burn))
        mass -= problem.flow * burn.duration
        wait, reference = _next_apsis(burn.end, apogee=k == len(between) - 1)
        lead = ignition + burn.duration + wait
    stage = Stage(reference, mass, problem.thrust, problem.flow, circle(problem.ratio))
    try:
        last = shortest(stage, -np.sqrt(1.0 / problem.ratio), 0.0)
    except ModelError:
        if np.linalg.norm(reference[:3]) >= problem.ratio:  # no rise: eq. (23) has no real root
            raise
        last = rising(stage, problem.ratio)
    return [*burns, StagedBurn(lead + last.ignition, last)]


def shortest(stage: Stage, wanted: float, inclination: float) -> Burn:
    """The burn, guessed as an impulse at the reference that gives the wanted speed, canonical, at an inclination [rad].

    The rocket equation, (1) of the source integrated, times it.  The impulse is centred in the burn, unless the burn is
    to be ignited at the reference.
    """
    r, v = stage.reference[:3], stage.reference[3:]
    change = wanted * np.array([0.0, np.cos(inclination), np.sin(inclination)]) - v
    size = float(np.linalg.norm(change))
    duration = stage.mass * -np.expm1(-size * stage.flow / stage.thrust) / stage.flow
    primer = change / size
    rate = np.cross(np.cross(r, v) / (r @ r), primer)  # the thrust turns with the local horizon
    ignition = 0.0 if stage.placing == "fixed" else -0.5 * duration
    return fly_shortest(stage, primer - 0.5 * duration * rate, rate, duration, ignition)


def rising(stage: Stage, radius: float) -> Burn:
    """The burn to a radius, guessed by eq. (23) in the radial and transverse directions of the apsis."""
    r, v = stage.reference[:3], stage.reference[3:]
    r0 = float(np.linalg.norm(r))
    up, along = r / r0, v / np.linalg.norm(v)
    duration, radial, transverse = rise_guess((radius - r0) * stage.mass / stage.thrust)
    return fly_shortest(stage, radial * up + transverse * along, -up - radial * along, duration, -0.5 * duration)


def _next_apsis(state: np.ndarray, apogee: bool) -> tuple[float, np.ndarray]:
    """(time to the next apogee or perigee, place and velocity there), as eqs (24)-(26) of the source."""
    r, v = state[:3], state[3:6]
    r1 = np.sqrt(r @ r)
    a = 1.0 / (2.0 / r1 - v @ v)
    e_sine = r @ v / np.sqrt(a)
    mean = np.arctan2(e_sine, 1.0 - r1 / a) - e_sine
    wait = float(((np.pi if apogee else 2.0 * np.pi) - mean) % (2.0 * np.pi) * a**1.5)
    return wait, coast(state, np.array([wait]))[0, :6]
