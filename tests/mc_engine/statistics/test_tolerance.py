"""Tolerance limits from order statistics."""

import numpy as np
import pytest

from mc_engine.statistics.binomial import acceptance_number, smallest_interval_sample, smallest_sample
from mc_engine.statistics.tolerance import enclosing_ranks, lower_rank, upper_rank

VALUES = np.array([3.0, 1.0, 5.0, 2.0, 4.0])


def at(values, rank):
    return None if rank is None else float(np.sort(values)[rank - 1])


def upper_limit(values, accepted, no_number):
    return at(values, upper_rank(values.size, accepted, no_number))


def lower_limit(values, accepted, no_number):
    return at(values, lower_rank(values.size, accepted, no_number))


def interval(values, accepted, no_number):
    ranks = enclosing_ranks(values.size, accepted, no_number)
    return None if ranks is None else (at(values, ranks[0]), at(values, ranks[1]))


# Wilks, two-sided: smallest n whose smallest and largest value enclose 0.95 or 0.99 with 95 %.
@pytest.mark.parametrize(("share", "cases"), [(0.95, 93), (0.99, 473)])
def test_smallest_and_largest_value_enclose_the_share_from_wilks_sample_size_on(share, cases):
    assert smallest_interval_sample(share, 0.95) == cases
    values = np.arange(float(cases))
    assert interval(values, acceptance_number(cases, share, 0.95), 0) == (0.0, cases - 1.0)
    assert interval(values[1:], acceptance_number(cases - 1, share, 0.95), 0) is None


def test_a_second_value_is_left_out_at_each_end_when_there_are_enough():
    cases = smallest_interval_sample(0.95, 0.95, 2)
    assert cases == smallest_sample(0.95, 0.95, 3) == 153
    assert interval(np.arange(153.0), acceptance_number(153, 0.95, 0.95), 0) == (1.0, 151.0)
    assert interval(np.arange(152.0), acceptance_number(152, 0.95, 0.95), 0) == (0.0, 150.0)


@pytest.mark.parametrize(("accepted", "limit"), [(0, 5.0), (1, 4.0), (4, 1.0), (5, None), (None, None)])
def test_an_upper_limit_leaves_out_as_many_values_as_failures_are_allowed(accepted, limit):
    assert upper_limit(VALUES, accepted, 0) == limit
    assert lower_limit(-VALUES, accepted, 0) == (None if limit is None else -limit)


def test_cases_without_a_number_are_left_out_first():
    assert upper_limit(VALUES, 2, 1) == 4.0
    assert lower_limit(VALUES, 2, 2) == 1.0
    assert upper_limit(VALUES, 2, 3) is None
    assert interval(VALUES, 3, 2) == (1.0, 5.0)
    assert interval(VALUES, 3, 3) is None
