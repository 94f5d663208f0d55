"""Moments of a metric in two passes, the same to the last bit in any order of the cases and any grouping of parts.

First pass (`Tally`): number, smallest, largest and exact sum.  Second pass (`Spread`): exact sums of the powers of
the distances from the mean; each power is rounded on its own, which depends on the case alone.  Both merge.

An exact sum (`ExactSum`) is one whole number of units of 2**-1074, the smallest float64.  Blocks of values are cut into
slices of a few leading bits, so short that adding up a slice of a whole block rounds nothing: the error-free vector
transformation of S. M. Rump, T. Ogita & S. Oishi, SIAM J. Sci. Comput. 31 (2008), 189-224, section 3.
"""

from math import frexp, ldexp, sqrt

import numpy as np

from mc_engine.statistics.normality import Normality, normality_of

UNIT_BITS = 1074
BLOCK = 1 << 16
HEADROOM = 17  # bits above the largest value of a block: those of its length, and one for the rounding of a slice
HUGE = 2.0**960  # from here on a slice's own headroom would overflow
HUGE_SHIFT = 64


def finite_values(values: np.ndarray) -> np.ndarray:
    """The finite ones of float64[n], with -0.0 as 0.0, which it equals."""
    finite = np.isfinite(values)
    return (values if finite.all() else values[finite]) + 0.0


def near_one(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`values` (float64[n] or [n, k]) divided by a power of two near the largest of each column; and its exponent.

    The division is exact.  Squares and differences of the result neither overflow nor vanish.
    """
    exponent = np.frexp(np.abs(np.where(np.isfinite(values), values, 0.0)).max(axis=0, initial=0.0))[1]
    return np.ldexp(values, -exponent), exponent


def in_units(values: np.ndarray | float, exponent: np.ndarray) -> np.ndarray:
    """The inverse of `near_one`: values in their own unit again; infinite, without a warning, beyond float64."""
    with np.errstate(over="ignore"):
        return np.ldexp(values, exponent)


class ExactSum:
    """The sum of all finite values put in; `units` is its exact value times 2**1074."""

    def __init__(self, units: int = 0):
        self.units = units

    def add(self, values: np.ndarray) -> None:
        """Put in float64[n], all finite."""
        for first in range(0, values.size, BLOCK):
            block = values[first : first + BLOCK]
            huge = np.abs(block) >= HUGE
            if huge.any():
                self.units += _block_units(block[huge] * 2.0**-HUGE_SHIFT) << HUGE_SHIFT
                block = block[~huge]
            self.units += _block_units(block)

    def merge(self, other: "ExactSum") -> None:
        """Put in all that another sum holds."""
        self.units += other.units

    def over(self, count: int) -> float:
        """The sum divided by a whole number, rounded once; OverflowError beyond float64."""
        return self.units / (count << UNIT_BITS)  # Python divides whole numbers with one rounding


def _block_units(values: np.ndarray) -> int:
    rest, units = values.copy(), 0
    while rest.size:
        largest = float(np.abs(rest).max())
        if largest == 0.0:
            break
        anchor = ldexp(1.0, frexp(largest)[1] + HEADROOM)
        leading = (anchor + rest) - anchor  # the bits of each value that the anchor's last place reaches
        rest -= leading
        numerator, denominator = float(leading.sum()).as_integer_ratio()
        units += numerator << (UNIT_BITS + 1 - denominator.bit_length())
    return units


class Tally:
    """First pass: number, extremes and exact sum.  n_used : finite values of n_tried."""

    def __init__(self) -> None:
        self.n_used = self.n_tried = 0
        self.minimum, self.maximum = np.inf, -np.inf
        self.total = ExactSum()

    def add(self, values: np.ndarray) -> np.ndarray:
        """Count float64[n]; gives back its finite values."""
        finite = finite_values(values)
        self.n_tried += values.size
        if finite.size:
            self.n_used += finite.size
            self.minimum, self.maximum = (
                min(self.minimum, float(finite.min())),
                max(self.maximum, float(finite.max())),
            )
            self.total.add(finite)
        return finite

    def merge(self, other: "Tally") -> None:
        """Count all that another tally has counted."""
        self.n_used, self.n_tried = self.n_used + other.n_used, self.n_tried + other.n_tried
        self.minimum, self.maximum = min(self.minimum, other.minimum), max(self.maximum, other.maximum)
        self.total.merge(other.total)

    @property
    def mean(self) -> float:
        """The mean, rounded once; needs a value."""
        return self.total.over(self.n_used)


class Spread:
    """Second pass: powers of the distances from the mean of a complete `Tally` with at least one value."""

    def __init__(self, tally: Tally):
        self.tally = tally
        # Distances in units of a power of two near the largest value: their fourth powers stay in range.
        self.exponent = frexp(max(abs(tally.minimum), abs(tally.maximum)))[1]
        self.middle = ldexp(tally.mean, -self.exponent)
        ends = (ldexp(end, -self.exponent) - self.middle for end in (tally.minimum, tally.maximum))
        self.unit = max(map(abs, ends)) or 1.0
        self.powers = tuple(ExactSum() for _ in range(4))

    def add(self, finite: np.ndarray) -> None:
        """Put in finite values float64[n]."""
        distance = (np.ldexp(finite, -self.exponent) - self.middle) / self.unit
        square = distance * distance
        for power, values in zip(self.powers, (distance, square, square * distance, square * square), strict=True):
            power.add(values)

    def merge(self, other: "Spread") -> None:
        """Put in all that another spread about the same tally holds."""
        for mine, theirs in zip(self.powers, other.powers, strict=True):
            mine.merge(theirs)

    @property
    def sd(self) -> float | None:
        """Standard deviation, n - 1 in its denominator; None for one value, 0 for equal ones.

        The sum of distances takes off what the rounding of the mean left (Chan, Golub & LeVeque, Amer. Statist. 37
        (1983), 242-247).
        """
        n = self.tally.n_used
        if n < 2:
            return None
        if self.tally.minimum == self.tally.maximum:
            return 0.0
        left = self.powers[0].over(n)
        variance = max(self.powers[1].over(n) - left * left, 0.0) * (n / (n - 1.0))
        return ldexp(sqrt(variance) * self.unit, self.exponent - 1) * 2.0  # inf, not an error, beyond float64

    @property
    def shape(self) -> Normality | None:
        """Skewness and kurtosis; None for fewer than 20 values, or (nearly) constant ones."""
        if self.unit <= 1e-13 or self.tally.minimum == self.tally.maximum:
            return None
        n = self.tally.n_used
        return normality_of(n, *(power.over(n) for power in self.powers[1:]))
