"""The limit of unlimited thrust: two impulses at the apses on the node, and their primer vector.  Canonical units.

It bounds the propellant of every sequence from below, and is the analytic guess that the search for the optimum starts
from.  Axes: x to the ascending node of the parking orbit, z normal to the final orbit.
"""

from collections import namedtuple

import numpy as np
import scipy  # loads its packages when they are used

from campaigns.geo_injection.design.coast import coast

# speed changes; inclination of the transfer orbit against the final one; semi-major axis; primer vector at the first
# impulse and its rate
Impulsive = namedtuple("Impulsive", "first second inclination a primer rate")


def two_impulses(plane_change: float, ratio: float) -> Impulsive:
    """Least speed from the circle of radius 1 to that of radius `ratio`, over a split of the plane change [rad]."""
    a = 0.5 * (1.0 + ratio)
    at_perigee, at_apogee, final = np.sqrt(ratio / a), np.sqrt(1.0 / (ratio * a)), np.sqrt(1.0 / ratio)

    def changes(inclination: float) -> tuple[np.ndarray, np.ndarray]:
        """Velocity changes at perigee and apogee, canonical units, over a transfer orbit of this inclination [rad]."""
        along = np.array([0.0, np.cos(inclination), np.sin(inclination)])
        before = np.array([0.0, np.cos(plane_change), np.sin(plane_change)])
        return at_perigee * along - before, at_apogee * along - np.array([0.0, final, 0.0])

    def cost(inclination: float) -> float:
        return float(sum(np.linalg.norm(change) for change in changes(inclination)))

    best = 0.0
    if plane_change > 0.0:
        found = scipy.optimize.minimize_scalar(cost, bounds=(0.0, plane_change), options={"xatol": 1e-12})
        best = float(found.x)
    first, second = changes(best)
    start = np.array([1.0, 0.0, 0.0, 0.0, at_perigee * np.cos(best), at_perigee * np.sin(best)])
    sizes = float(np.linalg.norm(first)), float(np.linalg.norm(second))
    primer = first / sizes[0]
    return Impulsive(*sizes, best, a, primer, _primer_rate(start, primer, second / sizes[1], np.pi * a**1.5))


def _primer_rate(start: np.ndarray, first: np.ndarray, second: np.ndarray, dt: float) -> np.ndarray:
    """Rate of the primer vector at the first impulse: it becomes `second` after dt, and is longest at both.

    Half a revolution leaves one component free, so the five conditions (Lawden, 1963, chapter 5) on three numbers are
    met by least squares.  Canonical units.
    """
    basis = np.zeros((4, 12))
    basis[:, :6] = start
    basis[0, 6:9] = first
    basis[1:, 9:12] = np.eye(3)
    moved = coast(basis, np.full(4, dt))[:, 6:]
    own, by_rate = moved[0], moved[1:].T
    rows = np.vstack([by_rate[:3], first, second @ by_rate[3:]])
    return np.linalg.lstsq(rows, np.array([*(second - own[:3]), 0.0, -second @ own[3:]]), rcond=1e-9)[0]


def propellant_share(speed_change: float, exhaust: float) -> float:
    """Fraction of the initial mass that impulses of a total speed change need: eq. (1), integrated."""
    return float(-np.expm1(-speed_change / exhaust))
