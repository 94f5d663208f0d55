"""Quantiles and their distribution-free limits, for independent cases from any distribution.

The interval between two order statistics contains the quantile with a binomial probability, for any distribution
(Wilks, Ann. Math. Statist. 12 (1941), 91-96; David & Nagaraja, Order Statistics, 3rd ed., 7.1).
A limit that needs more cases than there are is None.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, floor

import numpy as np
import scipy  # loads its packages when they are used

# Normal 3, 2 and 0 sigma, one-sided: the levels that dispersion analyses are quoted at.
QUANTILES = (0.00135, 0.02275, 0.5, 0.97725, 0.99865)


@dataclass(frozen=True)
class Quantile:
    """A quantile of a metric with its two-sided, distribution-free confidence interval.

    probability : float, 0.5 is the median
    value : float, the estimate
    lower : float or None, one-sided limit with confidence 1 - (1 - confidence)/2; None if the cases are too few for it
    upper : float or None, as `lower`

    >>> quantile(np.arange(100.0), 0.5)
    Quantile(probability=0.5, value=49.5, lower=41.0, upper=58.0)
    """

    probability: float
    value: float
    lower: float | None
    upper: float | None


def quantile_ranks(n: int, probability: float, confidence: float = 0.90) -> tuple[int | None, int | None]:
    """Ranks of the order statistics that bracket a quantile of any distribution.

    n : int, number of independent cases
    probability : float in (0, 1), 0.5 for the median
    confidence : float in (0, 1), two-sided

    Returns (lower, upper), ranks from 1 to n: the largest l with P(Binomial(n, p) <= l - 1) <= (1 - confidence)/2, and
    the smallest u with P(Binomial(n, p) <= u - 1) >= 1 - (1 - confidence)/2.  None where n is too small for one.

    Raises ValueError for a probability or a confidence outside of its range.

    Wilks, Ann. Math. Statist. 12 (1941), 91-96.

    >>> quantile_ranks(100, 0.5), quantile_ranks(100, 0.99865)
    ((42, 59), (99, None))
    """
    if not 0.0 < probability < 1.0:
        raise ValueError(f"probability {probability} does not lie between 0 and 1")
    if not 0.0 <= confidence < 1.0:  # 0: each limit alone has 50 %
        raise ValueError(f"confidence {confidence} does not lie between 0 and 1")

    def below(rank: int) -> float:
        return float(scipy.special.bdtr(rank - 1, n, probability))

    ranks, tail = range(1, n + 1), 0.5 * (1.0 - confidence)
    lower = bisect_right(ranks, tail, key=below)  # so many ranks are low enough
    upper = bisect_left(ranks, 1.0 - tail, key=below) + 1
    return lower or None, (upper if upper <= n else None)


def estimate_place(n: int, probability: float) -> float:
    """Position, between the ranks 1 ... n, of the estimate of a quantile from n > 0 values.

    The approximately median-unbiased one: Hyndman & Fan, Amer. Statist. 50 (1996), 361-365, type 8.
    """
    return min(max((n + 1.0 / 3.0) * probability + 1.0 / 3.0, 1.0), float(n))


def ranks_read(n: int, probability: float, confidence: float) -> set[int]:
    """The ranks (1 ... n) of the order statistics that `quantile` uses."""
    place = estimate_place(n, probability)
    return {floor(place), ceil(place), *(rank for rank in quantile_ranks(n, probability, confidence) if rank)}


def quantile(ordered: np.ndarray, probability: float, confidence: float = 0.90) -> Quantile:
    """A quantile with its distribution-free confidence interval.

    ordered : float64[n], sorted, n > 0
    probability : float in (0, 1)
    confidence : float in (0, 1), two-sided

    Returns a Quantile.  The estimate is approximately median-unbiased: Hyndman & Fan, Amer. Statist. 50 (1996),
    361-365, type 8.

    Raises IndexError without a value; ValueError if the values are not ascending or contain NaN, and for a probability
    or a confidence outside of its range.

    >>> round(quantile(np.arange(1000.0), 0.99).value, 2)
    989.66
    """
    ordered = np.asarray(ordered)
    if not np.all(ordered[:-1] <= ordered[1:]) or np.isnan(ordered[-1:]).any():
        raise ValueError("the values must ascend, without NaN; sort them, as by numpy.sort")
    return ranked_quantile(ordered.size, lambda rank: float(ordered[rank - 1]), probability, confidence)


def ranked_quantile(n: int, at: Callable[[int], float], probability: float, confidence: float) -> Quantile:
    """The `quantile` from single order statistics: `at` returns the value at a rank of `ranks_read`."""
    place = estimate_place(n, probability)
    below, above = at(floor(place)), at(ceil(place))
    part = place - floor(place)
    # Equal neighbours are returned as they are: a constant column must keep its bits.
    value = below if below == above else (1.0 - part) * below + part * above
    lower, upper = quantile_ranks(n, probability, confidence)
    return Quantile(probability, value, None if lower is None else at(lower), None if upper is None else at(upper))
