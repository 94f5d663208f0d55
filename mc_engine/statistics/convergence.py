"""Running estimates: how a mean or quantile develops with the number of cases, and whether it has converged.

An estimate from all cases has converged if all of these conditions are met:
- its interval reaches no farther from it than a stated part of the metric's standard deviation (`CLOSE_MEAN`,
  `CLOSE_QUANTILE`), so that more cases cannot change it much;
- the first and the second half of the cases differ no more than by chance (`DRIFT`), so that it does not drift with the
  case number, as is true for independent cases;
- a mean is not that of a few extreme cases: the mean of |x - mean|³, in units of σ³, is at most 0.1 √n.  This ratio
  bounds the error of a normal interval (Berry and Esseen: Feller, An Introduction to Probability Theory, vol. 2, 2nd
  ed., XVI.5).  Cochran's rule of thumb, n > 25 γ₁² (Sampling Techniques, 3rd ed., 2.15), is 0.2 √n for one long tail,
  with which up to 14 % of the means of a Pareto law with the exponent 1.5, without a variance, had converged.

The cases are in the order of their numbers.  The first n cases of `lhs` are not a Latin hypercube of n cases; their
intervals are those of independent draws, which is conservative.
"""

from dataclasses import dataclass
from math import erfc, inf, sqrt

import numpy as np
from scipy.special import stdtrit

from mc_engine.statistics.binomial import hypergeometric_tails
from mc_engine.statistics.order_statistics import quantile

FEWEST = 20  # cases with a number
CLOSE_MEAN, CLOSE_QUANTILE = 0.05, 0.20  # of the standard deviation of the metric
DRIFT = 0.01  # p-value of the difference of the halves
HEAVY = 0.1  # larger `tails` are those of a few extreme cases
PLACES = 40
SMALLEST_SHARE = 0.005  # of the cases, at the first place


@dataclass(frozen=True)
class RunningEstimate:
    """An estimate from the first n cases with its two-sided interval, float64[k] each; NaN: too few for a limit.

    probability : of a quantile; None for the mean.  cases : int64[k], tried so far.  n_used of n_tried have a number.
    reach : larger distance of the last interval's ends from the estimate, in standard deviations; None if one is open.
    halves_p : probability of a difference at least as large as that of the two halves by chance alone.
    tails : for a mean, the mean |x - mean|³ over σ³ √n; 0 for a quantile, whose interval is exact.
    tied : for a quantile, whether most numbers from end to end of the interval equal others, as those of a flag do.
    """

    probability: float | None
    cases: np.ndarray
    estimate: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    n_used: int
    n_tried: int
    reach: float | None
    halves_p: float
    tails: float = 0.0
    tied: bool = False

    @property
    def close(self) -> float:
        """The largest `reach` of a converged estimate, in standard deviations."""
        return CLOSE_MEAN if self.probability is None else CLOSE_QUANTILE

    @property
    def settled(self) -> bool:
        """Whether the estimate has converged, as the module defines it."""
        near = self.reach is not None and self.reach <= self.close
        return near and self.halves_p >= DRIFT and self.tails <= HEAVY

    @property
    def cases_wanted(self) -> int | None:
        """Approximate number of cases with a sufficiently narrow interval: the width falls with their square root.

        None if the interval is narrow enough, has an open end, or narrows from one of few values to the next.
        """
        if self.reach is None or self.reach <= self.close or self.tied:
            return None
        return int(np.ceil(self.n_tried * (self.reach / self.close) ** 2))


def running_mean(values: np.ndarray, confidence: float = 0.90) -> RunningEstimate | None:
    """The running mean of float64[n_tried], in the order of the cases, with Student's interval.

    None for fewer than 20 numbers, or a constant.
    """
    cases, used = _sampled_counts(values)
    finite = _numbers(values)
    if finite is None:
        return None
    scale = float(np.abs(finite).max())
    middle = float(np.mean(finite / scale))
    off = finite / scale - middle
    sums, squares = np.concatenate([[0.0], off.cumsum()])[used], np.concatenate([[0.0], (off * off).cumsum()])[used]
    mean = sums / used
    deviation = np.sqrt(np.maximum(squares - used * mean * mean, 0.0) / (used - 1.0))
    half = stdtrit(used - 1.0, 0.5 * (1.0 + confidence)) * deviation / np.sqrt(used)
    first, second = np.array_split(off, 2)
    error = sqrt(first.var(ddof=1) / first.size + second.var(ddof=1) / second.size)
    # Two constant halves differ: else all cases were equal.
    apart = abs(float(first.mean() - second.mean())) / error if error > 0.0 else inf
    return RunningEstimate(
        None,
        cases,
        scale * (middle + mean),
        scale * (middle + mean - half),
        scale * (middle + mean + half),
        finite.size,
        values.size,
        float(half[-1] / deviation[-1]),
        erfc(apart / sqrt(2.0)),
        float(np.mean(np.abs(off / off.std()) ** 3) / sqrt(off.size)),
    )


def running_quantile(values: np.ndarray, probability: float, confidence: float = 0.90) -> RunningEstimate | None:
    """A running quantile of float64[n_tried] with its distribution-free interval; None as for the mean.

    The halves are compared by the number of cases in each above the quantile of all (Fisher's exact test).
    """
    cases, used = _sampled_counts(values)
    finite = _numbers(values)
    if finite is None:
        return None
    quantiles = [quantile(np.sort(finite[:n]), probability, confidence) for n in used]
    estimate, lower, upper = (
        np.array([getattr(interval, name) for interval in quantiles], dtype=np.float64)
        for name in ("value", "lower", "upper")
    )
    ends = np.array([estimate[-1] - lower[-1], upper[-1] - estimate[-1]])
    scale = float(np.abs(finite).max())
    reach = float(ends.max() / scale / (finite / scale).std(ddof=1)) if np.isfinite(ends).all() else None
    above = finite > estimate[-1]
    half = -(-finite.size // 2)
    p = min(1.0, 2.0 * min(hypergeometric_tails(finite.size, int(above.sum()), half, int(above[:half].sum()))))
    between = finite[(finite >= lower[-1]) & (finite <= upper[-1])]
    tied = bool(2 * np.unique(between).size < between.size)
    found = estimate, lower, upper, finite.size, values.size, reach, p
    return RunningEstimate(probability, cases, *found, tied=tied)


def _numbers(values: np.ndarray) -> np.ndarray | None:
    """The finite values in their order; None for fewer than 20, or equal ones."""
    finite = values[np.isfinite(values)]
    if finite.size < FEWEST or float(np.ptp(finite / np.abs(finite).max(initial=1e-300))) <= 1e-13:
        return None
    return finite


def _sampled_counts(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of cases at which the estimate is computed, evenly in their logarithm, and how many have a number."""
    numbers = np.isfinite(values).cumsum()
    if not numbers.size or numbers[-1] < FEWEST:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    first = max(int(np.searchsorted(numbers, FEWEST)) + 1, int(SMALLEST_SHARE * values.size))
    cases = np.unique(np.geomspace(first, values.size, PLACES).round().astype(np.int64))
    return cases, numbers[cases - 1]
