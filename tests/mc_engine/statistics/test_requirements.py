"""Requirement verdicts."""

import numpy as np
import pytest

from mc_engine.statistics import judge, pass_probability

FUEL = {"name": "fuel", "metric": "propellant_kg", "at_most": 1.0, "at_least": None, "share": 0.9973, "confidence": 0.9}


def cases(passed, failed):
    """Values for a limit of 1.0, and that all were flown to their end."""
    return np.r_[np.linspace(0.1, 0.9, passed), np.linspace(1.1, 1.9, failed)], np.ones(passed + failed, dtype=bool)


def test_no_failure_in_2302_cases_shows_0999_with_90_percent_confidence():
    assert pass_probability(2302, 2302)[1] >= 0.999 > pass_probability(2301, 2301)[1]


def test_pass_probability_without_a_case_is_refused():
    with pytest.raises(ValueError, match="no case"):
        pass_probability(0, 0)


# Smallest N that shows 0.9973 with 90 % for 0 ... 3 failures (NASA/TP-2010-216447's three-sigma level).
@pytest.mark.parametrize(("failures", "tried"), [(0, 852), (1, 1440), (2, 1970), (3, 2473)])
def test_the_verdict_turns_to_pass_at_the_known_sample_sizes(failures, tried):
    assert judge(FUEL, *cases(tried - failures, failures)).outcome == "pass"
    assert judge(FUEL, *cases(tried - failures - 1, failures)).outcome == "not demonstrable"


def test_too_few_cases_say_how_many_would_do():
    found = judge(FUEL, *cases(100, 0))
    assert (found.outcome, found.needed) == ("not demonstrable", 852)


def test_a_share_below_its_own_upper_bound_fails():
    found = judge(FUEL, *cases(900, 100))
    assert found.outcome == "fail"
    assert found.lower < 0.9 < found.upper < 0.9973


def test_failed_cases_and_numbers_that_are_none_count_against_the_requirement():
    values, ok = cases(2302, 0)
    values[:5] = np.nan
    ok[5:8] = False
    found = judge(FUEL, values, ok)
    assert (found.passed, found.tried, found.no_number) == (2294, 2302, 8)


def test_a_value_on_the_limit_is_inside():
    assert judge(FUEL, np.array([1.0]), np.array([True])).passed == 1


def test_both_limits_together_make_a_band():
    found = judge({**FUEL, "at_least": 0.5}, np.array([0.4, 0.5, 0.7, 1.0, 1.1]), np.ones(5, dtype=bool))
    assert found.passed == 3
    assert found.demonstrated is None


def test_the_limit_shown_is_the_largest_value_at_the_smallest_sample_and_the_margin_follows():
    values, ok = cases(852, 0)
    found = judge(FUEL, values, ok)
    assert found.demonstrated == values.max()
    assert found.margin == pytest.approx(0.1)


def test_the_limit_shown_decides_like_the_verdict():
    draw = np.random.Generator(np.random.Philox(key=4))
    for n in (900, 1500, 4000):
        values = draw.exponential(size=n) / 6.2
        found = judge(FUEL, values, np.ones(n, dtype=bool))
        assert (found.outcome == "pass") == (found.demonstrated is not None and found.demonstrated <= 1.0)


def test_at_least_is_at_most_turned_round():
    values, ok = cases(2000, 1)
    mirrored = judge({**FUEL, "at_most": None, "at_least": -1.0}, -values, ok)
    straight = judge(FUEL, values, ok)
    assert mirrored.passed == straight.passed
    assert mirrored.demonstrated == -straight.demonstrated
    assert mirrored.margin == pytest.approx(straight.margin)


def test_failed_cases_take_the_worst_ranks_of_the_limit_shown():
    values, ok = cases(1440, 0)
    ok[np.argmin(values)] = False  # the best value is lost, and with it a rank at the bad end
    assert judge(FUEL, values, ok).demonstrated == values.max()
    ok[np.argmin(np.where(ok, values, 9.0))] = False
    assert judge(FUEL, values, ok).demonstrated is None


def test_a_grid_gives_counts_but_no_verdict():
    found = judge(FUEL, *cases(5000, 0), design="grid")
    assert (found.outcome, found.passed, found.lower, found.needed) == ("not demonstrable", 5000, None, None)


@pytest.mark.parametrize("n", [0, 1, 2])
def test_hardly_any_cases_demonstrate_nothing_and_warn_of_nothing(n):
    assert judge(FUEL, np.zeros(n), np.ones(n, dtype=bool)).outcome == "not demonstrable"


def test_all_failed_is_a_fail():
    assert judge(FUEL, np.full(50, np.nan), np.zeros(50, dtype=bool)).outcome == "fail"
