"""The Sobol sequence with Owen scrambling, with random access to any point.

A point is a function of (key, dimension, index): more points, or more dimensions after it, do not change it.  Valid up
to 128 dimensions and 2**32 points; beyond, use the design "mc".
"""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np

MAX_DIMENSIONS = 128  # of the table in sobol_numbers.txt

_BITS = 32
_BLOCK = 8192  # numbers worked on at a time, so that they stay in cache
_GROUP = 4  # digits scrambled with one hash: their 15 inner nodes take one bit each
_ONE = np.uint64(1)


@cache
def _starting_numbers() -> list[tuple[int, list[int]]]:
    """(primitive polynomial, m_1 ... m_s) of the dimensions from 2 on; the first has every m = 1 and needs none."""
    lines = Path(__file__).with_name("sobol_numbers.txt").read_text(encoding="ascii").splitlines()
    numbers = [[int(word) for word in line.split()] for line in lines if not line.startswith("#")]
    return [(polynomial, start) for polynomial, *start in numbers]


@cache
def direction_numbers(dimension: int) -> tuple[int, ...]:
    """The 32 direction numbers of a dimension (counted from 0), as 32-bit fractions, first digit on top.

    Bratley & Fox, Algorithm 659, ACM Trans. Math. Softw. 14 (1988), 88-100.
    """
    if dimension == 0:
        return tuple(1 << (_BITS - k) for k in range(1, _BITS + 1))
    polynomial, start = _starting_numbers()[dimension - 1]
    degree = len(start)
    m = list(start)
    for k in range(degree, _BITS):
        new = m[k - degree]
        for j in range(1, degree + 1):
            new ^= ((polynomial >> (degree - j)) & 1) * (m[k - j] << j)
        m.append(new)
    return tuple(m[k] << (_BITS - 1 - k) for k in range(_BITS))


def sobol_digits(dimension: int | Sequence[int], indices: np.ndarray) -> np.ndarray:
    """uint64[n], or [n_dimensions, n]: points as 32-bit fractions, in Gray-code order, not scrambled."""
    gray = indices ^ (indices >> _ONE)
    directions = np.array([direction_numbers(d) for d in np.ravel(dimension).tolist()], dtype=np.uint64)
    directions = directions.reshape(*np.shape(dimension), _BITS, 1)
    digits = np.zeros((*np.shape(dimension), indices.size), dtype=np.uint64)
    for k in range(_BITS):
        digits ^= ((gray >> np.uint64(k)) & _ONE) * directions[..., k, :]
    return digits


def scrambled_sobol(key: int | Sequence[int], dimension: int | Sequence[int], indices: np.ndarray) -> np.ndarray:
    """float64[n] in [0, 1): one dimension of the Sobol points `indices`, scrambled by `key`.

    Of several dimensions, each with its key, float64[n_dimensions, n]: drawn together, since a chunk has few points.

    indices : int64[n], 0 <= index < 2**32.
    Nested uniform scrambling: Owen, Randomly permuted (t,m,s)-nets and (t,s)-sequences, 1995.
    """
    indices = np.asarray(indices).astype(np.uint64)
    keys = np.array(key, dtype=np.uint64)[..., np.newaxis]
    result = np.empty((*np.shape(dimension), indices.size))
    size = _BLOCK // max(1, keys.size) + 1
    for first in range(0, indices.size, size):
        digits = sobol_digits(dimension, indices[first : first + size])
        result[..., first : first + size] = _scrambled(keys, digits)
    return result


def _scrambled(key: np.ndarray, digits: np.ndarray) -> np.ndarray:
    """Flip each digit by a coin that depends on all digits before it; fill 21 more digits below."""
    flips = np.zeros_like(digits)
    for level in range(0, _BITS, _GROUP):
        # The leading 1 tells a short prefix from a longer one that begins with zeros.
        coins = _hash(key, (digits >> np.uint64(_BITS - level)) | np.uint64(1 << level))
        node = np.ones_like(digits)
        for k in range(level, level + _GROUP):
            shift = np.uint64(_BITS - 1 - k)
            flips |= ((coins >> node) & _ONE) << shift
            node = (node << _ONE) | ((digits >> shift) & _ONE)
    below = _hash(key, digits | np.uint64(1 << _BITS)) >> np.uint64(64 - 21)
    return (((digits ^ flips) << np.uint64(21)) | below) * 2.0**-53


def _hash(key: np.ndarray, words: np.ndarray) -> np.ndarray:
    """64 random bits per word.  SplitMix64: Steele, Lea & Flood, OOPSLA 2014."""
    z = words * np.uint64(0x9E3779B97F4A7C15) + key
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))
