"""Clopper-Pearson bounds on a share."""

import pytest
from scipy.stats import binom, hypergeom

from mc_engine.statistics import clopper_pearson, lower_bound, pass_probability, upper_bound
from mc_engine.statistics.binomial import hypergeometric_tails

# Clopper-Pearson 95 % intervals, printed to eight or more digits in the statement of the statistics package.
INTERVALS = [
    (0, 1000, 0.0, 0.00368208),
    (3, 2000, 0.000309443, 0.004377320),
    (27, 10_000, 0.001780048, 0.003925945),
]


@pytest.mark.parametrize(("count", "tried", "lower", "upper"), INTERVALS)
def test_two_sided_bounds_have_the_printed_digits(count, tried, lower, upper):
    assert clopper_pearson(count, tried) == pytest.approx((lower, upper), abs=5e-9)


@pytest.mark.parametrize(("passed", "tried"), [(1, 3), (40, 50), (999, 1000)])
def test_at_the_lower_bound_so_many_passes_have_just_the_left_over_probability(passed, tried):
    share = lower_bound(passed, tried, 0.9)
    assert binom.sf(passed - 1, tried, share) == pytest.approx(0.1, abs=1e-9)


def test_all_and_none_passing_or_tried_give_the_ends_of_the_interval():
    assert upper_bound(10, 10) == upper_bound(0, 0) == 1.0
    assert lower_bound(0, 10) == lower_bound(0, 0) == 0.0
    assert clopper_pearson(0, 0) == (0.0, 1.0)


@pytest.mark.parametrize(
    ("passed", "tried", "confidence", "message"),
    [(0, 0, 0.9, "no case was tried"), (3, 2, 0.9, "3 of 2 cases"), (-1, 2, 0.9, "-1 of 2 cases"),
     (1, 2, 1.0, "confidence 1.0"), (1, 2, 0.0, "confidence 0.0")],
)  # fmt: skip
def test_impossible_counts_and_confidences_are_refused_with_a_message(passed, tried, confidence, message):
    with pytest.raises(ValueError, match=message):
        pass_probability(passed, tried, confidence)


@pytest.mark.parametrize(
    ("total", "marked", "drawn", "marked_drawn"), [(10_000, 14, 5000, 3), (100, 50, 30, 14), (9, 9, 4, 4)]
)
def test_tails_without_replacement_are_those_of_scipy(total, marked, drawn, marked_drawn):
    law = hypergeom(total, marked, drawn)
    assert hypergeometric_tails(total, marked, drawn, marked_drawn) == pytest.approx(
        (law.cdf(marked_drawn), law.sf(marked_drawn - 1))
    )
