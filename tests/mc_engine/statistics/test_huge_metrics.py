"""Metrics near the ends of float64: the same answers as of the same numbers near one, and no warning."""

import numpy as np
import pytest

from mc_engine.statistics.change_tests import metric_change
from mc_engine.statistics.convergence import running_mean, running_quantile
from mc_engine.statistics.moments import in_units, near_one
from mc_engine.statistics.summary import nearly_equal, summarize

N = 400
A, B, C = np.random.default_rng(3).normal(size=(3, N))
PLAIN = A + 0.3 * B + 0.1 * C


@pytest.mark.parametrize("size", [1e300, 1e307, 1.79e308])
def test_summary_and_convergence_take_numbers_to_the_end_of_float64(size):
    values = size * np.tanh(PLAIN)
    summary = summarize(values)
    assert np.isfinite([summary.mean, summary.sd, summary.minimum, summary.maximum]).all()
    assert not nearly_equal(np.float64(-size), np.float64(size))
    assert np.isfinite(running_mean(values).estimate).all()
    assert np.isfinite(running_quantile(values, 0.5).estimate).all()


def test_what_lies_beyond_float64_is_infinite_and_said_to_be():
    small, exponent = near_one(np.array([1.79e308, -1.79e308, np.nan]))
    assert np.array_equal(in_units(small, exponent), [1.79e308, -1.79e308, np.nan], equal_nan=True)
    assert in_units(4.0, exponent) == np.inf


def test_a_run_alone_with_numbers_has_the_deviation_of_its_summary():
    for values in (PLAIN, 1e300 * PLAIN):
        change = metric_change("m", values, np.full(N, np.nan), paired=False)
        summary = summarize(values)
        assert (change.mean[0], change.deviation[0]) == pytest.approx((summary.mean, summary.sd), rel=1e-12)
