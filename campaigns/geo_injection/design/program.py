"""What a burn program is designed for, and the program: ignition times, durations and the thrust's direction, as data.

A burn is one or more segments, on each of which the primer vector is a polynomial of degree 11 in s, from -1 at the
start to 1 at the end; thrust points along it, its length means nothing.  TOML keeps a program under the names of the
fields.
"""

import json
import tomllib
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.polynomial import chebyshev
from pydantic import Field, StrictBool, TypeAdapter

from campaigns.geo_injection.design.continuation import optimum
from campaigns.geo_injection.design.optimal import Problem, is_optimal
from campaigns.geo_injection.design.powered_arc import fly_burns
from campaigns.geo_injection.design.staged import Orbit, staged
from mc_engine.model import kept_design
from mc_engine.physics.constants import MU_EARTH

KEPT = Path(__file__).parents[1] / "programs"
DESIGN = 1  # of the method and the file: programs with another number are not taken for its own
DEGREE = 11
_LONGEST = 2.5  # canonical time of a segment: the fit is then good to 1e-7 rad
_NODES = 24  # instants that a segment is fitted to
Powers = Annotated[list[float], Field(min_length=DEGREE + 1, max_length=DEGREE + 1)]


@dataclass(frozen=True)
class Sequence:
    """radii [m], inclinations [rad], thrust [N], mass flow [kg/s], mass [kg].

    between : orbits between two burns of the staged procedure, see `source_orbits`
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
        """Vectors [..., 3] of the design's axes (z normal to the final orbit), in their unit, z to the north pole."""
        # designs have an inclination that falls; one that rises is the mirror image
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


@dataclass(frozen=True)
class Segment:
    """start_s : time after ignition.  x, y, z : coefficients of the primer vector's components, powers of s, rising."""

    start_s: float
    length_s: float
    x: Powers
    y: Powers
    z: Powers


@dataclass(frozen=True)
class BurnProgram:
    """ignition_s : after the first.  direction_error_rad : largest, of the fit.  end : place [m], velocity [m/s]."""

    ignition_s: float
    duration_s: float
    direction_error_rad: float
    end: list[float]
    segments: Annotated[list[Segment], Field(alias="segment")]


@dataclass(frozen=True)
class Program:
    """start : place [m] and velocity [m/s] at the first ignition, z to the north pole, x to the ascending node.

    optimal : whether the switching function has its right sign all along; of a staged program, false
    """

    sequence: Sequence
    start: list[float]
    burns: Annotated[list[BurnProgram], Field(alias="burn")]
    optimal: StrictBool


def new_design(sequence: Sequence) -> Program:
    """The program, designed now, SI; ModelError says how far the search got where it found none."""
    problem, unit, mass = sequence.problem(), sequence.time_unit, 1.0
    if sequence.method == "staged":
        burns = staged(problem, sequence.orbits_between())
        flown, optimal = [(burn.ignition, burn.duration, burn.start, burn.end) for burn in burns], False
    else:
        best = optimum(problem)
        flown = list(zip(best.ignitions, best.durations, best.states[::2], best.states[1::2], strict=True))
        optimal = is_optimal(best)
    programs, first = [], flown[0][2]
    for ignition, duration, start, end in flown:
        error, segments = _fitted(sequence, start, mass, duration)
        programs.append(BurnProgram(float(ignition * unit), float(duration * unit), error, sequence.si(end), segments))
        mass -= problem.flow * duration
    return Program(sequence, sequence.si(first), programs, optimal)


@lru_cache(maxsize=256)
def program_for(sequence: Sequence) -> Program:
    """The program of a sequence: one that is kept beside the campaign, one designed before, or a new design."""
    for file in sorted(KEPT.glob("*.toml")):
        with suppress(OSError, ValueError):  # a file that is absent or broken is no program: it is designed again
            program = from_text(file.read_text(encoding="utf-8"))
            if program.sequence == sequence:
                return program
    return from_text(kept_design(_new_text, sequence).tobytes().decode())


def _new_text(sequence: Sequence) -> np.ndarray:
    """The text of a new design, as bytes uint8[n]."""
    return np.frombuffer(to_text(new_design(sequence)).encode(), dtype=np.uint8)


def _fitted(sequence: Sequence, start: np.ndarray, mass: float, duration: float) -> tuple[float, list[Segment]]:
    """(largest error [rad], segments) of one burn from its canonical state at ignition."""
    problem, unit = sequence.problem(), sequence.time_unit
    edges = np.linspace(0.0, duration, max(1, int(np.ceil(duration / _LONGEST))) + 1)
    nodes = np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES)
    worst, segments = 0.0, []
    for low, high in pairwise(edges):
        times = 0.5 * (low + high) + 0.5 * (high - low) * nodes
        primer = sequence.inertial(fly_burns(start, mass, times, problem.thrust, problem.flow)[:, 6:9])
        primer = primer / np.linalg.norm(primer, axis=1).mean()
        series = chebyshev.chebfit(nodes, primer, DEGREE)
        error = np.cross(chebyshev.chebval(nodes, series).T, primer) / (primer**2).sum(1)[:, None]
        worst = max(worst, float(np.abs(error).max()))
        powers = (chebyshev.cheb2poly(column) for column in series.T)
        # numpy drops the zeros at their end
        x, y, z = (np.pad(column, (0, DEGREE + 1 - column.size)).tolist() for column in powers)
        segments.append(Segment(float(low * unit), float((high - low) * unit), x, y, z))
    return worst, segments


def to_text(program: Program) -> str:
    """The program as TOML, SI."""
    whole = {"design": DESIGN, "optimal": program.optimal, "start": program.start}
    lines = ["# Burn program: see program.py.  Written by the design; edit its inputs instead.", *_lines(whole)]
    lines += ["", "[sequence]", *_lines(vars(program.sequence))]
    for burn in program.burns:
        lines += ["", "[[burn]]", *_lines({key: value for key, value in vars(burn).items() if key != "segments"})]
        for segment in burn.segments:
            lines += ["", "[[burn.segment]]", *_lines(vars(segment))]
    return "\n".join(lines) + "\n"


def _lines(values: dict[str, Any]) -> list[str]:
    """Key and value of each number, list or word, with every digit: TOML's values are those of JSON."""
    return [f"{key} = {json.dumps(value)}" for key, value in values.items()]


def from_text(text: str) -> Program:
    """The program that `to_text` wrote; ValueError where it is another file."""
    record = tomllib.loads(text)
    if record.get("design") != DESIGN:
        raise ValueError("a program of another design")
    return TypeAdapter(Program).validate_python(record)
