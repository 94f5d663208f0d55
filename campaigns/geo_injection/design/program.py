"""The burn program: ignition times, durations and the thrust's direction, as data.

A burn is one or more segments, on each of which the primer vector is a polynomial of degree 11 in s, from -1 at the
segment's start to 1 at its end; thrust points along it.  Its length means nothing.  Text files of TOML keep a program.
"""

import json
import tomllib
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from campaigns.geo_injection.design.sequence import DESIGN, Sequence

DEGREE = 11
_LONGEST = 2.5  # canonical time of a segment: the fit is then good to 1e-7 rad
_NODES = 24  # instants that a segment is fitted to


@dataclass(frozen=True)
class Segment:
    """start : time after ignition [s];  length [s];  steering : float64[3, DEGREE + 1], powers of s, rising."""

    start: float
    length: float
    steering: np.ndarray


@dataclass(frozen=True)
class BurnProgram:
    """ignition : time after the first [s];  duration [s];  error : of the fitted direction [rad].

    end : place [m] and velocity [m/s] at the nominal cut-off
    """

    ignition: float
    duration: float
    error: float
    end: np.ndarray
    segments: tuple[Segment, ...]


@dataclass(frozen=True)
class Program:
    """start : place [m] and velocity [m/s] at the first ignition, z to the north pole, x to the ascending node.

    optimal : whether the switching function has its right sign all along; of a staged program, false
    """

    sequence: Sequence
    start: np.ndarray
    burns: tuple[BurnProgram, ...]
    optimal: bool

    @property
    def propellant(self) -> float:
        """Propellant of the nominal flight [kg]."""
        return self.sequence.mass_flow * sum(burn.duration for burn in self.burns)


def _fitted(sequence: Sequence, start: np.ndarray, mass: float, duration: float) -> tuple[float, tuple[Segment, ...]]:
    """(largest error [rad], segments) of one burn from its canonical state at ignition."""
    from campaigns.geo_injection.design.powered_arc import fly_burns  # imports numba

    problem = sequence.problem()
    count = max(1, int(np.ceil(duration / _LONGEST)))
    edges = np.linspace(0.0, duration, count + 1)
    nodes = np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES)
    worst, segments = 0.0, []
    for low, high in pairwise(edges):
        times = 0.5 * (low + high) + 0.5 * (high - low) * nodes
        states = fly_burns(
            np.repeat(start[None], _NODES, axis=0), np.full(_NODES, mass), times, problem.thrust, problem.flow
        )
        primer = sequence.inertial(states[:, 6:9])
        primer = primer / np.linalg.norm(primer, axis=1).mean()
        series = chebyshev.chebfit(nodes, primer, DEGREE)
        error = np.cross(chebyshev.chebval(nodes, series).T, primer) / (primer**2).sum(1)[:, None]
        worst = max(worst, float(np.abs(error).max()))
        powers = [chebyshev.cheb2poly(column) for column in series.T]
        # numpy drops the zeros at their end
        steering = np.array([np.pad(column, (0, DEGREE + 1 - column.size)) for column in powers])
        unit = sequence.time_unit
        segments.append(Segment(float(low * unit), float((high - low) * unit), steering))
    return worst, tuple(segments)


def _in_space(sequence: Sequence, state: np.ndarray) -> np.ndarray:
    """Place [m] and velocity [m/s], float64[6], z to the north pole, of a canonical state of the design's axes."""
    place = sequence.inertial(state[:3]) * sequence.parking_radius
    return np.concatenate([place, sequence.inertial(state[3:6]) * sequence.speed_unit])


def program_of(sequence: Sequence, flown: list[tuple], optimal: bool) -> Program:
    """The program of burns given as (ignition, duration, states at ignition and cut-off) in canonical units."""
    burns, mass, unit = [], 1.0, sequence.time_unit
    for ignition, duration, state, end in flown:
        error, segments = _fitted(sequence, state, mass, duration)
        times = float(ignition * unit), float(duration * unit)
        burns.append(BurnProgram(*times, error, _in_space(sequence, end), segments))
        mass -= sequence.problem().flow * duration
    return Program(sequence, _in_space(sequence, flown[0][2]), tuple(burns), optimal)


# the names of numbers in the text, which carry their units
_OF_BURN = {"ignition": "ignition_s", "duration": "duration_s", "error": "direction_error_rad", "end": "end"}
_OF_SEGMENT = {"start": "start_s", "length": "length_s"}


def to_text(program: Program) -> str:
    """The program as TOML, SI."""
    whole = {"design": DESIGN, "optimal": program.optimal, "start": program.start}
    lines = ["# Burn program: see program.py.  Written by the design; edit its inputs instead.", *_lines(whole)]
    lines += ["", "[sequence]", *_lines(asdict(program.sequence))]
    for burn in program.burns:
        lines += ["", "[[burn]]", *_lines({key: getattr(burn, name) for name, key in _OF_BURN.items()})]
        for segment in burn.segments:
            values = {key: getattr(segment, name) for name, key in _OF_SEGMENT.items()}
            values |= dict(zip("xyz", segment.steering, strict=True))
            lines += ["", "[[burn.segment]]", *_lines(values)]
    return "\n".join(lines) + "\n"


def _lines(values: dict[str, Any]) -> list[str]:
    """Key and value of each number, array or word, with every digit: TOML's values are those of JSON."""
    return [f"{key} = {json.dumps(np.asarray(value).tolist())}" for key, value in values.items()]


def from_text(text: str) -> Program:
    """The program that `to_text` wrote; ValueError or KeyError where it is another file."""
    record = tomllib.loads(text)
    if record["design"] != DESIGN:
        raise ValueError("a program of another design")
    inputs: dict[str, Any] = record["sequence"]
    sequence = Sequence(**{**inputs, "between": tuple(tuple(row) for row in inputs["between"])})
    burns = tuple(_burn_of(burn) for burn in record["burn"])
    return Program(sequence, np.array(record["start"]), burns, bool(record["optimal"]))


def _burn_of(record: dict[str, Any]) -> BurnProgram:
    segments = tuple(
        Segment(**{name: one[key] for name, key in _OF_SEGMENT.items()}, steering=np.array([one[x] for x in "xyz"]))
        for one in record["segment"]
    )
    values = {name: record[key] for name, key in _OF_BURN.items()}
    return BurnProgram(**values | {"end": np.array(values["end"])}, segments=segments)
