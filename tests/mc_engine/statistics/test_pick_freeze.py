"""Indices from blocks of cases: against closed forms over many seeds, and of metrics that do not vary."""

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


# y = product of 1 + c_k h_k, each h_k uniform with mean 0 and variance 1: the variance of a group alone is c_k^2
SIZES = {"large": 0.7, "small": 0.2, "none": 0.0, RANDOM_DRAWS: 0.5}
PRODUCT = BlockLayout(tuple(SIZES), (RANDOM_DRAWS,), ("large", RANDOM_DRAWS))
NOMINAL = 0.5  # of each h
OWN = np.array([size * size for size in SIZES.values()])
WHOLE = np.prod(1.0 + OWN) - 1.0
FIRST, TOTAL = OWN / WHOLE, OWN * (1.0 + WHOLE) / (1.0 + OWN) / WHOLE
FALL = 1.0 - (1.0 + NOMINAL * np.sqrt(OWN)) ** 2 * ((1.0 + WHOLE) / (1.0 + OWN) - 1.0) / WHOLE


def product_of(seed, blocks):
    """Indices of y from independent points."""
    points = np.random.default_rng(seed).uniform(-np.sqrt(3.0), np.sqrt(3.0), (4, len(SIZES), blocks))
    points[-1] = NOMINAL
    y = np.ones((blocks, PRODUCT.size))
    for place, (group, size) in enumerate(SIZES.items()):
        y *= 1.0 + size * points[PRODUCT.points(group), place].T
    return pick_freeze(PRODUCT, np.arange(y.size), {"y": y.ravel(), "far": 7e6 + y.ravel()})


@pytest.mark.parametrize("seed", range(5))
def test_a_group_without_effect_has_none_whatever_the_points_are(seed):
    """The correlation of the two independent points of these blocks is up to 0.1; it is in no index."""
    found, place = product_of(seed, 100), list(SIZES).index("none")
    assert (found.first[place, 0], found.total[place, 0]) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert (found.first_error[place, 0], found.total_error[place, 0]) == pytest.approx((0.0, 0.0), abs=1e-12)


def test_a_small_spread_about_a_large_mean_has_the_same_indices():
    found = product_of(1, 256)
    for name in ("first", "first_error", "total", "total_error", "fall", "fall_error"):
        near, far = getattr(found, name).T
        assert far == pytest.approx(near, abs=1e-6, nan_ok=True), name


def test_errors_shrink_and_intervals_hold_as_often_as_they_say():
    """200 seeds: 90 % intervals hold in 90 % of them, within three standard errors of such a count."""
    seeds, blocks, reach = 200, 512, 1.6449
    found = [product_of(seed, blocks) for seed in range(seeds)]
    three = 3.0 * np.sqrt(0.9 * 0.1 / seeds)
    for name, exact in (("first", FIRST), ("total", TOTAL), ("fall", FALL)):
        varying = np.isin([*SIZES], PRODUCT.held) if name == "fall" else OWN > 0.0
        off = np.array([getattr(one, name)[:, 0] - exact for one in found])
        errors = np.array([getattr(one, f"{name}_error")[:, 0] for one in found])
        held = (np.abs(off) <= reach * errors).mean(axis=0)
        assert held[varying] == pytest.approx(np.full(varying.sum(), 0.9), abs=three), name
        bias = np.abs(off.mean(axis=0)) <= 3.0 * off.std(axis=0) / np.sqrt(seeds) + 1e-12
        assert (bias | np.isnan(off).all(axis=0)).all(), name
        assert errors.mean(axis=0)[varying] == pytest.approx(off.std(axis=0)[varying], rel=0.2), name
    # without a control variate the first-order index of a group with little effect scatters by 1 / sqrt(blocks)
    scatter = np.std([one.first[list(SIZES).index("small"), 0] for one in found])
    assert scatter < 0.5 / np.sqrt(blocks)


@pytest.mark.parametrize("rest", [0.0, 0.003])
def test_what_few_blocks_make_most_of_the_variance_of_is_given_no_effects(rest):
    """Of a flag that is raised where a + b is large: intervals of 90 % contained the true value in 5 of 100 trials, and
    so did those of a metric that is larger there by three hundred of its usual standard deviations."""
    layout = BlockLayout(("a", "b"))
    points = np.random.default_rng(4).normal(size=(3, 2, 512))
    total = sum(points[layout.points(group), k].T for k, group in enumerate(layout.groups))
    for limit, told in ((4.0, False), (2.0, True)):
        raised = total > limit
        blocks = np.count_nonzero(raised.any(axis=1))
        assert (blocks >= 20) == told
        assert blocks > 0
        metric = raised + rest * points[layout.points("a"), 0].T
        found = pick_freeze(layout, np.arange(metric.size), {"metric": metric.ravel(), "sum": total.ravel()})
        assert np.isfinite(found.first[:, 1]).all()
        for shares in (found.first, found.first_error, found.total, found.total_error):
            assert np.isfinite(shares[:, 0]).all() == told
