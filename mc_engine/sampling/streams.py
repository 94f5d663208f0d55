"""Random numbers by address: every draw is a function of (seed, name, case) and of nothing else.

Adding a dispersion, a case or a worker leaves every other number as it was.  Changing any function here is
a new seed contract: raise SEED_CONTRACT and say so in the change log.
"""

import hashlib
from collections.abc import Sequence

import numpy as np

SEED_CONTRACT = 1

_BLOCK = 8192  # numbers worked on at a time: the few arrays of a block stay in the second-level cache
_LOW = np.uint64(0xFFFFFFFF)
_HALF = np.uint64(32)
_MULTIPLIERS = (0xD2E7470EE14C6C93, 0xCA5A826395121157)
_WEYL = (0x9E3779B97F4A7C15, 0xBB67AE8584CAA73B)
_WORD = 2**64


def stream_key(seed: int, name: str) -> np.ndarray:
    """The Philox key of one named stream, uint64[2]."""
    digest = hashlib.sha256(f"{seed}/{name}".encode()).digest()
    return np.frombuffer(digest[:16], dtype="<u8").astype(np.uint64)


def stream(seed: int, name: str, case_id: int) -> np.random.Generator:
    """Generator for one named quantity of one case, reachable without drawing the others."""
    # The case is the top word: 2**192 blocks per case before two cases could meet.
    return np.random.Generator(np.random.Philox(key=stream_key(seed, name), counter=[0, 0, 0, case_id]))


def uniforms(seed: int, name: str, case_ids: np.ndarray) -> np.ndarray:
    """float64[n] in [0, 1): for each case the first `random()` of its `stream`, bit for bit.

    case_ids : int64[n], not negative.
    """
    return uniform_columns(seed, [name], case_ids)[0]


def uniform_columns(seed: int, names: Sequence[str], case_ids: np.ndarray) -> np.ndarray:
    """float64[n_names, n]: the `uniforms` of several names, drawn together, since a chunk has few cases of each."""
    keys = np.array([stream_key(seed, name) for name in names], dtype=np.uint64).reshape(-1, 2, 1)
    cases = np.asarray(case_ids).astype(np.uint64)
    result = np.empty((len(keys), cases.size))
    size = _BLOCK // max(1, len(keys)) + 1
    for first in range(0, cases.size, size):
        result[:, first : first + size] = _first_doubles(keys, cases[first : first + size])
    return result


def _first_doubles(keys: np.ndarray, cases: np.ndarray) -> np.ndarray:
    """First word of Philox4x64-10 at counter (1, 0, 0, case), its upper 53 bits as a number in [0, 1): a row a key.

    keys : uint64[n_names, 2, 1].  Salmon, Moraes, Dror & Shaw, Parallel random numbers: as easy as 1, 2, 3, SC'11.
    """
    # NumPy steps the counter before its first block, hence 1 in the lowest word.  Words that are the same for all cases
    # are arrays of one number, so that the first rounds, which have few others, cost little.
    words = (np.ones(1, np.uint64), np.zeros(1, np.uint64), np.zeros(1, np.uint64), cases)
    steps = [[np.uint64(i * w % _WORD) for w in _WEYL] for i in range(10)]
    keys_of_rounds = [(keys[:, 0] + low, keys[:, 1] + high) for low, high in steps]
    for low_key, high_key in keys_of_rounds[:-1]:
        first, third = words[1] ^ low_key, words[3] ^ high_key
        first, third = first ^ _upper(words[2], _MULTIPLIERS[1]), third ^ _upper(words[0], _MULTIPLIERS[0])
        words = (first, words[2] * np.uint64(_MULTIPLIERS[1]), third, words[0] * np.uint64(_MULTIPLIERS[0]))
    first = words[1] ^ keys_of_rounds[-1][0] ^ _upper(words[2], _MULTIPLIERS[1])  # of the last round this word alone
    return (first >> np.uint64(11)) * 2.0**-53


def _upper(words: np.ndarray, multiplier: int) -> np.ndarray:
    """Upper 64 of the 128 bits of words * multiplier, through four products of 32-bit halves.

    Worked out in place: another array for each step would leave the cache.
    """
    m_low, m_high = np.uint64(multiplier & 0xFFFFFFFF), np.uint64(multiplier >> 32)
    low, high = words & _LOW, words >> _HALF
    middle = low * m_low
    middle >>= _HALF
    middle += high * m_low
    low *= m_high
    low += middle & _LOW
    low >>= _HALF
    middle >>= _HALF
    high *= m_high
    high += middle
    high += low
    return high
