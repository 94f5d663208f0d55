"""Importance sampling by cross entropy: cases are drawn where failures are, and weighted by the ratio of the densities.

The density to draw from is found in levels: at each, the indicator of failure is smoothed to Phi(-margin / softness),
just so much that the next density can be estimated from the present cases, and a mixture is fitted to the weighted
cases. When the smoothed indicator is as good as the exact one, the mixture is frozen and fresh cases are drawn from it:
the estimate uses these alone, so it is unbiased, and its interval is that of a mean.

Papaioannou, Geyer & Straub, Improved cross entropy-based importance sampling with a flexible mixture model, Reliability
Engineering & System Safety 191 (2019) 106564.

Valid up to some hundred inputs.  If noise in flight decides the failures, few weights dominate the sum, and a remark
says so.  The interval does not cover a region of failures that no case came near.
"""

import math
from dataclasses import replace

import numpy as np
from scipy import stats
from scipy.special import ndtr

from mc_engine.sampling.streams import stream
from mc_engine.statistics.binomial import clopper_pearson
from mc_engine.statistics.direction_mixture import DirectionMixture, fit_mixture, log_normal_density
from mc_engine.statistics.rare_events import ALLOWANCE, FRESH, Flights, Level, Margin, RareEvent, plain_count

MOST_LEVELS = 25
_VARIATION = 1.5  # wanted coefficient of variation of the weights; Papaioannou et al. (2019), section 3
_HALT = 0.9  # a softness that shrinks by less does not come nearer
_PATIENCE = 4  # levels that come no nearer
_ENOUGH = 0.05  # effective share of failed cases that a density may then be fitted to
_FEWEST = 100  # effective failed cases that an interval of a mean may rest on


def cross_entropy(
    margin: Margin,
    n_inputs: int,
    *,
    cases_per_level: int = 10_000,
    seed: int = 0,
    confidence: float = 0.95,
    noise: bool = False,
) -> RareEvent:
    """Probability that margin(u) <= 0 for u of `n_inputs` independent standard normal numbers.

    margin : float64[n, n_inputs] -> float64[n];  NaN counts as failed.  cases_per_level : at least 500.
    noise : True: margin is called as margin(u, addresses), addresses int64[n]; see `rare_events`.
    Returns a RareEvent.
    """
    if cases_per_level < 500:
        raise ValueError(f"{cases_per_level} cases per level are too few; 500 are the least")
    # One input has no directions: a second one, which the margin does not see, gives it some.
    flights = Flights(lambda u, *addresses: margin(u[:, :n_inputs], *addresses), noise)
    rng = stream(seed, "cross entropy", 0)
    mixture, levels, ended = _approach(flights, cases_per_level, max(n_inputs, 2), rng)
    if mixture is None:
        return plain_count(flights, tuple(levels), confidence)
    return _estimate(flights, mixture, levels, ended, cases_per_level, rng, confidence, n_inputs)


def _approach(
    flights: Flights, n: int, n_inputs: int, rng: np.random.Generator
) -> tuple[DirectionMixture | None, list[Level], bool]:
    """(density fitted to the failures, levels, whether they were reached); no density where plain cases serve.

    That is where failures are frequent, and where nothing points to them.
    """
    mixture: DirectionMixture | None = None
    softness, levels, stalled = math.inf, list[Level](), 0
    for number in range(MOST_LEVELS):
        u, margin, log_weight = _level(flights, mixture, n, n_inputs, number, rng)
        weight = np.exp(log_weight - log_weight.max())
        failed = (margin <= 0.0).astype(float)
        target = weight * failed
        good = min(_variation(failed / _softened(margin, softness)), _variation(target)) <= _VARIATION
        if good or (stalled and _effective(target) >= _ENOUGH * n):
            levels.append(_level_record(margin, target, log_weight))
            return (fit_mixture(u, target, rng) if number else None), levels, True
        if stalled == _PATIENCE or np.ptp(np.clip(margin, -1e300, 1e300)) == 0.0:
            return mixture, levels, False
        before, softness = softness, _next_softness(weight, margin, softness)
        stalled = stalled + 1 if softness > _HALT * before else 0
        target = weight * _softened(margin, softness)
        levels.append(_level_record(margin, target, log_weight))
        mixture = fit_mixture(u, target, rng)
    return mixture, levels, False


def _level(
    flights: Flights, mixture: DirectionMixture | None, n: int, n_inputs: int, number: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(u, margin, logarithm of the weight) of n cases drawn from the mixture, plain ones without it."""
    u = rng.standard_normal((n, n_inputs)) if mixture is None else mixture.draw(rng, n)
    margin, _, _ = flights.fly(u, np.full(n, FRESH), number)
    log_weight = np.zeros(n) if mixture is None else log_normal_density(u) - mixture.log_density(u)
    return u, margin, log_weight


def _softened(margin: np.ndarray, softness: float) -> np.ndarray:
    """Phi(-margin / softness), and a hair above zero.  Papaioannou et al. (2019), eq. (13)."""
    if math.isinf(softness):
        return np.full(margin.size, 0.5)
    return np.maximum(ndtr(-np.maximum(margin, -1e300) / softness), 1e-300)


def _variation(values: np.ndarray) -> float:
    """Coefficient of variation."""
    mean = float(values.mean())
    return float(values.std()) / mean if mean > 0.0 else math.inf


def _next_softness(weight: np.ndarray, margin: np.ndarray, softness: float) -> float:
    """Where the softened weights vary as much as wanted, by bisection of its logarithm."""
    sizes = np.abs(margin[np.isfinite(margin) & (margin != 0.0)])
    largest = float(sizes.max(initial=1.0))
    high = math.log(min(softness, 100.0 * largest))
    low = math.log(max(float(sizes.min(initial=largest)), 1e-12 * largest)) - 5.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if _variation(weight * _softened(margin, math.exp(middle))) > _VARIATION:
            low = middle
        else:
            high = middle
    return math.exp(high)


def _level_record(margin: np.ndarray, target: np.ndarray, log_weight: np.ndarray) -> Level:
    """The level as its table shows it: the median margin of what the next density is fitted to, and its probability.

    At the last level, where that median has failed, the limit itself.
    """
    order = np.argsort(margin)
    total = np.cumsum(target[order])
    middle = max(float(margin[order][np.searchsorted(total, 0.5 * total[-1])]), 0.0)
    scale = math.exp(float(log_weight.max()))
    below = float((np.exp(log_weight - log_weight.max()) * (margin <= middle)).mean()) * scale
    return Level(middle, min(below, 1.0), 1, margin.size, _effective(target) / margin.size)


def _effective(weight: np.ndarray) -> float:
    """Effective sample size (sum w)^2 / sum w^2.  Kish, Survey Sampling (1965)."""
    square = float(weight @ weight)
    return float(weight.sum()) ** 2 / square if square > 0.0 else 0.0


def _estimate(
    flights: Flights,
    mixture: DirectionMixture,
    levels: list[Level],
    ended: bool,
    n: int,
    rng: np.random.Generator,
    confidence: float,
    n_inputs: int,
) -> RareEvent:
    """The estimate from new cases of the final mixture.  The interval is symmetric in the logarithm.

    If all of them passed, their weights give no bound; the plain cases of the first level then give it.
    """
    before = flights.n
    _, margin, log_weight = _level(flights, mixture, n, max(n_inputs, 2), len(levels), rng)
    share = np.exp(log_weight) / n
    failing = share * (margin <= 0.0)
    probability, effective = float(failing.sum()), _effective(failing)
    weight = np.concatenate([np.zeros(before), share])
    cases = flights.evaluated(weight)
    cases = replace(cases, u=cases.u[:, :n_inputs])
    remarks = _remarks(ended, effective, probability)
    if probability == 0.0:
        plain = cases.failed[cases.level == 0]
        upper = clopper_pearson(int(plain.sum()), plain.size, confidence)[1]
        return RareEvent("cross-entropy", 0.0, 0.0, upper, confidence, math.inf, tuple(levels), cases, tuple(remarks))
    error = _variation(failing) / math.sqrt(n - 1)
    reach = math.exp(ALLOWANCE * float(stats.norm.ppf(0.5 * (1.0 + confidence))) * error)
    levels = [*levels, Level(0.0, probability, 1, n, effective / n)]
    lower, upper = probability / reach, min(probability * reach, 1.0)
    return RareEvent(
        "cross-entropy", probability, lower, upper, confidence, error, tuple(levels), cases, tuple(remarks)
    )


def _remarks(ended: bool, effective: float, probability: float) -> list[str]:
    remarks = []
    if probability == 0.0:
        remarks.append(
            "No case of the last sample failed, so importance sampling demonstrates nothing: the upper bound is that "
            "of the plain cases of level 0 alone."
        )
    elif not ended:
        remarks.append(
            "Levels came to a halt before the failures, as where the noise of the flight decides them: the interval "
            "may be too narrow. Use subset simulation."
        )
    if probability > 0.0 and effective < _FEWEST:
        remarks.append(
            f"The estimate rests on as much as {effective:.0f} equal weights: the interval may be too narrow. Fly more "
            "cases per level, or use subset simulation."
        )
    return remarks
