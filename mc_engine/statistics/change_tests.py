"""Has a metric changed between two runs?  Tests of shift, of spread and of shares, with the size of each change.

Paired (the same case in both runs, a row each)
    shift    Wilcoxon's signed ranks of the differences
    spread   the same of the differences of the distances to each run's own median
    share    McNemar's exact test: cases that only one of the runs counts
Unpaired
    shift    van der Waerden's normal scores: like the rank sum, and never weaker than the t-test
    spread   Brown & Forsythe: analysis of variance of the distances to each run's own median
    share    Fisher's exact test

All of them hold for any shape of distribution; what they assume is that the cases are independent of each other, so
for `lhs`, `sobol` and `halton` they are on the safe side.  Sizes: difference of the means, ratio of the standard
deviations, difference of the shares, each with an interval of its own (not widened for the number of intervals).

Wilcoxon, Biometrics Bull. 1 (1945), 80-83; Grambsch, Biometrika 81 (1994), 527-534 (spread of pairs by distances);
van der Waerden, Indag. Math. 14 (1952), 453-458; Chernoff & Savage, Ann. Math. Stat. 29 (1958), 972-994 (its power);
Brown & Forsythe, J. Am. Stat. Assoc. 69 (1974), 364-367; McNemar, Psychometrika 12 (1947), 153-157.
"""

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from math import inf, isfinite, sqrt

import numpy as np
from scipy.stats import binomtest, fisher_exact, levene, norm, rankdata, wilcoxon

from mc_engine.statistics.moments import in_units, near_one

FEWEST = 10  # numbers in each run, or pairs, for a test of a metric
_EXACT = 50  # pairs up to which the exact distribution of signed ranks is taken
_ROUNDING = 1e-12  # of the largest number: spread below it is rounding


@dataclass(frozen=True)
class Estimate:
    """A number with its interval; NaN where it is not defined."""

    value: float
    lower: float
    upper: float


UNKNOWN = Estimate(np.nan, np.nan, np.nan)


@dataclass(frozen=True)
class MetricChange:
    """One metric in two runs.  n_used of n_tried cases have a number, by run; of a paired one, in both runs.

    differing : of a pair's two numbers, how many pairs differ by more than the tolerance; None if unpaired.
    mean, deviation : by run.  shift : mean of B less that of A, in the metric's unit.  ratio : standard deviation of
    B over that of A.  shift_p, spread_p : p-values, NaN where there is nothing to test; adjusted ones by Holm.
    """

    metric: str
    n_used: tuple[int, int]
    n_tried: tuple[int, int]
    differing: int | None
    mean: tuple[float, float]
    deviation: tuple[float, float]
    shift: Estimate
    ratio: Estimate
    shift_p: float
    spread_p: float
    shift_adjusted: float = np.nan
    spread_adjusted: float = np.nan

    @property
    def same(self) -> bool:
        """Whether there is nothing to tell: no pair differs, or the metric is the same constant in both runs."""
        if min(self.n_used) == 0 or self.differing == 0:
            return min(self.n_used) > 0
        return not isfinite(self.shift_p) and abs(self.shift.value) <= _ROUNDING * abs(self.mean[0])

    @property
    def shift_in_sigma(self) -> Estimate:
        """The shift over the standard deviation of run A; NaN where that is rounding."""
        sigma = self.deviation[0]
        if not sigma > _ROUNDING * max(abs(self.mean[0]), sigma):
            return UNKNOWN
        return Estimate(self.shift.value / sigma, self.shift.lower / sigma, self.shift.upper / sigma)


@dataclass(frozen=True)
class ShareChange:
    """A share of the cases in two runs: counted of tried, by run.  lost, gained : pairs counted in A only, B only."""

    name: str
    counted: tuple[int, int]
    tried: tuple[int, int]
    difference: Estimate
    p_value: float
    lost: int | None = None
    gained: int | None = None
    adjusted: float = np.nan


def metric_change(
    metric: str, a: np.ndarray, b: np.ndarray, *, paired: bool, confidence: float = 0.95, tolerance: float = 1e-6
) -> MetricChange:
    """The change of one metric.  a, b : float64[n], NaN for a case without a number; paired row by row if so said.

    tolerance : a pair whose numbers differ by no more than that many standard deviations of A counts as equal.
    """
    tried = (a.size, b.size)
    if paired:
        both = np.isfinite(a) & np.isfinite(b)
        a, b = a[both], b[both]
    else:
        a, b = a[np.isfinite(a)], b[np.isfinite(b)]
    used = (a.size, b.size)
    if min(used) == 0:
        return MetricChange(metric, used, tried, 0 if paired else None, _of(np.mean, a, b), _of(np.std, a, b),
                            UNKNOWN, UNKNOWN, np.nan, np.nan)  # fmt: skip
    both, exponent = near_one(np.concatenate([a, b]))
    a, b = both[: a.size], both[a.size :]
    scale = float(np.abs(both).max())
    unit = max(tolerance * float(a.std()), _ROUNDING * scale)
    differing = int(np.count_nonzero(np.abs(b - a) > unit)) if paired else None
    shift_p, spread_p = (_paired_p if paired else _unpaired_p)(a, b, unit)
    return MetricChange(
        metric,
        used,
        tried,
        differing,
        _of(lambda one: in_units(np.mean(one), exponent), a, b),
        _of(lambda one: in_units(_deviation(one), exponent), a, b),
        Estimate(*(float(in_units(one, exponent)) for one in astuple(_shift(a, b, paired, confidence)))),
        _ratio(a, b, paired, confidence, _ROUNDING * scale),
        shift_p,
        spread_p,
    )


def share_change(name: str, a: np.ndarray, b: np.ndarray, *, paired: bool, confidence: float = 0.95) -> ShareChange:
    """The change of a share.  a, b : bool[n], whether a case counts; paired row by row if so said."""
    counted, tried = (int(a.sum()), int(b.sum())), (a.size, b.size)
    if not a.size or not b.size:
        return ShareChange(name, counted, tried, UNKNOWN, np.nan)
    if not paired:
        table = [[counted[0], tried[0] - counted[0]], [counted[1], tried[1] - counted[1]]]
        p_value = float(fisher_exact(table).pvalue)
        return ShareChange(name, counted, tried, _newcombe(counted, tried, confidence), p_value)
    lost, gained = int(np.count_nonzero(a & ~b)), int(np.count_nonzero(b & ~a))
    p_value = float(binomtest(gained, lost + gained).pvalue) if lost + gained else 1.0
    return ShareChange(name, counted, tried, _paired_share(lost, gained, a.size, confidence), p_value, lost, gained)


def holm(p_values: Sequence[float]) -> np.ndarray:
    """Adjusted p-values: those at most alpha hold together with a chance of at most alpha of one being false.

    A NaN is no test and stays one.  Holm, Scand. J. Stat. 6 (1979), 65-70.
    """
    p = np.asarray(p_values, dtype=np.float64)
    adjusted = np.full(p.size, np.nan)
    tests = np.flatnonzero(np.isfinite(p))
    order = tests[np.argsort(p[tests], kind="stable")]
    weights = np.arange(order.size, 0, -1)
    adjusted[order] = np.minimum(np.maximum.accumulate(weights * p[order]), 1.0)
    return adjusted


def _of(function, a: np.ndarray, b: np.ndarray) -> tuple[float, float]:
    return tuple(float(function(one)) if one.size else np.nan for one in (a, b))  # type: ignore[return-value]


def _deviation(values: np.ndarray) -> float:
    return float(values.std(ddof=1)) if values.size > 1 else 0.0


def _distances(values: np.ndarray) -> np.ndarray:
    return np.abs(values - np.median(values))


def _paired_p(a: np.ndarray, b: np.ndarray, unit: float) -> tuple[float, float]:
    """p-values of shift and spread of pairs; what differs by no more than `unit` counts as equal."""
    if a.size < FEWEST or max(np.ptp(a), np.ptp(b), abs(a[0] - b[0])) <= unit:
        return np.nan, np.nan  # too few, or the same constant
    return _signed_ranks(b - a, unit), _signed_ranks(_distances(b) - _distances(a), unit)


def _signed_ranks(differences: np.ndarray, unit: float) -> float:
    moved = differences[np.abs(differences) > unit]
    if not moved.size:
        return 1.0
    magnitudes = np.abs(moved)
    untied = moved.size <= _EXACT and np.unique(magnitudes).size == moved.size
    if untied:
        return float(wilcoxon(moved, method="exact").pvalue)
    # The normal limit with the variance that ties leave; written out, since ties may be all of the differences.
    ranks = rankdata(magnitudes)
    z = float((np.sign(moved) * ranks).sum()) / sqrt(float((ranks**2).sum()))
    return float(2.0 * norm.sf(abs(z)))


def _unpaired_p(a: np.ndarray, b: np.ndarray, unit: float) -> tuple[float, float]:
    if min(a.size, b.size) < FEWEST:
        return np.nan, np.nan
    if max(np.ptp(a), np.ptp(b), abs(a[0] - b[0])) <= unit:
        return np.nan, np.nan  # the same constant
    shift = _normal_scores(a, b)
    if max(np.ptp(_distances(a)), np.ptp(_distances(b))) <= unit:
        return shift, np.nan if np.ptp(a) > unit else 1.0
    return shift, float(levene(a, b, center="median").pvalue)


def _normal_scores(a: np.ndarray, b: np.ndarray) -> float:
    """p-value of a difference of place, by the permutation variance of the scores, which ties are part of."""
    n = a.size + b.size
    scores = norm.ppf(rankdata(np.concatenate([a, b])) / (n + 1.0))
    scores -= scores.mean()
    variance = a.size * b.size / (n * (n - 1.0)) * float((scores**2).sum())
    return float(2.0 * norm.sf(abs(float(scores[: a.size].sum())) / sqrt(variance))) if variance > 0.0 else 1.0


def _shift(a: np.ndarray, b: np.ndarray, paired: bool, confidence: float) -> Estimate:
    value = float(b.mean() - a.mean())
    variance = _deviation(b - a) ** 2 / a.size if paired else _deviation(a) ** 2 / a.size + _deviation(b) ** 2 / b.size
    return _about(value, sqrt(variance), confidence) if min(a.size, b.size) > 1 else Estimate(value, -inf, inf)


def _ratio(a: np.ndarray, b: np.ndarray, paired: bool, confidence: float, rounding: float) -> Estimate:
    """Ratio of the standard deviations, its interval from the influence function of its logarithm.

    The deviation's influence is (z**2 - 1)/2 in standardised values z, whatever the distribution.
    """
    if min(a.size, b.size) < FEWEST or min(a.std(), b.std()) <= rounding:
        return UNKNOWN
    za, zb = (0.5 * ((one - one.mean()) / one.std()) ** 2 for one in (a, b))
    variance = (zb - za).var() / a.size if paired else za.var() / a.size + zb.var() / b.size
    log = _about(float(np.log(_deviation(b) / _deviation(a))), sqrt(variance), confidence)
    return Estimate(*(float(np.exp(one)) for one in (log.value, log.lower, log.upper)))


def _about(value: float, error: float, confidence: float) -> Estimate:
    reach = float(norm.ppf(0.5 + 0.5 * confidence)) * error
    return Estimate(value, value - reach, value + reach)


def _newcombe(counted: tuple[int, int], tried: tuple[int, int], confidence: float) -> Estimate:
    """Difference of two shares, from Wilson's limits of each: Newcombe, Stat. Med. 17 (1998), 873-890, method 10."""
    (a, b), (low_a, low_b), (high_a, high_b) = zip(
        *(_wilson(k, n, confidence) for k, n in zip(counted, tried, strict=True)), strict=True
    )
    value = b - a
    return Estimate(value, value - sqrt((b - low_b) ** 2 + (high_a - a) ** 2),
                    value + sqrt((high_b - b) ** 2 + (a - low_a) ** 2))  # fmt: skip


def _wilson(counted: int, tried: int, confidence: float) -> tuple[float, float, float]:
    """Share with its limits.  Wilson, J. Am. Stat. Assoc. 22 (1927), 209-212."""
    interval = binomtest(counted, tried).proportion_ci(confidence, method="wilson")
    return counted / tried, float(interval.low), float(interval.high)


def _paired_share(lost: int, gained: int, n: int, confidence: float) -> Estimate:
    """Difference of paired shares: Agresti & Min, Stat. Med. 24 (2005), 729-740, half a case added to each cell."""
    up, down, all_cases = gained + 0.5, lost + 0.5, n + 2.0
    error = sqrt(up + down - (up - down) ** 2 / all_cases) / all_cases
    around = _about((up - down) / all_cases, error, confidence)
    return Estimate((gained - lost) / n, max(around.lower, -1.0), min(around.upper, 1.0))


def finite(estimate: Estimate) -> bool:
    """Whether the number itself is defined."""
    return isfinite(estimate.value)
