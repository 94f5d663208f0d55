"""The sequences of the source, and short ways to their designs."""

from functools import lru_cache

import numpy as np

from campaigns.geo_injection.design.continuation import optimum
from campaigns.geo_injection.design.sequence import Sequence

GEO, PARKING = 42_164_137.0, 6_578_137.0
THRUST, FLOW, MASS = 20_000.0, 6.14, 22_170.0
MU = 3.986004418e14


def sequence(burns, inclination_deg, *, thrust=THRUST, final_deg=0.0, method="optimal", between=()):
    """A sequence of the source's engine, whose exhaust speed any thrust keeps."""
    return Sequence(
        method=method, burns=burns, initial_inclination=float(np.radians(inclination_deg)),
        final_inclination=float(np.radians(final_deg)), parking_radius=PARKING, final_radius=GEO, thrust=thrust,
        mass_flow=FLOW * thrust / THRUST, mass=MASS, between=between,
    )  # fmt: skip


@lru_cache(maxsize=64)
def solution(burns, inclination_deg, thrust=THRUST):
    """The optimum of a sequence, canonical."""
    return optimum(sequence(burns, inclination_deg, thrust=thrust).problem())


def propellant_kg(burns, inclination_deg, thrust=THRUST):
    found = solution(burns, inclination_deg, thrust)
    return MASS * found.problem.flow * found.durations.sum()


def seconds(burns, inclination_deg, thrust=THRUST):
    """(durations of the burns, ignition times) [s]."""
    unit = sequence(burns, inclination_deg).time_unit
    found = solution(burns, inclination_deg, thrust)
    return unit * found.durations, unit * found.ignitions


def elements(state):
    """(a [km], e, inclination [deg]) of a canonical state."""
    r, v = state[:3], state[3:6]
    h = np.cross(r, v)
    e = np.cross(v, h) - r / np.linalg.norm(r)
    a = 1.0 / (2.0 / np.linalg.norm(r) - v @ v)
    return a * PARKING / 1e3, np.linalg.norm(e), np.degrees(np.arctan2(np.hypot(h[0], h[1]), h[2]))
