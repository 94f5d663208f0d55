import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from mc_engine.sampling.distributions import (
    Beta,
    Discrete,
    Empirical,
    Exponential,
    Lognormal,
    Normal,
    Triangular,
    Truncated,
    Uniform,
    quantiles,
    share_outside,
    truncate,
)

# Ours, and the same distribution in scipy's words.
PAIRS = [
    (Normal(3.0, 2.0), stats.norm(3.0, 2.0)),
    (Uniform(-1.0, 4.0), stats.uniform(-1.0, 5.0)),
    (Triangular(1.0, 2.0, 5.0), stats.triang(0.25, loc=1.0, scale=4.0)),
    (Triangular(1.0, 1.0, 5.0), stats.triang(0.0, loc=1.0, scale=4.0)),
    (Triangular(1.0, 5.0, 5.0), stats.triang(1.0, loc=1.0, scale=4.0)),
    (Lognormal(2.0, 0.5), stats.lognorm(0.5, scale=2.0)),
    (Beta(2.0, 3.5, -1.0, 3.0), stats.beta(2.0, 3.5, loc=-1.0, scale=4.0)),
    (Exponential(2.0, 0.7), stats.expon(2.0, 0.7)),
    (Truncated(Normal(0.0, 1.0), -1.0, 2.0), stats.truncnorm(-1.0, 2.0)),
    (Truncated(Normal(0.0, 1.0), 6.0, 7.0), stats.truncnorm(6.0, 7.0)),
    (Truncated(Normal(0.0, 1.0), -7.0, -6.0), stats.truncnorm(-7.0, -6.0)),
    (Truncated(Exponential(0.0, 1.0), 0.0, 2.0), stats.truncexpon(2.0)),
]
U = np.concatenate([10.0 ** np.arange(-15, 0), np.linspace(0.01, 0.99, 99), 1.0 - 10.0 ** -np.arange(2.0, 13.0)])


@pytest.mark.parametrize(("ours", "theirs"), PAIRS)
def test_quantiles_are_those_of_scipy_into_the_tails(ours, theirs):
    assert quantiles(ours, U) == pytest.approx(theirs.ppf(U), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("ours", [pair[0] for pair in PAIRS])
def test_quantiles_rise_and_stay_in_the_support(ours):
    x = quantiles(ours, np.sort(np.concatenate([U, [0.0, 1.0]])))
    low, high = ours.support
    assert np.isfinite(x).all()
    assert (np.diff(x) >= 0.0).all()
    assert low <= x[0] < x[-1] <= high


def test_a_beta_draw_does_not_exceed_the_upper_end_by_its_rounding():
    """0.3 + (0.9 - 0.3) is 0.9000000000000001, which a model with the range up to 0.9 refused."""
    assert quantiles(Beta(2.0, 0.2, 0.3, 0.9), np.array([0.9, 1.0 - 1e-9, 1.0])).max() == 0.9


def test_no_draw_of_a_tail_that_is_cut_below_alone_is_infinite():
    """Even where the share below the cut and the largest number below 1 round to 1."""
    largest = [quantiles(Truncated(Normal(0.0, 1.0), cut, math.inf), np.array([1.0]))[0] for cut in np.linspace(-3, 0)]
    assert np.isfinite(largest).all()
    assert min(largest) > 8.0


@pytest.mark.parametrize("ours", [Normal(3.0, 2.0), Lognormal(2.0, 0.5), Exponential(2.0, 0.7)])
@given(u=st.floats(1e-12, 1.0 - 1e-9))
def test_the_share_below_a_quantile_is_the_one_asked_for(ours, u):
    x = float(quantiles(ours, np.array([u]))[0])
    assert ours.cdf(x) == pytest.approx(u, rel=1e-9, abs=1e-15)
    assert ours.sf(x) == pytest.approx(1.0 - u, rel=1e-6)


@pytest.mark.parametrize("ours", [Normal(3.0, 2.0), Lognormal(2.0, 0.5), Exponential(2.0, 0.7)])
def test_the_upper_tail_is_reached_from_its_own_side(ours):
    q = 10.0 ** -np.arange(1.0, 200.0, 20.0)
    assert [ours.sf(float(x)) for x in ours.isf(q)] == pytest.approx(q.tolist(), rel=1e-9)


def test_the_lognormal_of_given_moments_has_these_moments():
    ours = Lognormal.from_moments(10.0, 3.0)
    theirs = stats.lognorm(ours.log_sigma, scale=ours.median)
    assert (theirs.mean(), theirs.std()) == pytest.approx((10.0, 3.0), rel=1e-12)


def test_truncation_cuts_and_does_not_pile_up_on_the_bounds():
    cut = Truncated(Normal(0.0, 1.0), -0.5, 1.5)
    x = quantiles(cut, np.random.default_rng(1).random(20_000))
    assert ((x > -0.5) & (x < 1.5)).all()
    assert len(np.unique(x)) == 20_000
    assert stats.kstest(x, stats.truncnorm(-0.5, 1.5).cdf).pvalue > 0.001


def test_an_interval_twelve_sigma_out_still_has_its_shape():
    # There the normal falls like exp(-12 x): the median excess over the bound is ln 2 / 12, to a percent or so.
    excess = quantiles(Truncated(Normal(0.0, 1.0), 12.0, 20.0), np.array([0.5]))[0] - 12.0
    assert excess == pytest.approx(stats.truncnorm(12.0, 20.0).ppf(0.5) - 12.0, rel=1e-9)
    assert excess == pytest.approx(math.log(2.0) / 12.0, rel=0.02)


@given(lower=st.floats(-5.0, 4.0), width=st.floats(0.01, 5.0))
def test_the_share_between_two_values_is_accurate_on_either_side(lower, width):
    share = Normal(0.0, 1.0).share_between(lower, lower + width)
    mirrored = Normal(0.0, 1.0).share_between(-lower - width, -lower)
    assert share == pytest.approx(mirrored, rel=1e-9)


def test_the_share_outside_a_range_counts_both_tails():
    three_sigma = 0.0026997960632601866  # 2 (1 - Phi(3)), Abramowitz & Stegun, table 26.1: 0.00270
    assert share_outside(Normal(0.0, 1.0), -3.0, 3.0) == pytest.approx(three_sigma, rel=1e-12)


@pytest.mark.parametrize(
    ("low", "high"), [(-0.5, 1.0), (-3.0, 1.0), (-0.5, 9.0), (-3.0, 9.0), (2.5, 3.0), (-4.0, -2.0)]
)
def test_the_share_outside_a_range_of_a_truncated_one_is_that_of_scipy(low, high):
    law = stats.truncnorm(-1.0, 2.0)
    ours = share_outside(Truncated(Normal(0.0, 1.0), -1.0, 2.0), low, high)
    assert ours == pytest.approx(law.cdf(low) + law.sf(high), abs=1e-12)


def test_what_is_cut_twice_lies_between_the_inner_bounds_and_those_of_its_base():
    normal, waiting = Normal(0.0, 1.0), Exponential(3.0, 1.0)
    assert truncate(normal, -1.0, math.inf).support == (-1.0, math.inf)
    for outer, inner in (((-1.0, 2.0), (0.0, 5.0)), ((0.0, 5.0), (-1.0, 2.0))):
        assert truncate(truncate(normal, *outer), *inner) == Truncated(normal, 0.0, 2.0)
    assert truncate(waiting, 0.0, 4.0).support == (3.0, 4.0)
    assert truncate(waiting, 3.5, math.inf).support == (3.5, math.inf)


def test_spans_are_three_sigma_where_the_support_has_no_end():
    assert Normal(1.0, 2.0).span == (-5.0, 7.0)
    assert Lognormal(1.0, 0.1).span == pytest.approx((math.exp(-0.3), math.exp(0.3)))
    low, high = Exponential(0.0, 1.0).span
    assert (stats.expon.cdf(low), stats.expon.sf(high)) == pytest.approx((stats.norm.sf(3.0),) * 2, rel=1e-12)
    assert Truncated(Normal(0.0, 1.0), -1.0, math.inf).span == (-1.0, 3.0)
    tail = stats.truncnorm(4.0, np.inf)
    assert Truncated(Normal(0.0, 1.0), 4.0, math.inf).span == pytest.approx(
        (tail.ppf(stats.norm.sf(3.0)), tail.isf(stats.norm.sf(3.0))), rel=1e-9
    )
    assert Triangular(1.0, 2.0, 5.0).span == (1.0, 5.0)


def test_discrete_values_come_by_their_weights_and_in_the_order_written():
    ours = Discrete(("off", "clipped", "never", "on"), (1.0, 2.0, 0.0, 1.0))
    drawn = quantiles(ours, np.array([0.0, 0.249, 0.251, 0.749, 0.751, 1.0]))
    assert drawn.tolist() == ["off", "off", "clipped", "clipped", "on", "on"]


def test_a_value_begins_exactly_where_the_one_before_it_ends():
    ours = Discrete((1.0, 2.0, 3.0), (1.0, 0.0, 3.0))
    assert quantiles(ours, np.array([0.25, np.nextafter(0.25, 0.0)])).tolist() == [3.0, 1.0]


def test_empirical_draws_are_measured_values_each_as_often():
    ours = Empirical((1.0, 2.0, 2.5, 9.0))
    drawn = quantiles(ours, (np.arange(1000) + 0.5) / 1000)
    assert np.unique(drawn, return_counts=True)[1].tolist() == [250] * 4
    assert ours.within(2.0, 3.0) == Empirical((2.0, 2.5))
    assert ours.support == (1.0, 9.0)
