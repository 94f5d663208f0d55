import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mc_engine.studies.genetic_search import hypervolume, non_dominated

pytest.importorskip("pymoo")

SMALL = st.integers(0, 6).map(float)  # few values, so that equal ones are frequent
TABLES = st.tuples(st.integers(0, 30), st.integers(1, 3)).flatmap(lambda shape: arrays(float, shape, elements=SMALL))


def beaten(values, row):
    """Slow twin: whether a row of `values` is as small everywhere and smaller somewhere, or equal and earlier."""
    for other in range(len(values)):
        if (values[other] <= values[row]).all() and ((values[other] < values[row]).any() or other < row):
            return True
    return False


@given(TABLES)
def test_a_row_is_on_the_front_unless_another_beats_it(values):
    assert non_dominated(values).tolist() == [not beaten(values, row) for row in range(len(values))]


def test_a_row_without_a_number_is_never_on_the_front():
    values = np.array([[np.nan, 0.0], [1.0, 1.0], [np.inf, 0.0], [-np.inf, 0.0]])
    assert non_dominated(values).tolist() == [False, True, False, False]


@given(TABLES)
def test_the_volume_is_the_number_of_unit_boxes_that_are_dominated(values):
    reference = np.full(values.shape[1], 5.0)
    corners = np.stack(np.meshgrid(*[np.arange(5.0)] * values.shape[1], indexing="ij"), axis=-1)
    dominated = np.zeros(corners.shape[:-1], dtype=bool)
    for row in values:
        dominated |= (row <= corners).all(axis=-1)
    assert hypervolume(values, reference) == pytest.approx(dominated.sum(), abs=1e-12)
