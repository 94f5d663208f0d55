"""Summaries of a metric."""

import numpy as np
import pytest

from mc_engine.statistics import summarize

DRAW = np.random.Generator(np.random.Philox(key=2))


def test_values_that_are_no_numbers_count_as_tried_and_not_as_used():
    found = summarize(np.array([1.0, np.nan, 3.0, np.inf, 5.0]))
    assert (found.n_used, found.n_tried) == (3, 5)
    assert (found.mean, found.sd, found.minimum, found.maximum) == (3.0, 2.0, 1.0, 5.0)


def test_order_of_the_cases_changes_no_bit():
    values = DRAW.normal(size=1000)
    assert summarize(values) == summarize(values[::-1]) == summarize(DRAW.permutation(values))


def test_moments_are_those_of_numpy():
    values = DRAW.gamma(2.0, size=4000)
    found = summarize(values)
    assert found.mean == pytest.approx(values.mean(), rel=1e-13)
    assert found.sd == pytest.approx(values.std(ddof=1), rel=1e-13)


def test_a_constant_metric_keeps_its_bits_and_has_no_spread():
    found = summarize(np.full(10_001, 0.1))
    assert found.constant
    assert (found.mean, found.sd, found.at(0.5).value, found.shape) == (0.1, 0.0, 0.1, None)


@pytest.mark.parametrize("values", [[], [np.nan], [np.nan] * 500])
def test_without_a_number_there_is_no_statistic_and_no_warning(values):
    found = summarize(np.array(values))
    assert (found.n_used, found.n_tried) == (0, len(values))
    assert found.mean is found.sd is found.minimum is None
    assert found.quantiles == ()


def test_one_case_has_a_mean_and_no_standard_deviation():
    found = summarize(np.array([2.5]))
    assert (found.mean, found.sd) == (2.5, None)
    assert found.at(0.5).lower is None
    assert found.at(0.5).upper is None


def test_huge_values_do_not_overflow():
    found = summarize(np.array([1e308, 1.2e308, 1.4e308]))
    assert found.mean == pytest.approx(1.2e308)
    assert found.sd == pytest.approx(2e307)


def test_ten_thousand_cases_reach_the_three_sigma_limits_with_their_intervals():
    found = summarize(DRAW.normal(size=10_000))
    assert [item.probability for item in found.quantiles] == [0.00135, 0.02275, 0.5, 0.97725, 0.99865]
    assert all(item.lower < item.value < item.upper for item in found.quantiles)
    assert found.at(0.99865).value == pytest.approx(3.0, abs=0.3)
