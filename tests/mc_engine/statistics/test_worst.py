"""The worst cases."""

import numpy as np
import pytest

from mc_engine.statistics import worst_cases
from mc_engine.statistics.worst import Limits, WorstSoFar, limits_on

VALUES = np.array([3.0, 9.0, np.nan, 9.0, 1.0, 7.0])
OK = np.array([True, True, True, True, True, False])


@pytest.mark.parametrize(("largest", "rows"), [(True, [1, 3, 0]), (False, [4, 0, 1])])
def test_worst_first_ties_in_order_and_no_failed_case_among_them(largest, rows):
    assert worst_cases(VALUES, OK, 3, largest).tolist() == rows


@pytest.mark.parametrize("largest", [True, False])
def test_of_many_cases_with_ties_the_worst_are_those_of_a_full_sort(largest):
    draw = np.random.Generator(np.random.Philox(key=1))
    values = np.round(draw.normal(size=5000), 1)
    ok = draw.random(5000) > 0.1
    rows = np.flatnonzero(ok)
    expected = rows[np.argsort(-values[rows] if largest else values[rows], kind="stable")[:200]]
    assert worst_cases(values, ok, 200, largest).tolist() == expected.tolist()


@pytest.mark.parametrize("largest", [True, False])
@pytest.mark.parametrize("limits", [None, Limits(at_most=70.0), Limits(at_most=70.0, at_least=20.0)])
def test_of_cases_read_part_by_part_the_worst_are_those_of_the_whole_table(largest, limits):
    values = np.random.default_rng(4).integers(0, 90, 3000).astype(float)
    values[::7] = np.nan
    so_far = WorstSoFar(50, limits, largest)
    for first in range(0, 3000, 128):
        so_far.add(values[first : first + 128], first)
    whole = worst_cases(values, np.isfinite(values), 50, largest, limits)
    assert so_far.case_ids.tolist() == whole.tolist()


def test_limits_are_the_tightest_of_a_metric_and_margins_are_in_units_of_their_reach():
    asked = [{"metric": "x", "at_most": 12.0}, {"metric": "x", "at_most": 10.0, "at_least": 1.0},
             {"metric": "x", "at_least": 2.0, "at_most": None}, {"metric": "y", "at_most": 3.0}]  # fmt: skip
    both = limits_on("x", asked)
    assert (both, limits_on("y", asked), limits_on("z", asked)) == (Limits(10.0, 2.0), Limits(3.0), Limits())
    assert [both.two_sided, Limits(3.0).two_sided, Limits(at_least=3.0).two_sided] == [True, False, False]
    values = np.array([3.0, 9.5, 11.0, np.nan])
    np.testing.assert_array_equal(both.distances(values), [1.0, 0.5, -1.0, np.nan])
    np.testing.assert_array_equal(both.margins(values), [0.25, 0.125, -0.25, np.nan])  # half the distance is 4
    assert [Limits(-5.0).reach, Limits(at_least=0.0).reach, Limits().reach] == [5.0, 1.0, 1.0]
    assert both.largest_is_worst(values[:2])
    assert not both.largest_is_worst(np.array([2.5, 9.0, np.nan]))
    assert [Limits(3.0).largest_is_worst(values), Limits(at_least=3.0).largest_is_worst(values)] == [True, False]
