"""Indices from blocks of cases: metrics that do not vary have none, also where they are others at nominal values."""

import numpy as np
import pytest

from mc_engine.sampling.block_layout import RANDOM_DRAWS, BlockLayout
from mc_engine.statistics.pick_freeze import pick_freeze

LAYOUT = BlockLayout(("x", RANDOM_DRAWS), held=(RANDOM_DRAWS,))
BLOCKS = 256


def shares(drawn, held):
    """Indices of a metric that is `drawn`, but `held` where the draw has its nominal value."""
    y = np.full((BLOCKS, LAYOUT.size), drawn)
    y[:, LAYOUT.without(RANDOM_DRAWS)[1]] = held
    return pick_freeze(LAYOUT, np.arange(y.size), {"y": y.ravel()})


@pytest.mark.parametrize(("drawn", "held"), [(3.0, 2.0), (7.0, 6.0), (0.0, 1.0), (0.1, 0.1)])
def test_what_is_the_same_in_all_drawn_cases_has_no_indices(drawn, held):
    found = shares(drawn, held)
    assert np.isnan([found.first, found.total, found.fall, found.fall_error]).all()
    assert found.n_used.tolist() == [BLOCKS]


def test_nor_has_it_where_it_varies_at_nominal_values_only():
    found = shares(0.1, np.random.default_rng(1).normal(size=BLOCKS))
    assert np.isnan([found.first, found.total, found.fall]).all()


def test_a_variance_that_the_draw_alone_makes_falls_as_a_whole():
    rng = np.random.default_rng(2)
    y = np.empty((BLOCKS, LAYOUT.size))
    points = rng.normal(size=(BLOCKS, 2))
    y[:] = np.where(LAYOUT.points(RANDOM_DRAWS) == 1, points[:, 1:], points[:, :1])
    y[:, LAYOUT.without(RANDOM_DRAWS)[1]] = 0.5
    found = pick_freeze(LAYOUT, np.arange(y.size), {"y": y.ravel()})
    assert found.fall[1, 0] == pytest.approx(1.0, abs=1e-12)
    assert np.isnan(found.fall[0, 0])
