"""Summary of one metric over the cases: how many numbers there are, where they lie, how surely.

Every summary says n_used of n_tried: failed cases and NaN have no number, and are never dropped silently.
"""

from dataclasses import dataclass

import numpy as np

from mc_engine.statistics.normality import Normality, normality
from mc_engine.statistics.order_statistics import QUANTILES, Quantile, quantile


@dataclass(frozen=True)
class Summary:
    """Statistics of the finite values of a metric; what n_used is too small for is None (or no quantile)."""

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
        """All values that there are have the same bits."""
        return self.n_used > 0 and self.minimum == self.maximum

    def at(self, probability: float) -> Quantile | None:
        """The quantile for `probability`, or None without one."""
        return next((item for item in self.quantiles if item.probability == probability), None)


def summarize(values: np.ndarray, *, probabilities: tuple[float, ...] = QUANTILES, confidence: float = 0.90) -> Summary:
    """Summary of `values` (float64[n_tried]; NaN and infinite values count as tried, not as used).

    sd has n - 1 in its denominator and is None below two values.  Each quantile limit holds with a
    probability of 1 - (1 - confidence)/2.
    """
    values = np.asarray(values, dtype=np.float64)
    ordered = np.sort(values[np.isfinite(values)])
    n = int(ordered.size)
    if n == 0:
        return Summary(0, int(values.size), None, None, None, None, (), confidence, None)
    mean, sd = _moments(ordered)
    return Summary(
        n_used=n,
        n_tried=int(values.size),
        mean=mean,
        sd=sd,
        minimum=float(ordered[0]),
        maximum=float(ordered[-1]),
        quantiles=tuple(quantile(ordered, probability, confidence) for probability in probabilities),
        confidence=confidence,
        shape=normality(ordered),
    )


def _moments(ordered: np.ndarray) -> tuple[float, float | None]:
    """Mean and standard deviation of sorted finite values, safe from overflow; exact for a constant."""
    first, last = float(ordered[0]), float(ordered[-1])
    if first == last:
        return first, (0.0 if ordered.size > 1 else None)
    scale = max(abs(first), abs(last))
    scaled = ordered / scale
    return float(scaled.mean()) * scale, float(scaled.std(ddof=1)) * scale
