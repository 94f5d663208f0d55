"""Every interval that is printed holds the truth as often as it says, over simulated campaigns.

5000 campaigns each; the standard error of a coverage near 0.9 is 0.4 %, and 1.5 % are allowed for it and for what
lies between two whole numbers.  (Means, deviations and covariance ellipses are printed without a confidence.)
"""

from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from mc_engine.runner.stopping import schedule
from mc_engine.statistics import binomial, clopper_pearson, quantile_ranks, time_uniform, tolerance
from mc_engine.statistics.order_statistics import QUANTILES
from mc_engine.statistics.regions import density_regions
from mc_engine.statistics.tolerance import Judged

CAMPAIGNS = 5000
NEAR = (0.5, 4.0)  # limits that the margin to the nearest of two is told to
SIZES = [59, 300, 1000]
SLACK, SLACK_STOPPED = 0.015, 0.02
DISTRIBUTIONS = {
    "normal": stats.norm(3.0, 2.0),
    "one-sided and long": stats.lognorm(1.5),
    "bounded": stats.beta(0.5, 0.5),
    "whole numbers": stats.poisson(4.0),
}


def draws(key):
    return np.random.Generator(np.random.Philox(key=key))


def by_count(bound, counts, tried, confidence):
    """`bound` for an array of counts, each count computed once."""
    once = {int(count): bound(int(count), tried, confidence) for count in np.unique(counts)}
    return np.vectorize(once.__getitem__, otypes=[float])(counts)


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("share", [0.5, 0.95, 0.9973])
@pytest.mark.parametrize("confidence", [0.9, 0.95])
def test_limits_on_a_share(n, share, confidence):
    passed = draws(n).binomial(n, share, CAMPAIGNS)
    for limits in (binomial, time_uniform):
        lower = by_count(limits.lower_bound, passed, n, confidence)
        upper = by_count(limits.upper_bound, passed, n, confidence)
        assert np.mean(lower <= share) >= confidence - SLACK
        assert np.mean(upper >= share) >= confidence - SLACK
    both = np.array([clopper_pearson(int(count), n, confidence) for count in range(n + 1)])[passed]
    assert np.mean((both[:, 0] <= share) & (share <= both[:, 1])) >= confidence - SLACK


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("name", DISTRIBUTIONS)
def test_limits_of_quantiles(n, name):
    ordered = np.sort(DISTRIBUTIONS[name].rvs((CAMPAIGNS, n), random_state=draws(n)), axis=1)
    for probability in QUANTILES:
        truth = DISTRIBUTIONS[name].ppf(probability)
        lower, upper = quantile_ranks(n, probability, 0.9)
        above = np.ones(CAMPAIGNS, dtype=bool) if lower is None else ordered[:, lower - 1] <= truth
        below = np.ones(CAMPAIGNS, dtype=bool) if upper is None else ordered[:, upper - 1] >= truth
        assert above.mean() >= 0.95 - SLACK
        assert below.mean() >= 0.95 - SLACK
        assert (above & below).mean() >= 0.9 - SLACK


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize(
    ("name", "lost"), [("normal", 0.0), ("normal", 0.01), ("whole numbers", 0.0), ("bounded", 0.01)]
)
def test_tolerance_limits_enclose_their_share_of_all_cases_flown_and_failed(n, name, lost):
    draw, share, confidence = draws(n), 0.95, 0.95
    law = DISTRIBUTIONS[name]
    values = law.rvs((CAMPAIGNS, n), random_state=draw)
    usable = draw.random((CAMPAIGNS, n)) >= lost
    accepted = binomial.acceptance_number(n, share, confidence)
    held = {"above": [], "below": [], "both": []}
    for row, good in zip(values, usable, strict=True):
        ordered, failed = np.sort(row[good]), int(n - good.sum())
        high = tolerance.upper_rank(ordered.size, accepted, failed)
        low = tolerance.lower_rank(ordered.size, accepted, failed)
        inside = np.sort(Judged("x", *NEAR).of(row[good]))
        held["above"].append(np.inf if high is None else ordered[high - 1])
        held["below"].append(-np.inf if low is None else ordered[low - 1])
        margin = -np.inf if low is None else inside[low - 1]
        held["both"].append((NEAR[0] + margin, NEAR[1] - margin))
    inside = 1.0 - lost
    ends = np.array(held["both"])
    before = np.nextafter(ends[:, 0], -np.inf)  # the limit itself is inside
    # Where no limit could be given, none can be wrong.
    content = inside * (law.cdf(ends[:, 1]) - law.cdf(before))
    assert np.mean((content >= share) | ~np.isfinite(ends[:, 0])) >= confidence - SLACK
    high, low = np.array(held["above"]), np.array(held["below"])
    assert np.mean((inside * law.cdf(high) >= share) | ~np.isfinite(high)) >= confidence - SLACK
    assert np.mean((inside * law.sf(np.nextafter(low, -np.inf)) >= share) | ~np.isfinite(low)) >= confidence - SLACK


def stopped(share, confidence, true_share, draw, most=3000, campaigns=CAMPAIGNS):
    """(values, cases flown) of campaigns that fly until the requirement "below true_share" is decided."""
    requirement = SimpleNamespace(share=share, confidence=confidence)
    values = draw.random((campaigns, most), dtype=np.float32)
    passed = np.cumsum(values < true_share, axis=1, dtype=np.int32)
    flown = np.full(campaigns, most)
    going = np.ones(campaigns, dtype=bool)
    for look in schedule(SimpleNamespace(cases=most, requirements=[requirement])):
        counts = passed[:, look - 1]
        met = by_count(time_uniform.lower_bound, counts, look, confidence) >= share
        failed = by_count(time_uniform.upper_bound, counts, look, confidence) < share
        ends = going & (met | failed)
        flown[ends] = look
        going &= ~ends
    return values, passed[np.arange(campaigns), flown - 1], flown


@lru_cache
def at_the_end(limits, bound, passed, tried, confidence):
    return getattr(limits, bound)(passed, tried, confidence)


@pytest.mark.parametrize(("share", "confidence"), [(0.9973, 0.9), (0.95, 0.95)])
@pytest.mark.parametrize("part", [2.0, 1.0, 0.5])
def test_limits_hold_where_flying_ends_with_the_verdict(share, confidence, part):
    true_share = 1.0 - part * (1.0 - share)  # fails `part` times as often as it may
    values, passed, flown = stopped(share, confidence, true_share, draws(21))
    ends = list(zip(passed.tolist(), flown.tolist(), strict=True))
    lower = np.array([at_the_end(time_uniform, "lower_bound", k, n, confidence) for k, n in ends])
    upper = np.array([at_the_end(time_uniform, "upper_bound", k, n, confidence) for k, n in ends])
    assert np.mean(lower <= true_share) >= confidence - SLACK_STOPPED
    assert np.mean(upper >= true_share) >= confidence - SLACK_STOPPED
    wrong = lower >= share if true_share < share else upper < share
    assert np.mean(wrong) <= 1.0 - confidence + SLACK_STOPPED
    for probability in QUANTILES:  # of the metric that decided, limits for a fixed number of cases
        limits = {n: quantile_ranks(n, probability, 0.9) for n in np.unique(flown).tolist()}
        below = np.array([np.count_nonzero(row[:n] <= probability) for row, n in zip(values, flown, strict=True)])
        low = np.array([limits[n][0] or 0 for n in flown.tolist()])
        high = np.array([limits[n][1] or n + 1 for n in flown.tolist()])
        assert np.mean(below >= low) >= 0.95 - SLACK_STOPPED
        assert np.mean(below < high) >= 0.95 - SLACK_STOPPED


@pytest.mark.parametrize("true_share", [0.9, 0.93, 0.95, 0.97])
def test_limits_hold_where_a_run_without_a_verdict_is_extended_by_hand(true_share):
    share, confidence, draw = 0.95, 0.95, draws(31)
    first = draw.binomial(300, true_share, CAMPAIGNS)
    more = first + draw.binomial(700, true_share, CAMPAIGNS)
    lower = by_count(binomial.lower_bound, first, 300, confidence)
    upper = by_count(binomial.upper_bound, first, 300, confidence)
    undecided = (lower < share) & (upper >= share)
    lower[undecided] = by_count(time_uniform.lower_bound, more, 1000, confidence)[undecided]
    upper[undecided] = by_count(time_uniform.upper_bound, more, 1000, confidence)[undecided]
    assert np.mean(lower <= true_share) >= confidence - SLACK_STOPPED
    assert np.mean(upper >= true_share) >= confidence - SLACK_STOPPED


def regions_held(n, campaigns):
    """How often the distribution-free regions hold their content of a bent cloud."""
    draw = draws(n)

    def cloud(size):
        x = draw.normal(size=size)
        return np.column_stack([x, x * x + 0.3 * draw.normal(size=size)])

    population = cloud(20_000)
    held = {}
    for _ in range(campaigns):
        for region in density_regions(cloud(n), (0.5, 0.9), 0.9):
            inside = region.density.at(population) >= region.level
            held.setdefault(region.content, []).append(inside.mean() >= region.content)
    return {content: np.mean(found) for content, found in held.items()}


@pytest.mark.parametrize("n", [59, pytest.param(300, marks=pytest.mark.slow), 1000])
def test_regions_of_any_shape_hold_their_content(n):
    held = regions_held(n, 100)
    assert held
    assert min(held.values()) >= 0.9 - 3.0 * (0.9 * 0.1 / 100) ** 0.5
