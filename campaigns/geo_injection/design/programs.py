"""A program for a sequence: one that is kept beside the campaign, one designed before, or a new design."""

from contextlib import suppress
from functools import lru_cache
from pathlib import Path

import numpy as np

from campaigns.geo_injection.design.continuation import optimum
from campaigns.geo_injection.design.optimality import is_optimal
from campaigns.geo_injection.design.program import Program, from_text, program_of, to_text
from campaigns.geo_injection.design.sequence import Sequence
from campaigns.geo_injection.design.staged import staged
from mc_engine.model import kept_design

KEPT = Path(__file__).parents[1] / "programs"


def new_design(sequence: Sequence) -> Program:
    """The program, designed now; ModelError says how far the search got where it found none."""
    problem = sequence.problem()
    if sequence.method == "staged":
        stages = staged(problem, sequence.orbits_between())
        flown = [(stage.ignition, stage.burn.duration, stage.burn.start, stage.burn.end) for stage in stages]
        return program_of(sequence, flown, optimal=False)
    best = optimum(problem)
    rows = zip(best.ignitions, best.durations, best.states[::2], best.states[1::2], strict=True)
    return program_of(sequence, list(rows), is_optimal(best))


@lru_cache(maxsize=256)
def program_for(sequence: Sequence) -> Program:
    """The program of a sequence, designed once."""
    for file in sorted(KEPT.glob("*.toml")):
        # a file that is absent or broken is no program: it is designed again
        with suppress(OSError, ValueError, KeyError, TypeError):
            program = from_text(file.read_text(encoding="utf-8"))
            if program.sequence == sequence:
                return program
    return from_text(kept_design(_new_text, sequence).tobytes().decode())


def _new_text(sequence: Sequence) -> np.ndarray:
    """The text of a new design, as bytes uint8[n]."""
    return np.frombuffer(to_text(new_design(sequence)).encode(), dtype=np.uint8)
