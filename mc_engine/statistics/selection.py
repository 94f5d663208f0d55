"""Order statistics of values that are seen part by part: exact, in four passes, whatever the order of the parts.

The bits of a float64, read as a whole number of 64 bits, can be made to sort as the values do.  Each pass counts 16
of these bits, from the leading ones on, among the values that agree with a wanted one so far (radix selection:
D. E. Knuth, The Art of Computer Programming, vol. 3, 2nd ed., 5.2.5 and 5.3.3).  Counts of parts are added.
Memory: 65 536 counts per wanted rank, whatever the number of values.
"""

from collections.abc import Iterable

import numpy as np

DIGIT_BITS = 16
DIGITS = 1 << DIGIT_BITS
PASSES = 64 // DIGIT_BITS
_SIGN = np.uint64(1 << 63)
_ALL = np.uint64((1 << 64) - 1)


def sortable(values: np.ndarray) -> np.ndarray:
    """uint64[n] that sorts as the finite float64[n] do; -0.0 before 0.0."""
    bits = np.ascontiguousarray(values, dtype=np.float64).view(np.uint64)
    return bits ^ np.where(bits & _SIGN, _ALL, _SIGN)


def from_sortable(key: int) -> float:
    """The value with this key."""
    bits = key ^ (int(_SIGN) if key & int(_SIGN) else int(_ALL))
    return float(np.uint64(bits).view(np.float64))


class Selection:
    """One pass of four: counts the next digit of the keys that begin as a wanted one does.

    wanted : by rank (1 ... n) the leading digits of its key found so far, as one number, and the rank that is left
    among the values with this beginning.  The first pass counts all values, whatever will be wanted.
    """

    def __init__(self, wanted: dict[int, tuple[int, int]] | None = None, digit: int = 0):
        self.wanted, self.digit = wanted or {}, digit
        beginnings = [beginning for beginning, _ in self.wanted.values()] if digit else [0]
        self.beginnings = np.unique(np.array(beginnings, dtype=np.uint64))
        self.counts = np.zeros((self.beginnings.size, DIGITS), dtype=np.int64)

    def add(self, finite: np.ndarray) -> None:
        """Count finite values float64[n]."""
        if not self.beginnings.size:
            return
        below = np.uint64(64 - DIGIT_BITS * (self.digit + 1))
        leading = sortable(finite) >> below
        digit = (leading & np.uint64(DIGITS - 1)).astype(np.int64)
        if self.digit == 0:
            self.counts[0] += np.bincount(digit, minlength=DIGITS)
            return
        beginning = leading >> np.uint64(DIGIT_BITS)
        row = np.minimum(np.searchsorted(self.beginnings, beginning), self.beginnings.size - 1)
        fits = self.beginnings[row] == beginning
        np.add.at(self.counts, (row[fits], digit[fits]), 1)

    def merge(self, other: "Selection") -> None:
        """Count all that the same pass over other values has counted."""
        self.counts += other.counts

    def next(self, ranks: Iterable[int] | None = None) -> "Selection":
        """The pass that follows when this one has seen all values.  ranks : those wanted, told after the first."""
        wanted = self.wanted if ranks is None else {rank: (0, rank) for rank in ranks}
        running = self.counts.cumsum(axis=1)
        found = {}
        for rank, (beginning, left) in wanted.items():
            row = running[np.searchsorted(self.beginnings, np.uint64(beginning))]
            digit = int(np.searchsorted(row, left))
            before = int(row[digit - 1]) if digit else 0
            found[rank] = ((beginning << DIGIT_BITS) | digit, left - before)
        return Selection(found, self.digit + 1)

    @property
    def values(self) -> dict[int, float]:
        """The value of every rank, once all passes are done."""
        if self.digit != PASSES:
            raise ValueError(f"{self.digit} of {PASSES} passes are done")
        return {rank: from_sortable(key) for rank, (key, _) in self.wanted.items()}
