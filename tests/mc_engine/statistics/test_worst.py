"""The worst cases."""

import numpy as np
import pytest

from mc_engine.statistics import worst_cases

VALUES = np.array([3.0, 9.0, np.nan, 9.0, 1.0, 7.0])
OK = np.array([True, True, True, True, True, False])


@pytest.mark.parametrize(("largest", "rows"), [(True, [1, 3, 0]), (False, [4, 0, 1])])
def test_worst_first_ties_in_order_and_no_failed_case_among_them(largest, rows):
    assert worst_cases(VALUES, OK, 3, largest).tolist() == rows


def test_fewer_cases_than_asked_for_are_all_given():
    assert worst_cases(VALUES, OK, 100).size == 4
    assert worst_cases(VALUES[:0], OK[:0], 5).size == 0
