"""Tests whether a metric changed between two runs: shift, spread and fractions of cases, with the size of each change.

Paired (the same case in both runs, a row each)
    shift    Wilcoxon's signed ranks of the differences
    spread   Student's t of the differences of the distances to each run's own median
    share    McNemar's exact test: cases that only one of the runs counts
Unpaired
    shift    van der Waerden's normal scores: like the rank sum, and never weaker than the t-test
    spread   Brown & Forsythe: analysis of variance of the distances to each run's own median
    share    Fisher's exact test

The tests of shifts and fractions hold for any distribution.  Those of spread are approximate.  They use means of the
distances, not their ranks: an error of the median shifts the ranks of long one-sided tails, but the mean only to second
order.  If one run is far smaller than the other, long tails still give too many false alarms: five times the level
0.003 for a log-normal with sigma 1.5 and 20 cases against 200.  Elsewhere they give fewer than stated.  All tests
assume independent cases, so for `lhs` and `sobol` they are conservative.

The size of a change is the shift, or the ratio of spreads, for which the test statistic is zero.  Its interval contains
all values that the test does not reject (Hodges & Lehmann, Ann. Math. Stat. 34 (1963), 598-611).  A difference of
fractions has its own interval.  Intervals are not widened for the number of comparisons.  For pairs, shifts are those
of the pairs that differ.  Of more than `MOST_CASES` numbers, or pairs that differ, that many are tested for a shift,
selected evenly.

Wilcoxon, Biometrics Bull. 1 (1945), 80-83; Wilcox, Psychometrika 54 (1989), 305-315 (spread of pairs by distances);
van der Waerden, Indag. Math. 14 (1952), 453-458; Chernoff & Savage, Ann. Math. Stat. 29 (1958), 972-994 (its power);
Brown & Forsythe, J. Am. Stat. Assoc. 69 (1974), 364-367; McNemar, Psychometrika 12 (1947), 153-157.
"""

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass
from math import floor, inf, isfinite, log, log10, sqrt

import numpy as np
from scipy.optimize import brentq
from scipy.stats import binomtest, fisher_exact, norm, rankdata, t

from mc_engine.statistics.moments import in_units, near_one
from mc_engine.statistics.picked_cases import picked_rows

FEWEST = 10  # numbers in each run, or pairs, for a test of a metric
MOST_CASES = 200_000
MOST_DECIMALS = 9  # of an estimate that is printed
_BESIDE = 1e-5  # of about the standard error: a change below it is none
_ROUNDING = 1e-12  # of the largest number: spread below it is rounding
_FARTHEST = 300.0  # logarithm of a ratio of spreads that the search goes to: squares of e**300 are in range


@dataclass(frozen=True)
class Estimate:
    """A number with its interval; NaN where it is not defined."""

    value: float
    lower: float
    upper: float

    @property
    def unbounded(self) -> bool:
        """Whether the interval has no end: the cases, or the pairs that differ, are too few for either one."""
        return self.lower == -inf and self.upper == inf

    @property
    def decimals(self) -> int:
        """Decimals that show the width of the interval in two digits, or the value in three without a width."""
        width = self.upper - self.lower
        scale = 10.0 * width if isfinite(width) and width > 0.0 else abs(self.value)
        return min(max(2 - floor(log10(scale)), 0), MOST_DECIMALS) if isfinite(scale) and scale > 0.0 else 0


UNKNOWN = Estimate(np.nan, np.nan, np.nan)


@dataclass(frozen=True)
class MetricChange:
    """One metric in two runs.  n_used of n_tried cases have a number, by run; if paired, in both runs.

    differing : number of pairs whose numbers differ by more than the tolerance; None if unpaired.
    mean, deviation : by run.  shift : from A to B, in the metric's unit.  ratio : spread of B over that of A, both as
    tested.  shift_p, spread_p : p-values, NaN where nothing can be tested; adjusted : by Holm.
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
    def effect(self) -> float:
        """Size of the change: the larger of the shift in sigma and the logarithm of the ratio."""
        unscaled = inf if abs(self.shift.value) > 0.0 else 0.0  # run A has no spread
        shift = abs(self.shift_in_sigma.value) if finite(self.shift_in_sigma) else unscaled
        return max(shift, abs(log(self.ratio.value)) if self.ratio.value > 0.0 else 0.0)

    @property
    def shift_in_sigma(self) -> Estimate:
        """The shift over the standard deviation of run A; NaN where that is rounding."""
        sigma = self.deviation[0]
        if not sigma > _ROUNDING * max(abs(self.mean[0]), sigma):
            return UNKNOWN
        return Estimate(self.shift.value / sigma, self.shift.lower / sigma, self.shift.upper / sigma)


@dataclass(frozen=True)
class ShareChange:
    """A fraction of cases in two runs: counted of tried, by run.  lost, gained : pairs counted in A only, B only."""

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
    """The change of one metric.  a, b : float64[n], NaN for a case without a number; with `paired`, row by row.

    tolerance : a pair whose numbers differ by no more than that many standard deviations of A counts as equal.
    """
    tried = (a.size, b.size)
    if paired:
        both = np.isfinite(a) & np.isfinite(b)
        a, b = a[both], b[both]
    else:
        a, b = a[np.isfinite(a)], b[np.isfinite(b)]
    used = (a.size, b.size)
    both, exponent = near_one(np.concatenate([a, b]))
    a, b = both[: a.size], both[a.size :]

    def back(pair: Sequence[float]) -> tuple[float, float]:
        return float(in_units(float(pair[0]), exponent)), float(in_units(float(pair[1]), exponent))

    mean, deviation = _by_run(np.mean, a, b), _by_run(_deviation, a, b)
    by_run = back(mean), back(deviation)
    if min(used) == 0:
        return MetricChange(metric, used, tried, 0 if paired else None, *by_run, UNKNOWN, UNKNOWN, np.nan, np.nan)
    scale = float(np.abs(both).max())
    unit = max(tolerance * float(a.std()), _ROUNDING * scale)
    moved = (b - a)[np.abs(b - a) > unit] if paired else None
    differing = None if moved is None else moved.size
    described = metric, used, tried, differing, *by_run
    if min(used) < FEWEST:
        shift = Estimate(float(in_units(mean[1] - mean[0], exponent)), -inf, inf)
        return MetricChange(*described, shift, UNKNOWN, np.nan, np.nan)
    z = float(norm.ppf(0.5 + 0.5 * confidence))
    if max(np.ptp(a), np.ptp(b), abs(a[0] - b[0])) <= unit:  # the same constant
        same = float(in_units(float(np.median(b) - np.median(a)), exponent))
        return MetricChange(*described, Estimate(same, same, same), UNKNOWN, np.nan, np.nan)
    if moved is None:
        shift, shift_p = _shift(_picked(a), _picked(b), unit, z)
    else:
        shift, shift_p = _shift_of_pairs(_picked(moved), unit, z)
    ratio, spread_p = _spread_ratio(a, b, paired, unit, z)
    if min(deviation) <= _ROUNDING * scale:
        ratio = UNKNOWN
    shift = Estimate(*(float(in_units(end, exponent)) for end in astuple(shift)))
    return MetricChange(*described, shift, ratio, shift_p, spread_p)


def share_change(name: str, a: np.ndarray, b: np.ndarray, *, paired: bool, confidence: float = 0.95) -> ShareChange:
    """The change of a fraction of cases.  a, b : bool[n], whether a case counts; with `paired`, row by row."""
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
    """Adjusted p-values: the probability of any false alarm among those at most alpha is at most alpha.

    NaN, for which there was no test, stays NaN.  Holm, Scand. J. Stat. 6 (1979), 65-70.
    """
    p = np.asarray(p_values, dtype=np.float64)
    adjusted = np.full(p.size, np.nan)
    tests = np.flatnonzero(np.isfinite(p))
    order = tests[np.argsort(p[tests], kind="stable")]
    weights = np.arange(order.size, 0, -1)
    adjusted[order] = np.minimum(np.maximum.accumulate(weights * p[order]), 1.0)
    return adjusted


def _by_run(function, a: np.ndarray, b: np.ndarray) -> tuple[float, float]:
    return tuple(float(function(values)) if values.size else np.nan for values in (a, b))  # type: ignore[return-value]


def _deviation(values: np.ndarray) -> float:
    return float(values.std(ddof=1)) if values.size > 1 else 0.0


def _picked(values: np.ndarray) -> np.ndarray:
    return values[picked_rows(values.size, MOST_CASES)]


def _shift(a: np.ndarray, b: np.ndarray, unit: float, z: float) -> tuple[Estimate, float]:
    """The shift of independent samples with its interval, and the p-value of none."""
    start, step = float(np.median(b) - np.median(a)), float(a.std() + b.std()) / sqrt(min(a.size, b.size)) + unit
    return _inverted(lambda shift: _normal_scores(a, b - shift), start, step, z)


def _shift_of_pairs(moved: np.ndarray, unit: float, z: float) -> tuple[Estimate, float]:
    """The shift from the differences of the pairs that differ.  They may be few of very many cases."""
    if not moved.size:
        return Estimate(0.0, 0.0, 0.0), 1.0
    step = float(moved.std()) / sqrt(moved.size) + unit
    return _inverted(lambda shift: _signed_ranks(moved - shift), float(np.median(moved)), step, z)


def _spread_ratio(a: np.ndarray, b: np.ndarray, paired: bool, unit: float, z: float) -> tuple[Estimate, float]:
    """The ratio of the distances to each run's own median with its interval, and the p-value of 1."""
    before, other = (np.abs(values - np.median(values)) for values in (a, b))
    if max(np.ptp(before), np.ptp(other)) <= unit:
        return UNKNOWN, np.nan if np.ptp(a) > unit else 1.0
    if paired:
        other = np.where(np.abs(other - before) > unit, other, before)
        if np.array_equal(before, other):
            return Estimate(1.0, 1.0, 1.0), 1.0
    mean_score = _paired_mean_score(before, other) if paired else _mean_score(before, other)
    if min(before.mean(), other.mean()) <= unit:
        return UNKNOWN, _p_value(mean_score(1.0))

    def score(ratio: float) -> float:
        return mean_score(float(np.exp(-np.clip(ratio, -_FARTHEST, _FARTHEST))))

    start = float(np.log(other.mean() / before.mean()))
    logarithm, p_value = _inverted(score, start, 1.0 / sqrt(min(before.size, other.size)), z)
    return Estimate(*(float(np.exp(end)) for end in astuple(logarithm))), p_value


def _inverted(score: Callable[[float], float], start: float, step: float, z: float) -> tuple[Estimate, float]:
    """Where a score that falls with the change is 0, z and -z, and the p-value of no change, at 0."""
    ends = (_root(score, level, start, step) for level in (0.0, z, -z))
    # Where ties make the score jump at no change, the search ends beside it.
    value, lower, upper = (end if abs(end) > _BESIDE * step else 0.0 for end in ends)
    return Estimate(value, min(lower, value), max(upper, value)), _p_value(score(0.0))


def _root(score: Callable[[float], float], level: float, start: float, step: float) -> float:
    """The change at which a falling score passes a level; infinite for a level that it never comes to."""
    way = 1.0 if score(start) > level else -1.0
    near = far = start
    for _ in range(60):
        near, far, step = far, far + way * step, 2.0 * step
        if way * (score(far) - level) <= 0.0:
            return float(brentq(lambda at: score(at) - level, near, far, xtol=1e-7 * abs(far - near), rtol=1e-12))
    return way * inf


def _p_value(score: float) -> float:
    return float(2.0 * norm.sf(abs(score)))


def _signed_ranks(differences: np.ndarray) -> float:
    """Wilcoxon's statistic over its standard deviation, with the variance that ties leave."""
    ranks = rankdata(np.abs(differences))
    return float((np.sign(differences) * ranks).sum()) / sqrt(float((ranks**2).sum()))


def _normal_scores(a: np.ndarray, b: np.ndarray) -> float:
    """van der Waerden's statistic of b over its standard deviation, by the permutation variance, with its ties."""
    n = a.size + b.size
    scores = norm.ppf(rankdata(np.concatenate([a, b])) / (n + 1.0))
    scores -= scores.mean()
    variance = a.size * b.size / (n * (n - 1.0)) * float((scores**2).sum())
    return float(scores[a.size :].sum()) / sqrt(variance) if variance > 0.0 else 0.0


def _mean_score(a: np.ndarray, b: np.ndarray) -> Callable[[float], float]:
    """The normal deviate of Student's t between the means of b times a factor, and a: Brown and Forsythe's, of
    distances.  From the moments, so that all of very many numbers are used.
    """
    freedom = a.size + b.size - 2
    (mean_a, mean_b), (square_a, square_b) = (a.mean(), b.mean()), (a.var() * a.size, b.var() * b.size)
    sizes = 1.0 / a.size + 1.0 / b.size

    def score(factor: float) -> float:
        pooled = (square_a + factor * factor * square_b) / freedom * sizes
        return _normal_deviate(float(factor * mean_b - mean_a), float(pooled), freedom)

    return score


def _paired_mean_score(a: np.ndarray, b: np.ndarray) -> Callable[[float], float]:
    """The same of pairs: Student's t of their differences, factor (b - a) + (factor - 1) a, which is safe from
    cancellation where few pairs differ.
    """
    difference, freedom = b - a, a.size - 1
    means = np.array([difference.mean(), a.mean()])
    products = np.cov(difference, a) / a.size

    def score(factor: float) -> float:
        weights = np.array([factor, factor - 1.0])
        return _normal_deviate(float(weights @ means), float(weights @ products @ weights), freedom)

    return score


def _normal_deviate(difference: float, variance: float, freedom: int) -> float:
    """As improbable as Student's t of a difference of means with this variance."""
    if variance <= 0.0:
        return float(np.sign(difference)) * 40.0
    statistic = difference / sqrt(variance)
    return float(np.sign(statistic) * norm.isf(max(t.sf(abs(statistic), freedom), 1e-300)))


def _newcombe(counted: tuple[int, int], tried: tuple[int, int], confidence: float) -> Estimate:
    """Difference of two shares, from Wilson's limits of each: Newcombe, Stat. Med. 17 (1998), 873-890, method 10."""
    (a, low_a, high_a), (b, low_b, high_b) = (_wilson(k, n, confidence) for k, n in zip(counted, tried, strict=True))
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
    middle, reach = (up - down) / all_cases, float(norm.ppf(0.5 + 0.5 * confidence)) * error
    return Estimate((gained - lost) / n, max(middle - reach, -1.0), min(middle + reach, 1.0))


def finite(estimate: Estimate) -> bool:
    """Whether the estimate is defined."""
    return isfinite(estimate.value)


def hidden_by_ties(estimate: Estimate, unchanged: float, significant: bool) -> bool:
    """Whether ties are so frequent that the estimated size of a significant change, with its interval, is no change."""
    return significant and all(end == unchanged for end in astuple(estimate))
