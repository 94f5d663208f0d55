"""The model's flights, the sequences of the source, and short ways to their designs."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from campaigns.geo_injection.design.continuation import optimum, propellant_share, two_impulses
from campaigns.geo_injection.design.kept_programs import SEQUENCES
from campaigns.geo_injection.design.staged import Orbit, staged
from tests.campaigns.model_flights import ModelFlights

FLIGHTS = ModelFlights("campaigns.geo_injection")
MODEL, NOMINAL = FLIGHTS.model, FLIGHTS.nominal
fly_cases, fly_one, history = FLIGHTS.cases, FLIGHTS.one, FLIGHTS.history  # by column name, in declared units
GEO, PARKING = 42_164_137.0, 6_578_137.0
THRUST, FLOW, MASS = 20_000.0, 6.14, 22_170.0
MU = 3.986004418e14
# one standard deviation of each error in campaign.toml
SIGMAS = {
    "thrust_factor": 0.005, "isp_factor": 0.003, "initial_mass_factor": 0.002, "ignition_delay_1_s": 1.0,
    "ignition_delay_2_s": 1.0, "pitch_error_deg": 0.2, "yaw_error_deg": 0.2,
}  # fmt: skip

ELLIPTIC = {"initial_inclination_deg": 46.0, "parking_eccentricity": 0.2, "parking_argument_of_perigee_deg": 20.0}

# burns, inclination [deg], and the orbits that the source prints in tables 2, 3, 7 and 8: a [km], e, i [deg]
SOURCE = {
    "planar, 2 burns": (2, 0.0, [(24_588, 0.7142, 0.0)]),
    "28.5 deg, 2 burns": (2, 28.5, [(24_588, 0.7142, 26.0)]),
    "55 deg, 2 burns": (2, 55.0, [(24_588, 0.7142, 52.0)]),
    "planar, 3 burns": (3, 0.0, [(8733.1, 0.2456, 0.0), (24_438, 0.7247, 0.0)]),
    "28.5 deg, 3 burns": (3, 28.5, [(8733.1, 0.2456, 27.0), (24_438, 0.7247, 25.0)]),
}


def dispersed(n, seed=2017):
    """Inputs of n cases of the spreads of campaign.toml."""
    random = np.random.default_rng(seed)
    return {name: NOMINAL[name] + sigma * random.standard_normal(n) for name, sigma in SIGMAS.items()}


def sequence(burns, inclination_deg, thrust=THRUST, **parking):
    """A sequence of the source's engine, whose exhaust speed any thrust keeps."""
    engine = {"thrust": thrust, "mass_flow": FLOW * thrust / THRUST}
    inclination = float(np.radians(inclination_deg))
    return replace(SEQUENCES["two_burns_28_5"], burns=burns, initial_inclination=inclination, **engine, **parking)


def staged_over(name):
    """(sequence, burns of the staged procedure over the orbits that the source prints for it)."""
    burns, inclination, between = SOURCE[name]
    item = sequence(burns, inclination)
    return item, staged(item.problem(), tuple(Orbit(1e3 * a / PARKING, e, np.radians(i)) for a, e, i in between))


@lru_cache(maxsize=64)
def solution(burns, inclination_deg, thrust=THRUST):
    """The optimum of a sequence, canonical."""
    return optimum(sequence(burns, inclination_deg, thrust).problem())


def used_kg(found):
    """Propellant of an optimum."""
    return MASS * found.problem.flow * found.durations.sum()


def impulses_kg(problem, speed=None):
    """Propellant of impulses: of a total speed change, or of two at the apses."""
    two = two_impulses(problem.plane_change, problem.ratio)
    return MASS * propellant_share(two.first + two.second if speed is None else speed, problem.exhaust)


def elements(state):
    """(a [km], e, inclination [deg]) of a canonical state."""
    r, v = state[:3], state[3:6]
    h = np.cross(r, v)
    e = np.cross(v, h) - r / np.linalg.norm(r)
    a = 1.0 / (2.0 / np.linalg.norm(r) - v @ v)
    return a * PARKING / 1e3, np.linalg.norm(e), np.degrees(np.arctan2(np.hypot(h[0], h[1]), h[2]))
