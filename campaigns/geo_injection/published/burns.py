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

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from campaigns.geo_injection.design.kept_programs import SEQUENCES
from campaigns.geo_injection.design.single_burn import Burn, Conditions, Stage, circle, fly_shortest


@dataclass(frozen=True)
class PrintedOrbit:
    """An orbit between two burns: semi-major axis [km], eccentricity, inclination [deg], and propellant so far [kg]."""

    a_km: float
    e: float
    inclination_deg: float
    propellant_kg: float


# tables 2, 3, 4, 7 and 8
ORBITS = {
    "two_burns_28_5": [PrintedOrbit(24_588.0, 0.7142, 26.0, 12_683.0)],
    "two_burns_55": [PrintedOrbit(24_588.0, 0.7142, 52.0, 12_772.0)],
    "two_burns_planar": [PrintedOrbit(24_588.0, 0.7142, 0.0, 12_480.0)],
    "three_burns_28_5": [
        PrintedOrbit(8_733.1, 0.2456, 27.0, 6022.4),
        PrintedOrbit(24_438.0, 0.7247, 25.0, 6022.4 + 6429.8),
    ],
    "three_burns_planar": [
        PrintedOrbit(8_733.1, 0.2456, 0.0, 5554.6),
        PrintedOrbit(24_438.0, 0.7247, 0.0, 5554.6 + 6429.5),
    ],
}


def burn_s(sequence: str, number: int) -> float:
    """Least time [s] of a burn, counted from 1, of a sequence of ORBITS."""
    return SEQUENCES[sequence].time_unit * _burn(sequence, number).duration


def burn_propellant_kg(sequence: str, number: int) -> float:
    """Propellant [kg] of that burn."""
    return SEQUENCES[sequence].mass_flow * burn_s(sequence, number)


def all_burns_s(sequence: str) -> float:
    """Sum [s] of the burns of a sequence."""
    return sum(burn_s(sequence, number) for number in range(1, len(ORBITS[sequence]) + 2))


def all_burns_propellant_kg(sequence: str) -> float:
    """Propellant [kg] of all burns of a sequence."""
    return SEQUENCES[sequence].mass_flow * all_burns_s(sequence)


def burn_share_pct(larger: str, smaller: str, number: int) -> float:
    """By how much [%] a burn is shorter in another sequence; tables 4 to 6 and 8."""
    return _share_pct(burn_s(larger, number), burn_s(smaller, number))


def all_burns_share_pct(larger: str, smaller: str) -> float:
    """By how much [%] all burns are shorter in another sequence; tables 4 to 6 and 8."""
    return _share_pct(all_burns_s(larger), all_burns_s(smaller))


def _share_pct(larger: float, smaller: float) -> float:
    return 100.0 * (larger - smaller) / larger


@lru_cache
def _burn(sequence: str, number: int) -> Burn:
    """The burn of least time, searched from an impulse at the apsis; canonical units."""
    orbits = ORBITS[sequence]
    if number == 1:
        return _to_orbit(sequence, _node(SEQUENCES[sequence].initial_inclination), 0.0, orbits[0], "fixed")
    before = orbits[number - 2]
    if number <= len(orbits):
        return _to_orbit(sequence, _perigee(sequence, before), before.propellant_kg, orbits[number - 1], "centred")
    return _to_final_circle(sequence, before)


def _to_orbit(sequence: str, start: np.ndarray, used_kg: float, reached: PrintedOrbit, placing: str) -> Burn:
    a, inclination = 1e3 * reached.a_km / SEQUENCES[sequence].parking_radius, np.radians(reached.inclination_deg)
    stage = _stage(sequence, start, used_kg, free_apse_orbit(a, reached.e, inclination), placing)
    wanted = np.sqrt(2.0 / np.linalg.norm(start[:3]) - 1.0 / a)  # vis-viva
    change = wanted * np.array([0.0, np.cos(inclination), np.sin(inclination)]) - start[3:]
    size = float(np.linalg.norm(change))
    duration = stage.mass * -np.expm1(-size * stage.flow / stage.thrust) / stage.flow
    # the thrust turns with the local horizon, and is along the impulse in the middle of the burn
    horizon_rate = np.cross(start[:3], start[3:]) / (start[:3] @ start[:3])
    primer = change / size
    rate = np.cross(horizon_rate, primer)
    ignition = 0.0 if placing == "fixed" else -0.5 * duration
    return fly_shortest(stage, primer - 0.5 * duration * rate, rate, duration, ignition)


def _to_final_circle(sequence: str, before: PrintedOrbit) -> Burn:
    problem, unit = SEQUENCES[sequence].problem(), SEQUENCES[sequence].time_unit
    start = _apogee(sequence, before)
    stage = _stage(sequence, start, before.propellant_kg, circle(problem.ratio), "free")
    change = np.array([0.0, -np.sqrt(1.0 / problem.ratio), 0.0]) - start[3:]
    return fly_shortest(stage, change, np.zeros(3), 600.0 / unit, -300.0 / unit)


def _stage(sequence: str, start: np.ndarray, used_kg: float, reached: Conditions, placing: str) -> Stage:
    problem = SEQUENCES[sequence].problem()
    mass = 1.0 - used_kg / SEQUENCES[sequence].mass
    return Stage(start, mass, problem.thrust, problem.flow, reached, placing)


def free_apse_orbit(a: float, e: float, inclination: float) -> Conditions:
    """An ellipse of given size, shape and inclination with its node on the x axis and any apse line: h, and energy."""
    h_wanted = np.sqrt(a * (1.0 - e * e))

    def reached(r: np.ndarray, v: np.ndarray) -> np.ndarray:
        h = np.cross(r, v)
        energy = (v * v).sum(-1) - 2.0 / np.sqrt((r * r).sum(-1)) + 1.0 / a
        tilted = [h[..., 1] + h_wanted * np.sin(inclination), h[..., 2] - h_wanted * np.cos(inclination)]
        return np.stack([h[..., 0], *tilted, energy], axis=-1)

    return reached


def _node(inclination: float) -> np.ndarray:
    """Place and velocity on the node of the parking orbit."""
    return np.array([1.0, 0.0, 0.0, 0.0, np.cos(inclination), np.sin(inclination)])


def _perigee(sequence: str, orbit: PrintedOrbit) -> np.ndarray:
    """Place and velocity at the perigee of a printed orbit, on the ascending node."""
    a = 1e3 * orbit.a_km / SEQUENCES[sequence].parking_radius
    speed = np.sqrt((1.0 + orbit.e) / ((1.0 - orbit.e) * a))
    i = np.radians(orbit.inclination_deg)
    return np.array([a * (1.0 - orbit.e), 0.0, 0.0, 0.0, speed * np.cos(i), speed * np.sin(i)])


def _apogee(sequence: str, orbit: PrintedOrbit) -> np.ndarray:
    """Place and velocity at the apogee of a printed orbit, on the descending node."""
    a = 1e3 * orbit.a_km / SEQUENCES[sequence].parking_radius
    speed = np.sqrt((1.0 - orbit.e) / ((1.0 + orbit.e) * a))
    i = np.radians(orbit.inclination_deg)
    return np.array([-a * (1.0 + orbit.e), 0.0, 0.0, 0.0, -speed * np.cos(i), -speed * np.sin(i)])
