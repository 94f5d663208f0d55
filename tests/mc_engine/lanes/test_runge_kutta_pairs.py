"""The tables of the Runge-Kutta pairs, against scipy's and against their own conditions."""

from functools import cache

import numpy as np
import pytest
from scipy.integrate import RK45
from scipy.integrate._ivp import dop853_coefficients as dop853

from mc_engine.lanes.runge_kutta_pairs import DOP853, DP54, PAIRS, TP86


def dense(row, length):
    return np.array([row.get(stage, 0.0) for stage in range(length)])


def test_dop853_has_scipys_coefficients():
    assert DOP853.nodes == tuple(dop853.C[1:12])
    for i, row in enumerate(DOP853.rows, start=1):
        assert (dense(row, 12) == dop853.A[i, :12]).all()
    assert (dense(DOP853.weights, 12) == dop853.B).all()
    assert (dense(DOP853.error, 13) == dop853.E5).all()
    assert (dense(DOP853.second_error, 13) == dop853.E3).all()


def test_dp54_has_scipys_coefficients():
    assert DP54.nodes == tuple(RK45.C[1:])
    for i, row in enumerate(DP54.rows, start=1):
        assert dense(row, 5) == pytest.approx(RK45.A[i], rel=1e-15)
    assert dense(DP54.weights, 6) == pytest.approx(RK45.B, rel=1e-15)
    assert np.abs(dense(DP54.error, 7)) == pytest.approx(np.abs(RK45.E), rel=1e-13)


def grown(tree):
    """The rooted trees with one leaf more; a tree is the sorted tuple of the trees on its root."""
    yield tuple(sorted((*tree, ())))
    for i, branch in enumerate(tree):
        for larger in grown(branch):
            yield tuple(sorted((*tree[:i], larger, *tree[i + 1 :])))


@cache
def trees(order):
    """Rooted trees with so many nodes."""
    return {()} if order == 1 else {larger for tree in trees(order - 1) for larger in grown(tree)}


def size(tree):
    """Number of nodes."""
    return 1 + sum(map(size, tree))


def density(tree):
    """Product of the sizes of all its subtrees, itself included."""
    return size(tree) * float(np.prod([density(branch) for branch in tree]))


def at_stages(tree, matrix):
    """Elementary weight of a tree at each stage."""
    values = np.ones(len(matrix))
    for branch in tree:
        values = values * (matrix @ at_stages(branch, matrix))
    return values


def condition(pair, weights, order):
    """Largest violation of the conditions of one order: E. Hairer, S. Norsett, G. Wanner, Theorem II.2.13."""
    stages = len(pair.nodes) + 1
    matrix = np.array([dense({}, stages), *(dense(row, stages) for row in pair.rows)])
    return max(abs(weights @ at_stages(tree, matrix) - 1.0 / density(tree)) for tree in trees(order))


@pytest.mark.parametrize("pair", PAIRS.values(), ids=PAIRS)
def test_a_pair_has_its_order_and_no_more(pair):
    assert [len(trees(order)) for order in range(1, 10)] == [1, 1, 2, 4, 9, 20, 48, 115, 286]
    weights = dense(pair.weights, len(pair.nodes) + 1)
    assert max(condition(pair, weights, order) for order in range(1, pair.order + 1)) < 1e-13
    assert condition(pair, weights, pair.order + 1) > 1e-7


def test_tp86_estimates_by_a_method_of_order_six():
    weights = dense(TP86.weights, 12) - dense(TP86.error, 12)
    assert max(condition(TP86, weights, order) for order in range(1, 7)) < 1e-13
    assert condition(TP86, weights, 7) > 1e-6
