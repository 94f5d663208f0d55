"""Metrics near the ends of float64: the same answers as of the same numbers near one, and no warning."""

import numpy as np
import pytest

from mc_engine.statistics.change_tests import metric_change
from mc_engine.statistics.convergence import running_mean, running_quantile
from mc_engine.statistics.maps import map_metric
from mc_engine.statistics.moments import in_units, near_one
from mc_engine.statistics.sensitivity import sensitivity
from mc_engine.statistics.summary import nearly_equal, summarize

N = 400
A, B, C = np.random.default_rng(3).normal(size=(3, N))
PLAIN = A + 0.3 * B + 0.1 * C
EXPONENTS = (996, -996)  # powers of two near 1e300 and 1e-300: scaling by them rounds nothing


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_indices_are_those_of_the_same_numbers_near_one(exponent):
    near, far = (sensitivity({"a": A, "b": B}, {"m": one}) for one in (PLAIN, np.ldexp(PLAIN, exponent)))
    for name in ("first_order", "total", "spearman", "src", "prcc", "total_error", "src_error", "r_squared"):
        assert np.array_equal(getattr(near, name), getattr(far, name)), name
        assert np.isfinite(getattr(far, name)).all()


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_a_map_is_that_of_the_same_numbers_near_one(exponent):
    near, far = (map_metric(A, B, one, 21) for one in (PLAIN, np.ldexp(PLAIN, exponent)))
    assert np.array_equal(np.ldexp(near.value, exponent), far.value, equal_nan=True)
    assert np.array_equal(np.ldexp(near.error, exponent), far.error, equal_nan=True)
    assert np.isfinite(far.value).any()
    assert np.array_equal(near.x, far.x)


@pytest.mark.parametrize("paired", [True, False])
@pytest.mark.parametrize("exponent", EXPONENTS)
def test_a_change_is_that_of_the_same_numbers_near_one(exponent, paired):
    after = PLAIN + 0.5 + 0.2 * C
    near = metric_change("m", PLAIN, after, paired=paired)
    far = metric_change("m", np.ldexp(PLAIN, exponent), np.ldexp(after, exponent), paired=paired)
    assert (near.shift_p, near.spread_p, near.ratio) == (far.shift_p, far.spread_p, far.ratio)
    assert far.shift.value == np.ldexp(near.shift.value, exponent)
    assert far.mean[1] == np.ldexp(near.mean[1], exponent)
    assert far.shift_in_sigma.value == pytest.approx(near.shift_in_sigma.value, rel=1e-12)


@pytest.mark.parametrize("size", [1e300, 1e307, 1.79e308])
def test_summary_and_convergence_take_numbers_to_the_end_of_float64(size):
    values = size * np.tanh(PLAIN)
    found = summarize(values)
    assert np.isfinite([found.mean, found.sd, found.minimum, found.maximum]).all()
    assert not nearly_equal(np.float64(-size), np.float64(size))
    assert np.isfinite(running_mean(values).estimate).all()
    assert np.isfinite(running_quantile(values, 0.5).estimate).all()


def test_what_lies_beyond_float64_is_infinite_and_said_to_be():
    small, exponent = near_one(np.array([1.79e308, -1.79e308, np.nan]))
    assert np.array_equal(in_units(small, exponent), [1.79e308, -1.79e308, np.nan], equal_nan=True)
    assert in_units(4.0, exponent) == np.inf
