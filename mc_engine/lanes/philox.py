"""Philox4x32-10: uniform random numbers addressed by (key, case, sample, index), as a kernel draws them.

Every draw has an address, so a case draws the same numbers alone, in any lane, in any order.

J. Salmon, M. Moraes, R. Dror, D. Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11 (2011), section 3.3.
"""

from collections import namedtuple
from hashlib import sha256

# key: whole number below 2**64; case and sample: whole numbers as floats
Draws = namedtuple("Draws", "key case sample")

MULTIPLIERS = (0xD2511F53, 0xCD9E8D57)
WEYL = (0x9E3779B9, 0xBB67AE85)
ROUNDS = 10
_WORD = 0xFFFFFFFF


def noise_key(seed: int, name: str = "noise") -> int:
    """The 64-bit key of one campaign seed and stream name."""
    return int.from_bytes(sha256(f"{seed}/{name}".encode()).digest()[:8], "little")


def philox_words(key: int, counter: tuple[int, int, int, int]) -> tuple[int, int, int, int]:
    """Four 32-bit words for a 64-bit key and four 32-bit counter words."""
    k0, k1 = key & _WORD, key >> 32
    c0, c1, c2, c3 = counter
    for _ in range(ROUNDS):
        p0, p1 = MULTIPLIERS[0] * c0, MULTIPLIERS[1] * c2
        c0, c1, c2, c3 = (p1 >> 32) ^ c1 ^ k0, p1 & _WORD, (p0 >> 32) ^ c3 ^ k1, p0 & _WORD
        k0, k1 = (k0 + WEYL[0]) & _WORD, (k1 + WEYL[1]) & _WORD
    return c0, c1, c2, c3


def uniform_pair(draws, index):
    """Two numbers in [0, 1) with 52 random bits each; `index` numbers the pairs drawn at one sample.

    Sample and index count by their last 32 bits: index -1 is 2**32 - 1, and 2**32 is 0.
    """
    case = int(draws.case)
    words = philox_words(int(draws.key), (case & _WORD, case >> 32, int(draws.sample) & _WORD, int(index) & _WORD))
    return tuple(((words[2 * i] << 20) | (words[2 * i + 1] >> 12)) * 2.0**-52 for i in range(2))
