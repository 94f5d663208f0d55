"""Designs: the points of a campaign's cases in the unit cube, or their levels on the axes of a grid.

Random designs give one uniform number per (dispersion, case); the n-th dispersion of the file is the n-th dimension.
Designs in blocks do so too, but the cases of a block belong together: Saltelli's blocks for Sobol' indices, Morris's
trajectories for elementary effects.  Designs by levels give, per dispersion, the level of each case.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from hashlib import sha256
from math import prod
from typing import Any

import numpy as np

from mc_engine.sampling.correlation import correlated, gaussian_copula, iman_conover
from mc_engine.sampling.sobol import scrambled_sobol
from mc_engine.sampling.streams import uniform_columns, uniforms
from mc_engine.status import MOST_CASES

RANDOM = ("mc", "lhs", "sobol")
IN_BLOCKS = ("saltelli", "morris")
BY_LEVELS = ("grid", "one_at_a_time")
DESIGNS = (*RANDOM, *IN_BLOCKS, *BY_LEVELS, "table")
EXTENSIBLE = ("mc", "sobol", *IN_BLOCKS)  # the first 1000 cases of 2000 are the 1000 flown before
MORRIS_LEVELS = 4

Pairs = tuple[tuple[str, str, float], ...]


def unit_cube(
    design: str, seed: int, names: Sequence[str], case_ids: np.ndarray, n_cases: int, pairs: Pairs = ()
) -> list[np.ndarray]:
    """One column float64[n] in [0, 1] per dispersion, for the cases asked for.

    case_ids : int64[n], in any order.  n_cases : size of the whole design, which only "lhs" depends on.
    pairs : rank correlations (name, name, rank).
    """
    if design == "lhs":  # kept for the next chunk, and indexed by an array, which copies
        return [column[case_ids] for column in _latin_hypercube(seed, tuple(names), n_cases, pairs)]
    if design in IN_BLOCKS:
        block, row = np.divmod(np.asarray(case_ids, dtype=np.int64), block_size(design, len(names)))
        return _saltelli(seed, names, block, row) if design == "saltelli" else _morris(seed, names, block, row)
    if design == "mc":
        cube = uniform_columns(seed, names, case_ids)
    else:
        keys = [sobol_key(f"{seed}/{name}/sobol") for name in names]
        cube = scrambled_sobol(keys, range(len(names)), case_ids)
    return correlated(gaussian_copula, list(cube), names, pairs)


def sobol_key(words: str) -> int:
    """The key that scrambles a Sobol' sequence, from its address."""
    return int.from_bytes(sha256(words.encode()).digest()[:8], "little")


def block_size(design: str, n_dispersions: int) -> int:
    """Cases of one block of a design in blocks; the number of cases must be a multiple of it."""
    return n_dispersions + (2 if design == "saltelli" else 1)


def block_problem(design: str, n_dispersions: int, n_cases: int) -> str:
    """Why a design cannot have this number of cases, as a sentence; empty if it can."""
    if n_cases > MOST_CASES:
        return f"{n_cases} is not allowed; it must be at most {MOST_CASES}"
    size = block_size(design, n_dispersions)
    if design not in IN_BLOCKS or not n_dispersions or n_cases % size == 0:
        return ""
    below = n_cases // size * size
    nearest = f"{below} or {below + size} would fit" if below else f"{size} would fit"
    return (
        f'{n_cases} is not allowed; "{design}" with {n_dispersions} dispersions has blocks of {size} cases: {nearest}'
    )


def extension_problem(manifest: Mapping[str, Any], has: int, cases: int) -> str:
    """Why a run with `has` cases cannot be extended to `cases`, as a sentence; empty if its manifest allows it."""
    design = manifest["campaign"]["design"]
    if manifest.get("upstream") is not None:
        return "takes its inputs from another run; extend that one, and fly this campaign anew"
    if manifest.get("shard") is not None:
        return "is a shard; merge the shards, and extend the whole"
    if design not in EXTENSIBLE:
        return f'the design "{design}" cannot be extended; {", ".join(EXTENSIBLE)} can'
    if cases > has:
        return ""
    return f"is to have {has} cases already; give a larger number in all, or `resume` it where cases are missing"


def _saltelli(seed: int, names: Sequence[str], block: np.ndarray, row: np.ndarray) -> list[np.ndarray]:
    """Row 0 of a block is a point A, the last one an independent point B, and row k + 1 is A with input k from B.

    A and B are one point of a scrambled Sobol' sequence of twice the dimensions.  Saltelli et al., Comput. Phys.
    Commun. 181 (2010), 259-270, matrices A, A_B and B, in the order in which SALib analyses them.
    """
    columns = []
    for k, name in enumerate(names):
        a, b = (
            # Each with a key of its own: under one key the first points of all dimensions are the same.
            scrambled_sobol(sobol_key(f"{seed}/{name}/saltelli {which}"), 2 * k + place, block)
            for place, which in enumerate("ab")
        )
        columns.append(np.where((row == len(names) + 1) | (row == k + 1), b, a))
    return columns


def _morris(seed: int, names: Sequence[str], block: np.ndarray, row: np.ndarray) -> list[np.ndarray]:
    """Trajectories: from a random point of a grid one input after the other, in random order, moves by half the levels.

    The levels are the middles of MORRIS_LEVELS equal parts of the unit interval, so that no quantile is infinite.
    Morris, Technometrics 33 (1991), 161-174, with 4 levels and steps of 2, up or down.
    """
    draws = [uniforms(seed, f"{name}/morris order", block) for name in names]
    place = np.argsort(np.argsort(np.array(draws).reshape(len(names), -1), axis=0, kind="stable"), axis=0)
    columns = []
    for name, before in zip(names, place, strict=True):
        level = (MORRIS_LEVELS * uniforms(seed, f"{name}/morris", block)).astype(np.int64)
        level = np.where(row > before, (level + MORRIS_LEVELS // 2) % MORRIS_LEVELS, level)
        columns.append((level + 0.5) / MORRIS_LEVELS)
    return columns


@lru_cache(maxsize=2)
def _latin_hypercube(seed: int, names: tuple[str, ...], n_cases: int, pairs: Pairs) -> list[np.ndarray]:
    """The whole design: each of n equal strata of each dispersion holds one case, somewhere inside it.

    McKay, Beckman & Conover, Technometrics 21 (1979), 239-245.
    """
    cases = np.arange(n_cases)
    columns = []
    for name in names:
        # The ranks of uniform draws are a random permutation, the same in every version of numpy.
        order = np.argsort(uniforms(seed, f"{name}/lhs/{n_cases}", cases), kind="stable")
        columns.append((order + uniforms(seed, name, cases)) / n_cases)
    return correlated(iman_conover, columns, names, pairs)


def level_count(design: str, sizes: Sequence[int]) -> int:
    """Number of cases when the dispersions have these numbers of levels."""
    return prod(sizes) if design == "grid" else 1 + sum(sizes)


def grid_levels(sizes: Sequence[int], case_ids: np.ndarray) -> list[np.ndarray]:
    """int64[n] per dispersion: the level of each case on a full grid; the last dispersion varies fastest."""
    levels = []
    rest = np.asarray(case_ids, dtype=np.int64)
    for size in reversed(sizes):
        levels.append(rest % size)
        rest = rest // size
    return levels[::-1]


def one_at_a_time_levels(sizes: Sequence[int], case_ids: np.ndarray) -> list[np.ndarray]:
    """int64[n] per dispersion: its level in each case, -1 for nominal.  Case 0 is all nominal."""
    levels = []
    first = 1
    for size in sizes:
        level = np.asarray(case_ids, dtype=np.int64) - first
        levels.append(np.where((level >= 0) & (level < size), level, -1))
        first += size
    return levels
