"""Distribution-free limits of quantiles."""

import numpy as np
import pytest
from scipy.stats import binom

from mc_engine.statistics import QUANTILES, quantile, quantile_ranks, summarize


def slow_ranks(n, probability, confidence):
    """The ranks by trying all of them."""
    tail = 0.5 * (1.0 - confidence)
    below = binom.cdf(np.arange(0, n + 1), n, probability)  # P(B <= r - 1) for r = 1 ...
    lower = [rank for rank in range(1, n + 1) if below[rank - 1] <= tail]
    upper = [rank for rank in range(1, n + 1) if below[rank - 1] >= 1.0 - tail]
    return (max(lower) if lower else None), (min(upper) if upper else None)


@pytest.mark.parametrize("n", [1, 2, 10, 58, 59, 300, 2000])
@pytest.mark.parametrize("probability", QUANTILES)
def test_ranks_are_those_that_a_search_through_all_of_them_finds(n, probability):
    assert quantile_ranks(n, probability, 0.9) == slow_ranks(n, probability, 0.9)


# Wilks, one-sided: smallest n for which the largest value bounds the quantile (0.95 with 95 %, and so on).
@pytest.mark.parametrize(("n", "share", "one_sided"), [(59, 0.95, 0.95), (299, 0.99, 0.95), (852, 0.9973, 0.90)])
def test_the_largest_value_becomes_an_upper_limit_at_wilks_sample_size(n, share, one_sided):
    confidence = 2.0 * one_sided - 1.0
    assert quantile_ranks(n, share, confidence)[1] == n
    assert quantile_ranks(n - 1, share, confidence)[1] is None


def test_a_limit_that_needs_more_cases_is_none_and_not_a_guess():
    limits = quantile(np.sort(np.arange(20.0)), 0.99865)
    assert limits.upper is None
    assert limits.lower is not None


@pytest.mark.parametrize("probability", QUANTILES)
def test_the_estimate_lies_between_its_limits_and_agrees_with_numpy(probability):
    values = np.sort(np.random.Generator(np.random.Philox(key=5)).normal(size=5000))
    limits = quantile(values, probability)
    assert limits.lower <= limits.value <= limits.upper
    assert limits.value == pytest.approx(np.quantile(values, probability, method="median_unbiased"), abs=1e-12)


@pytest.mark.parametrize("values", [[3.0, 1.0, 2.0], [1.0, np.nan], [np.nan]])
def test_values_in_no_order_have_no_quantile(values):
    with pytest.raises(ValueError, match="the values must ascend, without NaN"):
        quantile(values, 0.5)


WRONG = [(99.0, 0.9), (0.99, 90.0), (-0.1, 0.9), (1.0, 0.9), (0.99, 1.0)]


@pytest.mark.parametrize(("probability", "confidence"), WRONG)
def test_a_probability_or_confidence_in_percent_is_refused(probability, confidence):
    values = np.arange(1000.0)
    for asked in (
        lambda: quantile(values, probability, confidence),
        lambda: quantile_ranks(values.size, probability, confidence),
        lambda: summarize(values, probabilities=(probability,), confidence=confidence),
    ):
        with pytest.raises(ValueError, match="does not lie between 0 and 1"):
            asked()
