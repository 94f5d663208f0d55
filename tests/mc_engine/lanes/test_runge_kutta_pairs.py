"""The tables of the Runge-Kutta pairs, against scipy's and against their own conditions."""

import numpy as np
import pytest
from scipy.integrate import RK45
from scipy.integrate._ivp import dop853_coefficients as dop853

from mc_engine.lanes.runge_kutta_pairs import DOP853, DP54


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
