"""Moments of a metric in two passes, bit-identical for any order of the cases and any division into parts.

First pass (`Tally`): number, smallest, largest and exact sum.  Second pass (`Spread`): exact sums of the powers of
the distances from the mean; each power is rounded on its own, which depends on the case alone.
"""

from math import frexp, isfinite, ldexp, sqrt

import numpy as np

from mc_engine.statistics.normality import Normality, normality_of

MANTISSA_BITS, HALF_BITS = 53, 27  # of a float64; of the lower half of its mantissa
UNIT_BITS = 1073 + MANTISSA_BITS  # a float64 of the least exponent, -1073, is whole in units of 2**-UNIT_BITS
MOST_VARIANCE = 0.95  # of a variance
BLOCK = 1 << 16  # values at a time: sums of as many half mantissas are exact


def finite_values(values: np.ndarray) -> np.ndarray:
    """The finite ones of float64[n], with -0.0 as 0.0, which it equals."""
    finite = np.isfinite(values)
    return (values if finite.all() else values[finite]) + 0.0


def number_or_none(value: float | None) -> float | None:
    """The value; None for NaN and infinity."""
    return float(value) if value is not None and isfinite(value) else None


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


def varying_rows(centred: np.ndarray) -> int:
    """Number of rows float64[n, k], mean 0, n > 0, that make up most (`MOST_VARIANCE`) of the variance.

    Of a flag that one case of a thousand has, or of a metric with rare large values, these are the few rows with such a
    case; intervals of effects from so few hold far too seldom.
    """
    largest = np.sort((centred**2).sum(axis=1))[::-1].cumsum()
    return int(np.searchsorted(largest, MOST_VARIANCE * largest[-1])) + 1


class ExactSum:
    """The sum of all finite values put in, without rounding; `units` is its exact value times 2**UNIT_BITS."""

    def __init__(self) -> None:
        self.units = 0

    def add(self, values: np.ndarray) -> None:
        """Put in float64[n], all finite.  Values of one exponent are added up as whole numbers, their mantissas."""
        for first in range(0, values.size, BLOCK):
            mantissa, exponent = np.frexp(values[first : first + BLOCK])
            whole = np.ldexp(mantissa, MANTISSA_BITS).astype(np.int64)
            least = int(exponent.min())
            high = np.bincount(exponent - least, whole >> HALF_BITS)
            low = np.bincount(exponent - least, whole & ((1 << HALF_BITS) - 1))
            for k in np.flatnonzero((high != 0.0) | (low != 0.0)).tolist():
                total = (int(high[k]) << HALF_BITS) + int(low[k])
                self.units += total << (least + k + UNIT_BITS - MANTISSA_BITS)

    def over(self, count: int) -> float:
        """The sum divided by a whole number, rounded once; OverflowError beyond float64."""
        return self.units / (count << UNIT_BITS)  # Python divides whole numbers with one rounding


class Tally:
    """First pass: number, smallest, largest and exact sum.  n_used : finite values of n_tried."""

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

    @property
    def sd(self) -> float | None:
        """Standard deviation, n - 1 in its denominator; None for one value, 0 for equal ones.

        The sum of distances corrects the rounding of the mean (Chan, Golub & LeVeque, Amer. Statist. 37 (1983),
        242-247).
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
