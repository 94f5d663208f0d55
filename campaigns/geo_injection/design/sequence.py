"""What a burn program is designed for: the orbits, the engine and the method, in SI; and its canonical problem."""

from dataclasses import dataclass

import numpy as np

from campaigns.geo_injection.design.optimal import Problem
from campaigns.geo_injection.design.staged import Orbit
from mc_engine.physics.constants import MU_EARTH


@dataclass(frozen=True)
class Sequence:
    """radii [m], inclinations [rad], thrust [N], mass flow [kg/s], mass [kg].

    between : of the staged procedure alone: (semi-major axis [m], eccentricity, plane change so far [rad]) of each
        orbit between two burns
    parking_radius, parking_perigee : of the parking orbit's perigee; its argument [rad]
    """

    method: str
    burns: int
    initial_inclination: float
    final_inclination: float
    parking_radius: float
    final_radius: float
    thrust: float
    mass_flow: float
    mass: float
    between: tuple[tuple[float, float, float], ...] = ()
    parking_eccentricity: float = 0.0
    parking_perigee: float = 0.0

    @property
    def speed_unit(self) -> float:
        """Circular speed at the parking radius [m/s]: the unit that goes with mu = radius = mass = 1."""
        return float(np.sqrt(MU_EARTH / self.parking_radius))

    @property
    def time_unit(self) -> float:
        """Time in which a circular orbit of the parking radius turns by one radian [s]."""
        return self.parking_radius / self.speed_unit

    def problem(self) -> Problem:
        """The same in canonical units: parking radius, circular speed there, initial mass."""
        acceleration = self.speed_unit / self.time_unit
        return Problem(
            self.burns,
            abs(self.initial_inclination - self.final_inclination),
            self.final_radius / self.parking_radius,
            self.thrust / self.mass / acceleration,
            self.mass_flow / self.mass * self.time_unit,
            self.parking_eccentricity,
            self.parking_perigee,
        )

    def orbits_between(self) -> tuple[Orbit, ...]:
        """Orbits of the staged procedure, semi-major axes in the unit of the parking radius, inclinations [rad]."""
        change = abs(self.initial_inclination - self.final_inclination)
        return tuple(Orbit(a / self.parking_radius, e, max(change - so_far, 0.0)) for a, e, so_far in self.between)

    def inertial(self, vectors: np.ndarray) -> np.ndarray:
        """Vectors [..., 3] of the design's axes (z normal to the final orbit), in their unit, with z to the north pole.

        Designs have an inclination that falls; one that rises is the mirror image.
        """
        mirror = -1.0 if self.final_inclination > self.initial_inclination else 1.0
        x, y, z = vectors[..., 0], vectors[..., 1], mirror * vectors[..., 2]
        c, s = np.cos(self.final_inclination), np.sin(self.final_inclination)
        return np.stack([x, c * y - s * z, s * y + c * z], axis=-1)

    def si(self, state: np.ndarray) -> list[float]:
        """Place [m] and velocity [m/s], z to the north pole, of a canonical state of the design's axes."""
        place, velocity = self.inertial(state[:3]), self.inertial(state[3:6])
        return [*(place * self.parking_radius).tolist(), *(velocity * self.speed_unit).tolist()]


def source_orbits(burns: int, plane_change: float) -> tuple[tuple[float, float, float], ...]:
    """Orbits between two burns of tables 2, 3 and 7: (semi-major axis [m], eccentricity, plane change so far [rad]).

    plane_change : of the whole flight [rad].  Two burns change 2.5 deg of 28.5 at first and 3 deg of 55; others are put
    on the line through both.  With three burns the source has 28.5 deg alone.
    """
    if burns == 2:
        first = np.radians(2.5) + (plane_change - np.radians(28.5)) * (0.5 / 26.5)
        return ((24_588e3, 0.7142, min(float(first), plane_change)),)
    changes = [min(float(np.radians(degrees)), plane_change) for degrees in (1.5, 3.5)]
    return ((8_733.1e3, 0.2456, changes[0]), (24_438e3, 0.7247, changes[1]))
