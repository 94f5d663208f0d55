"""The source's procedure: burn by burn between given orbits, each of least time and centred on an apsis of the old one.

The burns make one continuous flight, which the source's do not (its first burns begin on the node and its last ones
are computed as if their apogee were there): the first burn leaves its perigee on the node, and may begin where it lasts
shortest, since a circle has no apsis.  The next ones are centred in time on the apsis that they reach and leave the
perigee on the node again.  Canonical units, axes as in `optimal.py`.
"""

from dataclasses import dataclass

import numpy as np

from campaigns.geo_injection.coast import coast
from campaigns.geo_injection.optimal import Problem
from campaigns.geo_injection.single_burn import Burn, Stage, circle, fly_shortest, orbit


@dataclass(frozen=True)
class Orbit:
    """An orbit between two burns: canonical semi-major axis, eccentricity, inclination against the final orbit."""

    a: float
    e: float
    inclination: float


@dataclass(frozen=True)
class StagedBurn:
    """A burn of the flight.  ignition : canonical time after the first;  burn : as `single_burn` found it."""

    ignition: float
    burn: Burn


def staged(problem: Problem, between: tuple[Orbit, ...]) -> list[StagedBurn]:
    """The burns over the given intermediate orbits, one fewer than burns; ModelError names the burn that fails."""
    found: list[StagedBurn] = []
    mass, reference, lead = 1.0, _node(problem.plane_change), 0.0
    for k in range(problem.burns):
        last = k == problem.burns - 1
        reached = circle(problem.ratio) if last else orbit(between[k].a, between[k].e, between[k].inclination)
        stage = Stage(reference, mass, problem.thrust, problem.flow, reached, "free" if k == 0 else "centred")
        wanted = -np.sqrt(1.0 / problem.ratio) if last else _perigee_speed(between[k])
        burn = _shortest(stage, wanted, 0.0 if last else between[k].inclination)
        ignition = 0.0 if k == 0 else lead + burn.ignition
        found.append(StagedBurn(ignition, burn))
        mass -= problem.flow * burn.duration
        if not last:
            at_apogee = k == problem.burns - 2
            wait, reference = _next_apsis(burn.end[:6], at_apogee)
            lead = ignition + burn.duration + wait
    return found


def _node(plane_change: float) -> np.ndarray:
    """Place and velocity on the parking orbit at its ascending node."""
    return np.array([1.0, 0.0, 0.0, 0.0, np.cos(plane_change), np.sin(plane_change)])


def _perigee_speed(one: Orbit) -> float:
    return float(np.sqrt((1.0 + one.e) / ((1.0 - one.e) * one.a)))


def _shortest(stage: Stage, wanted: float, inclination: float) -> Burn:
    """The burn, guessed as an impulse at the apsis that gives the wanted speed; the rocket equation times it."""
    r, v = stage.reference[:3], stage.reference[3:]
    change = wanted * np.array([0.0, np.cos(inclination), np.sin(inclination)]) - v
    size = float(np.linalg.norm(change))
    duration = stage.mass * -np.expm1(-size * stage.flow / stage.thrust) / stage.flow
    primer = change / size
    rate = np.cross(np.cross(r, v) / (r @ r), primer)  # the thrust turns with the local horizon
    return fly_shortest(stage, primer - 0.5 * duration * rate, rate, duration, -0.5 * duration)


def _next_apsis(state: np.ndarray, apogee: bool) -> tuple[float, np.ndarray]:
    """(time to the next apogee or perigee, place and velocity there), as eqs (24)-(26) of the source."""
    r, v = state[:3], state[3:]
    r1 = np.sqrt(r @ r)
    a = 1.0 / (2.0 / r1 - v @ v)
    anomaly = np.arctan2(r @ v / np.sqrt(a), 1.0 - r1 / a)
    e_sin = r @ v / np.sqrt(a)
    mean = anomaly - e_sin
    wait = float(((np.pi if apogee else 2.0 * np.pi) - mean) % (2.0 * np.pi) * a**1.5)
    return wait, coast(np.append(state, np.ones(6))[None], np.array([wait]))[0, :6]
