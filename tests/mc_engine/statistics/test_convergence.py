"""Running estimates and whether they have settled."""

import numpy as np
import pytest
from scipy import stats

from mc_engine.statistics.convergence import running_mean, running_quantile


def draws(n, key=1):
    return np.random.Generator(np.random.Philox(key=key)).normal(1e6, 2.0, n)


def test_the_running_mean_is_that_of_the_first_cases_with_students_interval():
    values = draws(3000)
    values[[3, 700]] = np.nan
    found = running_mean(values, 0.90)
    assert (found.n_used, found.n_tried) == (2998, 3000)
    assert found.cases[0] == 21  # with the twentieth number
    assert found.cases[-1] == 3000
    for place in (0, 10, -1):
        part = values[: found.cases[place]]
        part = part[np.isfinite(part)]
        low, high = stats.t.interval(0.90, part.size - 1, part.mean(), stats.sem(part))
        assert found.estimate[place] == pytest.approx(part.mean(), abs=1e-8)
        assert (found.lower[place], found.upper[place]) == pytest.approx((low, high), abs=1e-8)
    assert found.reach == pytest.approx(0.5 * (high - low) / part.std(ddof=1), rel=1e-6)
    first, second = part[:1499], part[1499:]
    apart = (first.mean() - second.mean()) / np.hypot(stats.sem(first), stats.sem(second))
    assert found.halves_p == pytest.approx(2.0 * stats.norm.sf(abs(apart)), rel=1e-6)
    assert found.tails == pytest.approx(np.mean(np.abs(stats.zscore(part)) ** 3) / np.sqrt(2998), rel=1e-6)


def test_the_running_quantile_is_that_of_the_first_cases_with_wilks_interval():
    """At each place numpy's quantile and ranks from binomial sums; the halves by Fisher's exact test, either side."""
    values, share = draws(3000), 0.9
    found = running_quantile(values, share, 0.95)
    for place in (10, -1):
        part = np.sort(values[: found.cases[place]])
        below = stats.binom.cdf(np.arange(part.size), part.size, share)  # P(B <= rank - 1)
        ends = part[np.flatnonzero(below <= 0.025).max()], part[np.flatnonzero(below >= 0.975).min()]
        assert found.estimate[place] == pytest.approx(np.quantile(part, share, method="median_unbiased"), abs=1e-8)
        assert (found.lower[place], found.upper[place]) == ends
    estimate = found.estimate[-1]
    assert found.reach == pytest.approx(max(estimate - ends[0], ends[1] - estimate) / values.std(ddof=1), rel=1e-9)
    above = values > estimate
    law = stats.hypergeom(values.size, above.sum(), 1500)
    first = above[:1500].sum()
    assert found.halves_p == pytest.approx(min(1.0, 2.0 * min(law.cdf(first), law.sf(first - 1))), rel=1e-9)


def test_an_interval_close_enough_and_equal_halves_have_settled():
    assert not running_mean(draws(800)).settled
    assert running_mean(draws(800)).cases_wanted == pytest.approx(1.645**2 / 0.05**2, rel=0.03)
    assert running_mean(draws(1200)).settled
    assert running_mean(draws(1200)).cases_wanted is None
    assert not running_quantile(draws(1200), 0.99865).settled
    assert running_quantile(draws(20_000), 0.99865).settled
    assert running_quantile(draws(200), 0.99865).reach is None


@pytest.mark.parametrize("estimate", [running_mean, lambda values: running_quantile(values, 0.97725)])
def test_cases_that_drift_have_not_settled(estimate):
    values = draws(20_000)
    assert estimate(values).settled
    found = estimate(values + np.linspace(0.0, 2.0, values.size))
    assert found.halves_p < 1e-6
    assert not found.settled


@pytest.mark.parametrize("estimate", [running_mean, lambda values: running_quantile(values, 0.97725)])
def test_independent_cases_are_said_to_drift_no_more_often_than_stated(estimate):
    # stated 1 %; three sigma of 400 trials are 1.5 %
    alarms = [estimate(draws(400, key)).halves_p < 0.01 for key in range(400)]
    assert np.mean(alarms) < 0.01 + 0.015


def test_halves_that_are_constant_and_differ_have_not_settled():
    """A switch that turns after half of the cases: no scatter in either half, and no chance that they are alike."""
    values = np.repeat([0.0, 1.0], 5000)
    for estimate in (running_mean(values), running_quantile(values, 0.5)):
        assert estimate.halves_p < 1e-12
        assert not estimate.settled


@pytest.mark.parametrize("law", [stats.cauchy(), stats.pareto(1.5), stats.lognorm(2.0)])
def test_a_mean_that_a_few_extreme_cases_dominate_has_not_settled(law):
    draw = np.random.Generator(np.random.Philox(key=5))
    for n in (2000, 20_000):
        assert np.mean([running_mean(law.rvs(n, random_state=draw)).settled for _ in range(100)]) < 0.01


def test_a_mean_of_moderately_skewed_cases_settles():
    draw = np.random.Generator(np.random.Philox(key=5))
    assert all(running_mean(1e9 + 1e-3 * draw.exponential(size=2000)).reach < 0.05 for _ in range(20))
    assert np.mean([running_mean(draw.exponential(size=2000)).settled for _ in range(100)]) > 0.95


def test_a_percentile_of_few_values_is_not_said_to_need_a_number_of_cases():
    """Its bounds do not narrow with the square root: of a flag, 21 million cases were said to be needed."""
    flag = running_quantile((np.arange(3000) % 375 == 7).astype(float), 0.9973)
    assert (flag.lower[-1], flag.upper[-1]) == (0.0, 1.0)
    assert flag.reach > 0.2
    assert flag.cases_wanted is None
    smooth = running_quantile(draws(3000), 0.9973)
    assert smooth.reach > 0.2
    assert smooth.cases_wanted > 3000
