"""The hint on normality."""

import numpy as np
import pytest
from scipy import stats

from mc_engine.statistics import normality


@pytest.mark.parametrize("n", [20, 100, 5000])
@pytest.mark.parametrize("draw", ["normal", "exponential", "uniform"])
def test_the_test_agrees_with_scipy(n, draw):
    values = getattr(np.random.Generator(np.random.Philox(key=n)), draw)(size=n)
    found = normality(values)
    assert found.p_value == pytest.approx(stats.normaltest(values).pvalue, rel=1e-9, abs=1e-300)
    assert found.skewness == pytest.approx(stats.skew(values), abs=1e-12)
    assert found.excess_kurtosis == pytest.approx(stats.kurtosis(values), abs=1e-12)


def test_an_exponential_does_not_look_normal_and_a_normal_does():
    draw = np.random.Generator(np.random.Philox(key=1))
    assert not normality(draw.exponential(size=1000)).looks_normal
    assert normality(draw.normal(size=1000)).looks_normal


@pytest.mark.parametrize("values", [np.zeros(0), np.arange(19.0), np.full(50, 0.1), 1.0 + 1e-15 * np.arange(50.0)])
def test_too_few_or_constant_values_get_no_hint(values):
    assert normality(values) is None
