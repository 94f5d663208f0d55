"""Designs: where the cases of a campaign lie in the unit cube, or on the axes of a grid.

Random designs give one uniform number per (dispersion, case); a dispersion's place in the file is its
dimension.  Designs by levels give, per dispersion, the level that each case takes.
"""

from collections.abc import Sequence
from functools import lru_cache
from hashlib import sha256
from math import prod

import numpy as np

from mc_engine import correlation
from mc_engine.halton import scrambled_halton
from mc_engine.sobol import scrambled_sobol
from mc_engine.streams import uniforms

RANDOM = ("mc", "lhs", "sobol", "halton")
BY_LEVELS = ("grid", "one_at_a_time")
DESIGNS = (*RANDOM, *BY_LEVELS, "table")
EXTENSIBLE = ("mc", "sobol", "halton")  # the first 1000 cases of 2000 are the 1000 flown before

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
    columns = [_column(design, seed, name, dimension, case_ids) for dimension, name in enumerate(names)]
    return _correlated(correlation.gaussian_copula, columns, names, pairs)


def _column(design: str, seed: int, name: str, dimension: int, case_ids: np.ndarray) -> np.ndarray:
    if design == "mc":
        return uniforms(seed, name, case_ids)
    if design == "sobol":
        key = sha256(f"{seed}/{name}/sobol".encode()).digest()[:8]
        return scrambled_sobol(int.from_bytes(key, "little"), dimension, case_ids)
    return scrambled_halton(seed, name, dimension, case_ids)


def _correlated(method, columns: list[np.ndarray], names: Sequence[str], pairs: Pairs) -> list[np.ndarray]:
    members, matrix = correlation.group_matrix(names, pairs)
    if members:
        for place, column in zip(members, method([columns[place] for place in members], matrix), strict=True):
            columns[place] = column
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
    return _correlated(correlation.iman_conover, columns, names, pairs)


def level_count(design: str, sizes: Sequence[int]) -> int:
    """Number of cases when the dispersions have these numbers of levels."""
    return prod(sizes) if design == "grid" else 1 + sum(sizes)


def grid_levels(sizes: Sequence[int], case_ids: np.ndarray) -> list[np.ndarray]:
    """int64[n] per dispersion: the level of each case on a full grid, the last dispersion running fastest."""
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
