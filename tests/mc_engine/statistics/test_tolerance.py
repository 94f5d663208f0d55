"""Tolerance limits from order statistics."""

import numpy as np
import pytest

from mc_engine.statistics.binomial import smallest_interval_sample, smallest_sample
from mc_engine.statistics.tolerance import lower_rank, upper_rank

VALUES = np.array([3.0, 1.0, 5.0, 2.0, 4.0])


def at(values, rank):
    return None if rank is None else float(np.sort(values)[rank - 1])


def upper_limit(values, accepted, no_number):
    return at(values, upper_rank(values.size, accepted, no_number))


def lower_limit(values, accepted, no_number):
    return at(values, lower_rank(values.size, accepted, no_number))


# Wilks, two-sided: smallest n whose smallest and largest value enclose 0.95 or 0.99 with 95 %.
@pytest.mark.parametrize(("share", "cases"), [(0.95, 93), (0.99, 473)])
def test_smallest_and_largest_value_enclose_the_share_from_wilks_sample_size_on(share, cases):
    assert smallest_interval_sample(share, 0.95) == cases
    assert smallest_interval_sample(0.95, 0.95, 2) == smallest_sample(0.95, 0.95, 3) == 153
    assert smallest_sample(0.95, 0.95) == 59  # one-sided, without a failure


@pytest.mark.parametrize(("accepted", "limit"), [(0, 5.0), (1, 4.0), (4, 1.0), (5, None), (None, None)])
def test_an_upper_limit_leaves_out_as_many_values_as_failures_are_allowed(accepted, limit):
    assert upper_limit(VALUES, accepted, 0) == limit
    assert lower_limit(-VALUES, accepted, 0) == (None if limit is None else -limit)


def test_cases_without_a_number_are_left_out_first():
    assert upper_limit(VALUES, 2, 1) == 4.0
    assert lower_limit(VALUES, 2, 2) == 1.0
    assert upper_limit(VALUES, 2, 3) is None
