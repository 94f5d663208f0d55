"""Exact order statistics of values that are read part by part, in two to four passes and any order of the parts.

The bits of a float64, read as a 64-bit integer, can be made to sort as the values do.  Each pass counts 16 of these
bits, beginning with the leading ones, among the values that agree with a wanted one so far (radix selection: D. E.
Knuth, The Art of Computer Programming, vol. 3, 2nd ed., 5.2.5 and 5.3.3).  When few values are left, the next pass, the
last one, keeps and sorts them.

Memory: 65 536 counts per wanted rank, or FEW values, whatever the number of values.
"""

from collections.abc import Iterable

import numpy as np

DIGIT_BITS = 16
DIGITS = 1 << DIGIT_BITS
PASSES = 64 // DIGIT_BITS
FEW = 1 << 18
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
    """One pass of several: counts the next digit of the keys that begin as a wanted one does, or keeps these keys.

    wanted : by rank (1 ... n) the leading digits of its key found so far, as one number, and the rank that is left
    among the values with this beginning.  The first pass counts all values, before the ranks are known.
    few : whether so few values have these beginnings that they are kept.
    """

    def __init__(self, wanted: dict[int, tuple[int, int]] | None = None, digit: int = 0, few: bool = False):
        self.wanted, self.digit, self.few = wanted or {}, digit, few
        beginnings = [beginning for beginning, _ in self.wanted.values()] if digit else [0]
        self.beginnings = np.unique(np.array(beginnings, dtype=np.uint64))
        self.counts = np.zeros((0 if few else self.beginnings.size, DIGITS), dtype=np.int64)
        self.kept: list[np.ndarray] = []

    @property
    def done(self) -> bool:
        """Whether no pass is left to make."""
        return self.digit == PASSES

    def add(self, finite: np.ndarray) -> None:
        """Count finite values float64[n]."""
        if not self.beginnings.size or self.done:
            return
        keys = sortable(finite)
        if self.digit == 0:
            digit = (keys >> np.uint64(64 - DIGIT_BITS)).astype(np.int64)
            self.counts[0] += np.bincount(digit, minlength=DIGITS)
            return
        beginning = keys >> np.uint64(64 - DIGIT_BITS * self.digit)
        row = np.minimum(np.searchsorted(self.beginnings, beginning), self.beginnings.size - 1)
        fits = self.beginnings[row] == beginning
        if self.few:
            self.kept.append(keys[fits])
            return
        below = np.uint64(64 - DIGIT_BITS * (self.digit + 1))
        digit = ((keys[fits] >> below) & np.uint64(DIGITS - 1)).astype(np.int64)
        np.add.at(self.counts, (row[fits], digit), 1)

    def next(self, ranks: Iterable[int] | None = None) -> "Selection":
        """The pass that follows when this one has seen all values.  ranks : those wanted, told after the first."""
        wanted = self.wanted if ranks is None else {rank: (0, rank) for rank in ranks}
        if self.few:
            return self._found()
        running = self.counts.cumsum(axis=1)
        narrowed, sizes = {}, {}
        for rank, (beginning, left) in wanted.items():
            row = running[np.searchsorted(self.beginnings, np.uint64(beginning))]
            digit = int(np.searchsorted(row, left))
            before = int(row[digit - 1]) if digit else 0
            narrowed[rank] = ((beginning << DIGIT_BITS) | digit, left - before)
            sizes[narrowed[rank][0]] = int(row[digit]) - before
        last = self.digit + 1 == PASSES
        return Selection(narrowed, self.digit + 1, few=not last and sum(sizes.values()) <= FEW)

    def _found(self) -> "Selection":
        """The end: whole keys, from those kept."""
        keys = np.sort(np.concatenate([np.zeros(0, dtype=np.uint64), *self.kept]))
        below = 64 - DIGIT_BITS * self.digit
        whole_keys = {}
        for rank, (beginning, left) in self.wanted.items():
            first = int(np.searchsorted(keys, np.uint64(beginning << below)))
            whole_keys[rank] = (int(keys[first + left - 1]), 1)
        return Selection(whole_keys, PASSES)

    @property
    def values(self) -> dict[int, float]:
        """The value of every rank, once all passes are done."""
        return {rank: from_sortable(key) for rank, (key, _) in self.wanted.items()}
