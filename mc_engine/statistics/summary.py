"""Summary of one metric over the cases: moments, extremes and quantiles with their confidence intervals.

Every summary states n_used of n_tried: failed cases and NaN have no number, and are never dropped silently.  Mean and
quantiles are exact, for values in memory (`summarize`) and for values read part by part (`streaming`).  No bit depends
on the order or the size of the parts.
"""

from dataclasses import dataclass

import numpy as np

from mc_engine.statistics.moments import Spread, Tally
from mc_engine.statistics.normality import Normality
from mc_engine.statistics.order_statistics import QUANTILES, Quantile, quantile

_ROUNDING = 1e-12  # of the size of two numbers: more than rounding adds up to over thousands of steps


def nearly_equal(low: float, high: float) -> bool:
    """Whether two numbers differ only by rounding."""
    low, high = float(low), float(high)  # whose difference may be infinite without a word
    return high == low or abs(high - low) <= _ROUNDING * max(abs(low), abs(high))


@dataclass(frozen=True)
class Summary:
    """Statistics of one metric; None, or an empty tuple, for those that need more than n_used cases.

    n_used : int, cases with a finite value
    n_tried : int, all cases
    mean : float or None
    sd : float or None, standard deviation with n - 1 in its denominator
    minimum : float or None
    maximum : float or None
    quantiles : tuple of Quantile, in the order asked for
    confidence : float, of the quantiles' intervals
    shape : Normality or None

    >>> summarize(np.array([1.0, 2.0, 3.0, np.nan])).sd
    1.0
    """

    n_used: int
    n_tried: int
    mean: float | None
    sd: float | None
    minimum: float | None
    maximum: float | None
    quantiles: tuple[Quantile, ...]
    confidence: float
    shape: Normality | None

    @property
    def constant(self) -> bool:
        """Whether all values differ only by rounding."""
        return self.minimum is not None and self.maximum is not None and nearly_equal(self.minimum, self.maximum)

    @property
    def spread(self) -> float | None:
        """The standard deviation, or None where it is only rounding."""
        return None if self.constant else self.sd

    def at(self, probability: float) -> Quantile | None:
        """The quantile for `probability`, or None without one."""
        return next((item for item in self.quantiles if item.probability == probability), None)


def summarize(values: np.ndarray, *, probabilities: tuple[float, ...] = QUANTILES, confidence: float = 0.90) -> Summary:
    """Moments and quantiles of a metric, bit-identical for any order of the cases.

    values : float64[n_tried]; NaN and infinite values count as tried, not as used
    probabilities : tuple of float in (0, 1), of the quantiles
    confidence : float in (0, 1), of the two-sided intervals on the quantiles

    Returns a Summary; without a finite value its numbers are None.

    Raises ValueError for a probability or a confidence outside of its range.

    >>> summary = summarize(np.arange(1001.0))
    >>> summary.mean, summary.at(0.5).value
    (500.0, 500.0)
    """
    tally = Tally()
    finite = tally.add(np.asarray(values, dtype=np.float64))
    if not finite.size:
        return without_number(tally, confidence)
    spread = Spread(tally)
    spread.add(finite)
    ordered = np.sort(finite)
    return summary_of(
        spread, tuple(quantile(ordered, probability, confidence) for probability in probabilities), confidence
    )


def without_number(tally: Tally, confidence: float) -> Summary:
    """The summary of cases of which none has a number."""
    return Summary(0, tally.n_tried, None, None, None, None, (), confidence, None)


def summary_of(spread: Spread, quantiles: tuple[Quantile, ...], confidence: float) -> Summary:
    """The summary from the results of two passes."""
    tally = spread.tally
    return Summary(
        n_used=tally.n_used,
        n_tried=tally.n_tried,
        mean=tally.mean,
        sd=spread.sd,
        minimum=tally.minimum,
        maximum=tally.maximum,
        quantiles=quantiles,
        confidence=confidence,
        shape=spread.shape,
    )
