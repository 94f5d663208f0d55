"""Elementary functions against arithmetic of 140 bits, at special places, and width against width."""

import math
import re

import mpmath
import numpy as np
import pytest
from compiled_physics import bits, by_every_width

from mc_engine import lanes
from mc_engine.lanes import elementary, physics

ONE_ARGUMENT = ("exp", "sin", "cos", "tan", "asin", "acos", "atan", "log", "rsqrt")
TWO_ARGUMENTS = ("atan2", "pow")
NAMES = (*ONE_ARGUMENT, *TWO_ARGUMENTS)
INF, NAN = math.inf, math.nan


@physics
def _all(x, y):
    s, c = lanes.sincos(x)
    return (
        lanes.exp(x),
        lanes.sin(x),
        lanes.cos(x),
        lanes.tan(x),
        lanes.asin(x),
        lanes.acos(x),
        lanes.atan(x),
        lanes.log(x),
        lanes.rsqrt(x),
        lanes.atan2(x, y),
        lanes.pow(x, y),
        s,
        c,
    )


def compiled(name, x, y=1.0):
    """The compiled function at numbers x (and y): float64[n], the same bits by every width."""
    return by_every_width(_all, len(NAMES) + 2, x, y)[NAMES.index(name)]


def interpreted(name, x, y):
    """The same function run by Python on floats."""
    function = getattr(lanes, name)
    if name in ONE_ARGUMENT:
        return np.array([function(float(value)) for value in x])
    return np.array([function(float(a), float(b)) for a, b in zip(x, y, strict=True)])


def error_in_ulp(name, x, y=None):
    """Largest error over the points, in units of the last place of the true value (2**-1074 at least)."""
    x = np.asarray(x, dtype=float)
    y = np.ones_like(x) if y is None else np.asarray(y, dtype=float)
    others = {"pow": mpmath.power, "atan2": mpmath.atan2, "rsqrt": lambda x: 1 / mpmath.sqrt(x)}
    exact = others.get(name) or getattr(mpmath, name)
    worst = 0.0
    with mpmath.workprec(140):
        for a, b, value in zip(x.tolist(), y.tolist(), compiled(name, x, y).tolist(), strict=True):
            truth = exact(a, b) if name in TWO_ARGUMENTS else exact(mpmath.mpf(a))
            nearest = float(truth)
            if math.isinf(nearest) or math.isinf(value):
                assert value == nearest
            else:
                worst = max(worst, float(abs(value - truth)) / math.ulp(nearest))
    return worst


def spread_out(low, high, n=1500, seed=1):
    return np.random.default_rng(seed).uniform(low, high, n)


def powers_of_ten(low, high, n=1500, seed=2):
    return 10.0 ** spread_out(low, high, n, seed)


def multiples(step, n=1000):
    """Multiples of an angle, rounded, and their neighbours: where the reduction cancels most."""
    at = np.arange(-n, n + 1) * step
    return np.concatenate([at, np.nextafter(at, INF)])


NEAR_ONE = 1.0 - powers_of_ten(-16, 0)
ANGLES = [
    pytest.param(spread_out(-10, 10), id="a few turns"),
    pytest.param(spread_out(-1e9, 1e9), id="up to 1e9 rad"),
    pytest.param(multiples(np.pi / 4), id="multiples of 45 degrees"),
    pytest.param(powers_of_ten(-308, 0), id="tiny"),
]


@pytest.mark.parametrize(
    ("name", "bound", "x", "y"),
    [
        ("sin", 1.6, 186831391.7383554, 1.0),
        ("cos", 1.6, -697199440.4588196, 1.0),
        ("tan", 3.0, 557081235.7606905, 1.0),
        ("asin", 2.7, 0.3980832040607211, 1.0),
        ("acos", 2.7, 0.923588737309933, 1.0),
        ("atan", 2.1, 0.4253130725106696, 1.0),
        ("atan2", 2.1, 0.7205305727026304, 1.7239585083330549),
    ],
)
def test_largest_errors_of_millions_of_arguments_are_as_stated(name, bound, x, y):
    assert error_in_ulp(name, [x], [y]) <= bound


@pytest.mark.parametrize(
    "x",
    [
        pytest.param(spread_out(-708, 709.7), id="all"),
        pytest.param(spread_out(-1, 1), id="middle"),
        pytest.param(multiples(np.log(2) / 2, 700), id="where the reduction changes"),
        pytest.param(spread_out(-745, -708), id="subnormal"),
        pytest.param(-powers_of_ten(-300, 0), id="tiny"),
    ],
)
def test_exp_errs_by_at_most_one_and_a_half_ulp(x):
    assert error_in_ulp("exp", x) <= 1.5


@pytest.mark.parametrize("name", ["sin", "cos"])
@pytest.mark.parametrize("x", ANGLES)
def test_sine_and_cosine_err_by_at_most_one_and_a_half_ulp(name, x):
    assert error_in_ulp(name, x) <= 1.5


@pytest.mark.parametrize("x", ANGLES)
def test_tangent_errs_by_at_most_two_and_a_half_ulp(x):
    assert error_in_ulp("tan", x) <= 2.5


def test_large_angles_keep_nine_digits_up_to_where_the_docstring_says_that_sine_becomes_meaningless():
    meaningless = float(re.search(r"from (\S+) rad on", elementary.__doc__)[1])
    x = spread_out(1e9, meaningless)
    with mpmath.workprec(140):
        truth = [float(mpmath.sin(one)) for one in x.tolist()]
    assert np.abs(interpreted("sin", x, x) - truth).max() < 1e-9


def test_sincos_gives_the_bits_of_sin_and_cos():
    table = by_every_width(_all, len(NAMES) + 2, spread_out(-1e3, 1e3), 1.0)
    np.testing.assert_array_equal(table[-2:], table[[NAMES.index("sin"), NAMES.index("cos")]])


@pytest.mark.parametrize(("name", "bound"), [("asin", 1.8), ("acos", 2.3)])
@pytest.mark.parametrize(
    "x", [spread_out(-1, 1), NEAR_ONE, -NEAR_ONE, powers_of_ten(-300, -1)], ids=["all", "near 1", "near -1", "tiny"]
)
def test_arc_sine_and_arc_cosine_err_by_about_two_ulp(name, bound, x):
    assert error_in_ulp(name, x) <= bound


@pytest.mark.parametrize(
    "x",
    [spread_out(-2, 2), powers_of_ten(-300, 300), -multiples(math.tan(math.pi / 8), 9)],
    ids=["middle", "all", "where the reduction changes"],
)
def test_arc_tangent_errs_by_at_most_one_and_a_half_ulp(x):
    assert error_in_ulp("atan", x) <= 1.5


@pytest.mark.parametrize(
    ("y", "x"),
    [
        pytest.param(spread_out(-1, 1), spread_out(-1, 1, seed=3), id="all quadrants"),
        pytest.param(powers_of_ten(-100, 100), -powers_of_ten(-100, 100, seed=3), id="all sizes"),
        pytest.param(-powers_of_ten(-18, 0), np.full(1500, -1.0), id="near half a turn"),
        pytest.param(powers_of_ten(-320, -300), powers_of_ten(-320, -300, seed=3), id="subnormal"),
    ],
)
def test_atan2_errs_by_at_most_one_and_a_half_ulp(y, x):
    assert error_in_ulp("atan2", y, x) <= 1.5


@pytest.mark.parametrize(
    "x",
    [powers_of_ten(-323, 308), 1.0 + spread_out(-1e-3, 1e-3), spread_out(0.5, 2.0), 1.0 + powers_of_ten(-15, 0)],
    ids=["all", "close to 1", "around 1", "just above 1"],
)
def test_log_errs_by_at_most_one_ulp(x):
    assert error_in_ulp("log", x) <= 1.0


@pytest.mark.parametrize(
    "x",
    [powers_of_ten(-307, 308), spread_out(1.0, 4.0), [1.0000065507238864, 262145.7172329625]],
    ids=["all", "two octaves", "worst of 40 million"],
)
def test_rsqrt_errs_by_at_most_one_ulp_and_a_hundredth(x):
    assert error_in_ulp("rsqrt", x) <= 1.01


@pytest.mark.parametrize(
    ("x", "y"),
    [
        pytest.param(powers_of_ten(-3, 3), spread_out(-90, 90, seed=3), id="all"),
        pytest.param(1.0 + spread_out(-1e-2, 1e-2), spread_out(-5e4, 5e4, seed=3), id="large powers near 1"),
        pytest.param(spread_out(0.1, 10), spread_out(-3, 3, seed=3), id="small powers"),
        pytest.param(-spread_out(0.1, 10), np.rint(spread_out(-20, 20, seed=3)), id="whole powers below zero"),
        pytest.param(powers_of_ten(-320, 308), spread_out(-0.9, 0.9, seed=3), id="roots"),
    ],
)
def test_pow_errs_by_at_most_one_and_a_half_ulp(x, y):
    assert error_in_ulp("pow", x, y) <= 1.5


SPECIAL = {
    "exp": [(0.0, 1.0), (-0.0, 1.0), (INF, INF), (-INF, 0.0), (710.0, INF), (-746.0, 0.0)],
    "sin": [(0.0, 0.0), (-0.0, 0.0), (5e-324, 5e-324), (INF, NAN), (-INF, NAN)],
    "cos": [(0.0, 1.0), (-0.0, 1.0), (INF, NAN), (-INF, NAN)],
    "tan": [(0.0, 0.0), (-0.0, 0.0), (5e-324, 5e-324), (INF, NAN), (-INF, NAN)],
    "asin": [(0.0, 0.0), (-0.0, -0.0), (1.0, math.pi / 2), (-1.0, -math.pi / 2), (1 + 2**-52, NAN), (-INF, NAN)],
    "acos": [(0.0, math.pi / 2), (-0.0, math.pi / 2), (1.0, 0.0), (-1.0, math.pi), (-1 - 2**-52, NAN), (1e300, NAN)],
    "atan": [(0.0, 0.0), (-0.0, -0.0), (INF, math.pi / 2), (-INF, -math.pi / 2), (1e300, math.pi / 2)],
    "log": [(0.0, -INF), (-0.0, -INF), (1.0, 0.0), (INF, INF), (-INF, NAN), (-1.0, NAN), (-5e-324, NAN)],
    "rsqrt": [(0.0, INF), (-0.0, INF), (2e-308, INF), (1.0, 1.0), (INF, 0.0), (-INF, NAN), (-1.0, NAN), (-2e-308, NAN)],
}


@pytest.mark.parametrize("name", ONE_ARGUMENT)
def test_zeros_infinities_and_numbers_out_of_the_domain_are_as_in_c99_but_for_signs_at_zero(name):
    x, expected = zip(*SPECIAL[name], (NAN, NAN), strict=True)
    np.testing.assert_array_equal(bits(compiled(name, x)), bits(expected))
    np.testing.assert_array_equal(bits(interpreted(name, x, x)), bits(expected))


@pytest.mark.parametrize(("name", "reference"), [("atan2", np.arctan2), ("pow", np.power)])
def test_pairs_of_special_numbers_are_as_in_c99_but_what_is_not_a_number_is_handed_on(name, reference):
    numbers = [0.0, 0.5, 1.0, 2.0, 2.5, 3.0, 1e300, 5e-324, INF]
    numbers += [-number for number in numbers] + [NAN]
    x, y = (grid.ravel() for grid in np.meshgrid(numbers, numbers))
    with np.errstate(all="ignore"):
        expected = np.where(np.isnan(x) | np.isnan(y), NAN, reference(x, y))
    ours = compiled(name, x, y)
    np.testing.assert_array_equal(bits(interpreted(name, x, y)), bits(ours))
    known = ~np.isnan(expected)
    np.testing.assert_array_equal(np.signbit(ours[known]), np.signbit(expected[known]))
    np.testing.assert_allclose(ours, expected, rtol=5e-16)


@pytest.mark.parametrize("name", NAMES)
def test_python_and_compiler_give_the_same_bits(name):
    x, y = spread_out(-3, 3, 150), spread_out(-9, 9, 150, seed=3)
    x[:50] = 10.0 ** (20 * x[:50])
    if name in ("asin", "acos"):
        x = np.sin(x)
    if name in ("log", "pow"):
        x = abs(x)
    np.testing.assert_array_equal(bits(interpreted(name, x, y)), bits(compiled(name, x, y)))
