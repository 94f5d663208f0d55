"""Pairs of cases that differ in one choice alone."""

import numpy as np
import pytest

from mc_engine.statistics.paired import matching_rows, paired_difference


def test_cases_of_a_grid_are_matched_in_any_order():
    order = np.random.Generator(np.random.Philox(key=1)).permutation(12)
    choice = np.repeat(["a", "b", "c"], 4)[order]
    x = np.tile([1.0, 2.0, 3.0, 4.0], 3)[order]
    rows = matching_rows(choice, ["b", "a", "c"], {"x": x})
    assert rows.shape == (4, 3)
    assert (choice[rows] == ["b", "a", "c"]).all()
    assert (x[rows] == x[rows][:, :1]).all()


def test_a_set_that_lacks_a_level_or_has_one_twice_is_left_out():
    choice = np.array(["a", "b", "a", "a", "b", "b"])
    x = np.array([1.0, 1.0, 2.0, 3.0, 3.0, 3.0])
    assert matching_rows(choice, ["a", "b"], {"x": x}).tolist() == [[0, 1]]


def test_pairs_find_a_shift_that_the_scatter_hides():
    draw = np.random.Generator(np.random.Philox(key=3))
    scatter = draw.normal(0.0, 100.0, 400)
    found = paired_difference(scatter + draw.normal(0.5, 1.0, 400), scatter)
    assert found.median.lower > 0.3
    assert found.median.upper < 0.75
    assert found.smaller_share[1] < 0.5


def test_the_interval_of_the_median_difference_covers_as_often_as_it_says():
    draw = np.random.Generator(np.random.Philox(key=4))
    zero = np.zeros(59)
    intervals = [paired_difference(draw.exponential(size=59), zero, 0.9).median for _ in range(1000)]
    covered = np.mean([one.lower <= np.log(2.0) <= one.upper for one in intervals])
    assert covered >= 0.9 - 3.0 * np.sqrt(0.09 / 1000)


def test_pairs_without_a_number_are_counted_and_not_used():
    found = paired_difference(np.array([1.0, np.nan, np.inf]), np.array([2.0, 1.0, 1.0]))
    assert (found.n_used, found.n_tried, found.smaller) == (1, 3, 1)
    nothing = paired_difference(np.array([np.nan]), np.array([1.0]))
    assert (nothing.n_used, nothing.median, nothing.smaller, nothing.smaller_share) == (0, None, 0, None)
    assert paired_difference(np.zeros(0), np.zeros(0)).n_tried == 0
    assert found.smallest == pytest.approx(-1.0)
