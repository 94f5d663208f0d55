"""Sums of float64 without any rounding, so that they are the same in every order and in every grouping.

A sum is kept as one whole number of units of 2**-1074, the smallest float64.  Blocks of values are cut into slices
of a few leading bits, so short that adding up a slice of a whole block rounds nothing: "error-free vector
transformation" of S. M. Rump, T. Ogita & S. Oishi, SIAM J. Sci. Comput. 31 (2008), 189-224, section 3.
"""

from math import frexp, ldexp

import numpy as np

UNIT_BITS = 1074
BLOCK = 1 << 16
HEADROOM = 17  # bits above the largest value of a block: those of its length, and one for the rounding of a slice
HUGE = 2.0**960  # from here on a slice's own headroom would overflow
HUGE_SHIFT = 64


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
