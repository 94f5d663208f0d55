"""Operators and functions on lanes against NumPy, which works on the same numbers one operation at a time."""

import math
import operator
from fractions import Fraction

import numpy as np
import pytest
from compiled_physics import WIDTHS, apply, bits, by_every_width
from numba.core.errors import TypingError
from numba.core.registry import cpu_target
from numba.core.typing.templates import ConcreteTemplate

from mc_engine.lanes import any_lane, copysign, floor, fma, lane_type, maximum, minimum, physics, rint, sqrt, where
from mc_engine.lanes.compiler import compile_inline
from mc_engine.lanes.lane_access import unequal

INF, NAN = math.inf, math.nan
RANDOM = np.random.default_rng(7)
# enough pairs for every combination of the special numbers, and random ones
SPECIAL = np.array([0.0, -0.0, 0.5, -0.5, 1.5, 2.5, -2.5, 1e308, -1e308, 5e-324, INF, -INF, NAN])
X = np.concatenate([np.repeat(SPECIAL, SPECIAL.size), RANDOM.normal(size=343) * 10.0 ** RANDOM.integers(-9, 9, 343)])
Y = np.concatenate([np.tile(SPECIAL, SPECIAL.size), RANDOM.normal(size=343) * 10.0 ** RANDOM.integers(-9, 9, 343)])


@pytest.fixture(autouse=True)
def _ieee_754():
    """NumPy goes to infinity and NaN in silence, as lanes do."""
    with np.errstate(all="ignore"):
        yield


@physics
def _arithmetic(x, y):
    z = 1.0 * x  # a new array where x is one, for += to change
    z += y
    z *= 2.0
    z -= 1
    z /= y
    return x + y, x - y, x * y, x / y, -x, +x, abs(x), 2.0 * x, x * 2, 1 - x, x - 0.5, x / 3, 3.0 / x, z


def test_arithmetic_of_lanes_and_plain_numbers_is_that_of_numpy():
    expected = _arithmetic(X, Y)
    ours = by_every_width(_arithmetic, len(expected), X, Y)
    for i, row in enumerate(expected):
        np.testing.assert_array_equal(bits(ours[i]), bits(row), err_msg=f"result {i}")


@physics
def _comparisons(x, y):
    return (
        where(x < y, 1.0, 0.0),
        where(x <= y, 1.0, 0.0),
        where(x > y, 1.0, 0.0),
        where(x >= y, 1.0, 0.0),
        where(x == y, 1.0, 0.0),
        where(x != y, 1.0, 0.0),
        where(x < 0.5, 1.0, 0.0),
        where(0.5 <= x, 1.0, 0.0),
        where(x != 2, 1.0, 0.0),
        where((x < y) & (y < 1.0), 1.0, 0.0),
        where((x < y) | (y < 1.0), 1.0, 0.0),
        where((x < y) ^ (y < 1.0), 1.0, 0.0),
        where((x < y) & True, 1.0, 0.0),
        where(False | (x < y), 1.0, 0.0),
    )


def test_comparisons_and_masks_are_those_of_numpy_and_false_where_a_number_is_missing():
    expected = _comparisons(X, Y)
    ours = by_every_width(_comparisons, len(expected), X, Y)
    for i, row in enumerate(expected):
        np.testing.assert_array_equal(ours[i], row, err_msg=f"result {i}")


@physics
def _denied(x, y):
    return where(not (x < y), 1.0, 0.0), where(not (x == y), x, 2)


def test_not_turns_every_lane_of_a_mask():
    ours = by_every_width(_denied, 2, X, Y)
    np.testing.assert_array_equal(ours[0], ~(X < Y))
    np.testing.assert_array_equal(ours[1], np.where(X == Y, 2.0, X))


@physics
def _functions(x, y):
    return (
        sqrt(x),
        rint(x),
        floor(x),
        copysign(x, y),
        copysign(2.0, x),
        minimum(x, y),
        maximum(x, y),
        minimum(x, 0.5),
        maximum(0.5, x),
        where(x < y, x, y),
        where(x < y, 1.0, y),
        where(True, x, y),
        fma(x, y, 0.1),
    )


def test_functions_give_the_bits_of_their_interpreted_meaning_on_arrays_and_on_floats():
    ours = by_every_width(_functions, 13, X, Y)
    for i, row in enumerate(_functions(X, Y)):
        np.testing.assert_array_equal(bits(ours[i]), bits(row), err_msg=f"result {i}")
    for case in range(0, X.size, 7):
        row = _functions(float(X[case]), float(Y[case]))
        np.testing.assert_array_equal(bits(ours[:, case]), bits(row))


def test_rint_rounds_halves_to_even_and_floor_goes_down():
    ours = by_every_width(_functions, 13, [0.5, 1.5, 2.5, -0.5, -1.5, 4503599627370497.0, -0.2], 0.0)
    assert ours[1].tolist() == [0, 2, 2, 0, -2, 4503599627370497, 0]
    assert ours[2].tolist() == [0, 1, 2, -1, -2, 4503599627370497, -1]


@physics
def _rounding_of_a_product(x, y):
    return fma(x, y, -(x * y)), fma(x, y, x)


def test_fma_rounds_once_and_products_and_sums_are_never_contracted_to_it():
    x, y = RANDOM.normal(size=64), RANDOM.normal(size=64)
    ours = by_every_width(_rounding_of_a_product, 2, x, y)
    exact = [(Fraction(a) * Fraction(b), Fraction(a), a * b) for a, b in zip(x.tolist(), y.tolist(), strict=True)]
    assert ours[0].tolist() == [float(product - Fraction(rounded)) for product, _, rounded in exact]
    assert ours[1].tolist() == [float(product + a) for product, a, _ in exact]
    assert np.count_nonzero(ours[0]) > 32
    sums = by_every_width(_sum_of_products, 1, x, y)[0]
    np.testing.assert_array_equal(sums, x * y + y * y)
    assert sums.tolist() != [fma(a, b, b * b) for a, b in zip(x.tolist(), y.tolist(), strict=True)]


@physics
def _sum_of_products(x, y):
    return (x * y + y * y,)


@physics
def _powers(x, y):
    return x**0, x**1, x**2, x**3, x**7, x**-1, x**-2, x**64


def test_whole_powers_are_products_in_the_same_order_at_every_width():
    x = np.concatenate([RANDOM.normal(size=200), SPECIAL])
    ours = by_every_width(_powers, 8, x, 0.0)
    for i, n in enumerate((0, 1, 2, 3, 7, -1, -2, 64)):
        np.testing.assert_allclose(ours[i], x**n, rtol=abs(n) * 1.2e-16)
    np.testing.assert_array_equal(ours[2], x * x)


@physics
def _gate(x, y):
    return (where(any_lane(x > y), 1.0, 0.0) + 0.0 * y,)


@pytest.mark.parametrize("width", WIDTHS)
def test_any_lane_sees_each_lane_of_its_own_group_and_no_other(width):
    for hit in range(2 * width):
        x = np.zeros(2 * width)
        x[hit] = 1.0
        groups = apply(_gate, 1, x, 0.5, width)[0].reshape(2, width)
        np.testing.assert_array_equal(groups, np.repeat([[hit < width], [hit >= width]], width, axis=1))
    assert not apply(_gate, 1, np.full(width, NAN), 0.5, width).any()


@physics
def _branch(x, y):
    if x < y:
        return (x,)
    return (y,)


@physics
def _word_and(x, y):
    return (where(x < y and y < 1.0, x, y),)


@physics
def _root(x, y):
    return (x**0.5,)


@physics
def _library_sine(x, y):
    return (math.sin(x),)


@pytest.mark.parametrize("function", [_branch, _word_and, _root, _library_sine])
def test_what_cannot_be_done_to_every_lane_at_once_is_refused_by_the_compiler(function):
    with pytest.raises(TypingError):
        apply(function, 1, X, Y, 8)


@pytest.mark.parametrize("op", [operator.add, operator.mul, operator.lt, operator.and_, operator.neg, operator.pow])
def test_the_compiler_tries_the_operators_of_lanes_first_and_those_of_plain_numbers_next(op):
    templates = cpu_target.typing_context._lookup_global(op).templates
    ours = [lane_type.__name__ in {known.__module__ for known in template.__mro__} for template in templates]
    plain = [issubclass(template, ConcreteTemplate) for template in templates[ours.count(True) :]]
    assert ours[0]
    assert ours == sorted(ours, reverse=True)
    assert plain == sorted(plain, reverse=True)


def _is_another(x, y):
    return (where(unequal((x, y), (y, y), x), 1.0, 0.0),)


def test_a_missing_number_equals_any_other_whatever_its_sign():
    written, computed = NAN, np.copysign(NAN, -1.0)  # the sign of one that is computed is the processor's
    first = [written, written, computed, written, 2.0, 0.0, INF, 2.0, INF]
    second = [written, computed, written, 2.0, computed, -0.0, INF, 3.0, -INF]
    another = by_every_width(compile_inline(_is_another), 1, first, second)[0]
    assert another.tolist() == [0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0]
