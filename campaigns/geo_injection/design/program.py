"""The burn program: ignition times, durations and the thrust's direction, as data; kept as text, or designed.

A burn is one or more segments, on each of which the primer vector is a polynomial of degree 11 in s, from -1 at the
segment's start to 1 at its end; thrust points along it.  Its length means nothing.  Text files of TOML keep a program
under the names of its records' fields.
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
from campaigns.geo_injection.design.optimal import is_optimal
from campaigns.geo_injection.design.powered_arc import fly_burns
from campaigns.geo_injection.design.sequence import Sequence
from campaigns.geo_injection.design.staged import staged
from mc_engine.model import kept_design

KEPT = Path(__file__).parents[1] / "programs"
DESIGN = 1  # of the method and the file: programs with another number are not taken for its own
DEGREE = 11
_LONGEST = 2.5  # canonical time of a segment: the fit is then good to 1e-7 rad
_NODES = 24  # instants that a segment is fitted to
Powers = Annotated[list[float], Field(min_length=DEGREE + 1, max_length=DEGREE + 1)]


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
    """ignition_s : time after the first.  direction_error_rad : largest, of the fit.

    end : place [m] and velocity [m/s] at the nominal cut-off
    """

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
    """The program, designed now; ModelError says how far the search got where it found none."""
    problem = sequence.problem()
    if sequence.method == "staged":
        stages = staged(problem, sequence.orbits_between())
        flown = [(stage.ignition, stage.burn.duration, stage.burn.start, stage.burn.end) for stage in stages]
        return _program_of(sequence, flown, optimal=False)
    best = optimum(problem)
    rows = zip(best.ignitions, best.durations, best.states[::2], best.states[1::2], strict=True)
    return _program_of(sequence, list(rows), is_optimal(best))


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


def _program_of(sequence: Sequence, flown: list[tuple], optimal: bool) -> Program:
    """The program of burns given as (ignition, duration, states at ignition and cut-off) in canonical units."""
    burns, mass, unit = [], 1.0, sequence.time_unit
    for ignition, duration, state, end in flown:
        error, segments = _fitted(sequence, state, mass, duration)
        burns.append(BurnProgram(float(ignition * unit), float(duration * unit), error, sequence.si(end), segments))
        mass -= sequence.problem().flow * duration
    return Program(sequence, sequence.si(flown[0][2]), burns, optimal)


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
