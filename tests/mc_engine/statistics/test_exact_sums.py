"""Sums without rounding."""

from fractions import Fraction
from math import fsum

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mc_engine.statistics.moments import BLOCK, UNIT_BITS, ExactSum

FINITE = st.floats(allow_nan=False, allow_infinity=False)


def exact(*parts):
    total = ExactSum()
    for part in parts:
        total.add(part)
    return total


@given(arrays(np.float64, st.integers(0, 40), elements=FINITE))
def test_a_sum_is_that_of_fractions(values):
    assert Fraction(exact(values).units, 2**UNIT_BITS) == sum(map(Fraction, values.tolist()), Fraction(0))


@pytest.mark.parametrize("spread", [0, 60, 1900])
def test_long_sums_over_many_powers_of_two_are_rounded_once(spread):
    draw = np.random.Generator(np.random.Philox(key=spread))
    values = draw.normal(size=3 * BLOCK + 17) * 2.0 ** draw.integers(-spread // 2, spread // 2 + 1, 3 * BLOCK + 17)
    assert exact(values).over(1) == fsum(values)


def test_parts_put_in_in_any_order_are_the_whole():
    values = np.random.Generator(np.random.Philox(key=3)).standard_cauchy(1000)
    one, two, three = np.split(values, [10, 600])
    assert exact(three, one, two).units == exact(values).units
