"""Estimates of small probabilities: their record, their interval, and the cases behind them.

A limit state in standard normal space: a vector u of independent standard normal numbers stands for the inputs of a
case, and `margin` is the distance inside the limit.  A case has failed where the margin is zero, negative or not a
number.  `subset_simulation` and `importance_sampling` estimate the probability of failure.

Noise in flight: if the margin depends on more than u, it is called as margin(u, noise), where `noise` addresses the
random draws of the case.  The estimate is then the probability over inputs and noise together, as for plain cases.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import stats

from mc_engine.statistics.binomial import clopper_pearson

Margin = Callable[..., np.ndarray]
# Intervals reach a fifth further than the scatter asks for: runs of subset simulation share their levels, and rare
# large weights of importance sampling have yet to be seen, neither of which the scatter shows.
ALLOWANCE = 1.2
FRESH = -1  # in place of a noise address: noise that no case has had yet


@dataclass(frozen=True)
class Level:
    """One level on the way to the failures.

    margin : all cases of the level are at or below it; for importance sampling, the median margin of the cases on which
        the next level is based.  probability : of a margin at or below it, mean over the runs.
    runs : number of independent runs that reached the level.  cases : flown for it.
    accepted : accepted fraction of the steps of its chains; for importance sampling, the effective fraction of its
        cases on which the next level is based.
    """

    margin: float
    probability: float
    runs: int
    cases: int
    accepted: float


@dataclass(frozen=True)
class Evaluated:
    """Every case flown, in order.

    u : float64[n, n_inputs];  margin : float64[n], -inf where it was not a number;  level, noise : int64[n]
    weight : float64[n], weight of the case.  The weights of the failed cases sum to the probability.  With chains all
        weights sum to 1, and represent plain sampling everywhere; with importance sampling cases far from failure are
        few, and their weights are of little use.
    """

    u: np.ndarray
    margin: np.ndarray
    level: np.ndarray
    noise: np.ndarray
    weight: np.ndarray

    @property
    def failed(self) -> np.ndarray:
        return self.margin <= 0.0


@dataclass(frozen=True)
class RareEvent:
    """The estimated probability of failure with its two-sided interval, and the data on which it is based.

    relative_error : standard error over estimate; infinite without a failed case.
    method : "subset", "cross-entropy", or "plain" where the margins gave no direction and plain cases are counted.
    remarks : what a reader must know before trusting the number, in sentences.
    """

    method: str
    probability: float
    lower: float
    upper: float
    confidence: float
    relative_error: float
    levels: tuple[Level, ...]
    cases: Evaluated
    remarks: tuple[str, ...]

    @property
    def n_cases(self) -> int:
        return self.cases.margin.size

    @property
    def plain_cases(self) -> float:
        """How many plain cases would have the same relative error: (1 - p) / (p error^2)."""
        if not 0.0 < self.relative_error < math.inf:
            return math.inf if self.relative_error else 1.0
        return (1.0 - self.probability) / (self.probability * self.relative_error**2)


class Flights:
    """Calls the margin function and keeps every case in the order flown."""

    def __init__(self, margin: Margin, noise: bool):
        self._margin, self._noisy = margin, noise
        self._kept: list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]] = []
        self.n = 0

    def fly(self, u: np.ndarray, noise: np.ndarray, level: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(margins, case numbers, noise addresses) of some cases; FRESH noise has the address of the case itself."""
        case = np.arange(self.n, self.n + len(u))
        noise = np.where(noise == FRESH, case, noise)
        margin = np.asarray(self._margin(u, noise) if self._noisy else self._margin(u), dtype=np.float64)
        if margin.shape != (len(u),):
            raise ValueError(f"the margin of {len(u)} cases has shape {margin.shape}, not ({len(u)},)")
        margin = np.where(np.isnan(margin), -np.inf, margin)
        self._kept.append((u, margin, np.full(len(u), level), noise))
        self.n += len(u)
        return margin, case, noise

    def evaluated(self, weight: np.ndarray) -> Evaluated:
        """All cases flown so far, with these weights."""
        u, margin, level, noise = (np.concatenate(parts) for parts in zip(*self._kept, strict=True))
        return Evaluated(u, margin, level, noise, weight)


def interval_of_mean(estimates: np.ndarray, confidence: float) -> tuple[float, float]:
    """Confidence interval (lower, upper) on the mean of the estimates of independent runs.

    Estimates by subset simulation are products and nearly log-normal: Cox's interval on the mean of a log-normal, with
    Student's t for the few runs, and ALLOWANCE.  If a run is zero, it is Student's interval on the mean, truncated at
    zero; its upper end is at least the largest estimate, because runs at zero hide the scatter of the estimates.
    Olsson, Journal of Statistics Education 13 (2005), no. 1, eq. (modified Cox).
    """
    n = estimates.size
    quantile = ALLOWANCE * float(stats.t.ppf(0.5 * (1.0 + confidence), n - 1))
    mean = float(estimates.mean())
    if estimates.min() <= 0.0:
        reach = quantile * float(estimates.std(ddof=1)) / math.sqrt(n)
        return max(0.0, mean - reach), max(mean + reach, float(estimates.max()))
    logs = np.log(estimates)
    variance = float(logs.var(ddof=1))
    centre = float(logs.mean()) + 0.5 * variance
    reach = quantile * math.sqrt(variance / n + 0.5 * variance**2 / (n - 1))
    return min(mean, math.exp(centre - reach)), max(mean, math.exp(centre + reach))


def plain_count(flights: Flights, levels: tuple[Level, ...], confidence: float) -> RareEvent:
    """The estimate from plain cases with the exact interval, for frequent failures or margins without a direction."""
    cases = flights.evaluated(np.full(flights.n, 1.0 / flights.n))
    failed = int(cases.failed.sum())
    lower, upper = clopper_pearson(failed, flights.n, confidence)
    if failed >= 0.05 * flights.n:
        remark = f"Failures are frequent: {failed} of {flights.n} plain cases are counted, with the exact interval."
    else:
        remark = (
            "The margin is the same for nearly all cases, so nothing points towards the failures: "
            f"{failed} of {flights.n} plain cases failed, and the interval is the exact one of that count. A metric "
            "that varies from case to case would lead further."
        )
    share = failed / flights.n
    error = math.sqrt((1.0 - share) / failed) if failed else math.inf
    return RareEvent("plain", share, lower, upper, confidence, error, levels, cases, (remark,))
