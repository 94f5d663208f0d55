"""A program for a sequence: one that is kept beside the campaign, one designed before, or a new design.

New designs go to the folder `geo_injection` of the engine's cache, under the digest of their inputs.
"""

from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from campaigns.geo_injection.design.continuation import optimum
from campaigns.geo_injection.design.optimality import is_optimal
from campaigns.geo_injection.design.program import Program, from_text, of_solution, of_stages, to_text
from campaigns.geo_injection.design.sequence import Sequence
from campaigns.geo_injection.design.staged import staged
from mc_engine.durable_file import make_folder, write_durably
from mc_engine.errors import StoreError
from mc_engine.flight.kernel import cache_folder

KEPT = Path(__file__).parents[1] / "programs"


def new_design(sequence: Sequence) -> Program:
    """The program, designed now; ModelError says how far the search got where it found none."""
    problem = sequence.problem()
    if sequence.method == "staged":
        return of_stages(sequence, staged(problem, sequence.orbits_between()))
    solution = optimum(problem)
    return of_solution(sequence, solution, is_optimal(solution))


@lru_cache(maxsize=256)
def program_for(sequence: Sequence) -> Program:
    """The program of a sequence, designed once."""
    path = cache_folder() / "geo_injection" / f"{sequence.digest()[:20]}.toml"
    for file in [*sorted(KEPT.glob("*.toml")), path]:
        # a file that is absent or broken is no program: it is designed again
        with suppress(OSError, ValueError, KeyError, TypeError):
            program = from_text(file.read_text(encoding="utf-8"))
            if program.sequence == sequence:
                return program
    program = new_design(sequence)
    with suppress(StoreError):  # a full or read-only disk costs a design each time, no result
        make_folder(path.parent)
        write_durably(path, to_text(program).encode())
    return program
