"""The Halton sequence with scrambled digits, reachable point by point.

A point is a function of (seed, name, dimension, index).  Past some twenty dimensions the bases grow so
large that small samples fill the cube badly; use the design "sobol" there.
"""

from functools import lru_cache

import numpy as np

from mc_engine.streams import stream

_BLOCK = 8192  # points worked on at a time, so that they stay in cache


@lru_cache(maxsize=1024)
def prime(dimension: int) -> int:
    """The base of a dimension, counted from 0: 2, 3, 5, 7, ..."""
    candidate = 2 if dimension == 0 else prime(dimension - 1) + 1
    while any(candidate % divisor == 0 for divisor in range(2, int(candidate**0.5) + 1)):
        candidate += 1
    return candidate


@lru_cache(maxsize=256)
def _permutations(seed: int, name: str, base: int) -> np.ndarray:
    """int64[n_digits, base]: one random permutation of the digits for each place behind the point.

    As many places as fit into 63 bits: the points are then whole numbers, exact in any order of summing.
    """
    n_digits = 0
    while base ** (n_digits + 1) < 2**63:
        n_digits += 1
    draws = [stream(seed, f"{name}/halton", place).random(base) for place in range(n_digits)]
    return np.argsort(np.array(draws), axis=1, kind="stable")


def scrambled_halton(seed: int, name: str, dimension: int, indices: np.ndarray) -> np.ndarray:
    """float64[n] in [0, 1): one dimension of the Halton points `indices`, its digits permuted place by place.

    indices : int64[n], not negative.  Owen, A randomized Halton algorithm in R, arXiv:1706.02808.
    """
    base = prime(dimension)
    permutations = _permutations(seed, name, base)
    indices = np.asarray(indices, dtype=np.int64)
    result = np.empty(indices.size)
    for first in range(0, indices.size, _BLOCK):
        result[first : first + _BLOCK] = _radical_inverse(base, permutations, indices[first : first + _BLOCK])
    return result


def _radical_inverse(base: int, permutations: np.ndarray, indices: np.ndarray) -> np.ndarray:
    n_digits = len(permutations)
    total = np.zeros_like(indices)
    for place in range(n_digits):
        weight = base ** (n_digits - 1 - place)
        if not indices.any():  # only zeros are left, and each place permutes a zero to one known digit
            total += sum(int(permutations[rest, 0]) * base ** (n_digits - 1 - rest) for rest in range(place, n_digits))
            break
        quotient = indices // base
        total += permutations[place][indices - quotient * base] * weight
        indices = quotient
    # A total next to base**n_digits rounds to 1.0.
    return np.minimum(total / float(base**n_digits), 1.0 - 2.0**-53)
