"""The filter against matrices, and its own account of its errors against the errors."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from servicing_twin import MU, R0, RATE

from campaigns.geo_servicing.corrections import Burn
from campaigns.geo_servicing.navigation import Error, Estimate, burnt, fixed, hill, propagated, single_fix

ORDER = [(0, 0), (0, 1), (0, 2), (0, 3), (1, 1), (1, 2), (1, 3), (2, 2), (2, 3), (3, 3)]
SIGMAS = np.array([10.0, 10.0, 0.1, 0.1])  # of a fix [m, m/s]


def matrix(e):
    """Covariance float64[4, 4] of one estimate."""
    out = np.zeros((4, 4))
    for (i, j), value in zip(ORDER, e[4:], strict=True):
        out[i, j] = out[j, i] = value
    return out


def estimate(error, covariance):
    return Estimate(*error, *(covariance[i, j] for i, j in ORDER))


def transition(t):
    """Columns of Hill's solution, float64[4, 4]."""
    columns = [hill(*np.eye(4)[k], np.sin(RATE * t), np.cos(RATE * t), t) for k in range(4)]
    return np.array(columns).T


def some_estimate(seed):
    rng = np.random.default_rng(seed)
    scale = np.diag([10.0, 30.0, 1e-3, 5e-4])
    half = rng.normal(size=(4, 4))
    return estimate(scale @ rng.normal(size=4), scale @ (half @ half.T) @ scale)


def circular(angle, deviation):
    """State in the plane, of a deviation along the turning axes at this angle."""
    c, s = np.cos(angle), np.sin(angle)
    axes = np.array([[c, -s], [s, c]])
    return axes @ [R0 + deviation[0], deviation[1]], axes @ [deviation[2], R0 * RATE + deviation[3]]


def test_hills_solution_is_what_a_point_mass_does_to_a_small_deviation():
    deviation, t = np.array([20.0, -50.0, 2e-3, -1e-3]), 20_000.0

    def fly(y):
        def rates(_, s):
            return [*s[2:], *(-MU * s[:2] / np.hypot(*s[:2]) ** 3)]

        return solve_ivp(rates, (0.0, t), y, "DOP853", rtol=1e-13, atol=1e-9).y[:, -1]

    moved = fly(np.concatenate(circular(0.0, deviation))) - fly(np.concatenate(circular(0.0, np.zeros(4))))
    c, s = np.cos(RATE * t), np.sin(RATE * t)
    back = np.array([[c, s], [-s, c]])
    expected = np.concatenate([back @ moved[:2], back @ moved[2:]])
    assert transition(t) @ deviation == pytest.approx(expected, rel=1e-4, abs=1e-7)


@pytest.mark.parametrize("seed", range(4))
def test_propagation_is_that_of_matrices(seed):
    e, t, noise = some_estimate(seed), 3_600.0, 1e-5
    after, phi = propagated(e, t, noise), transition(3_600.0)
    assert after[:4] == pytest.approx(phi @ e[:4], rel=1e-12)
    expected = phi @ matrix(e) @ phi.T + np.diag([0.0, 0.0, noise**2, noise**2])
    assert matrix(after) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_a_fix_is_the_textbooks_update(seed):
    e, fix = some_estimate(seed), SIGMAS * np.array([0.3, -1.2, 0.7, 1.9])
    gain = matrix(e) @ np.linalg.inv(matrix(e) + np.diag(SIGMAS**2))
    error = e[:4] + gain @ (fix - e[:4])
    after = fixed(e, Error(*fix), 10.0, 0.1)
    assert after[:4] == pytest.approx(error, rel=1e-8)
    assert matrix(after) == pytest.approx((np.eye(4) - gain) @ matrix(e), rel=1e-7, abs=1e-18)


def test_a_burn_adds_what_it_did_differently():
    e, settings = some_estimate(1), SimpleNamespace(thrust=2.0, assumed_thrust=0.005, assumed_pointing=0.01)
    after = burnt(e, Burn(dv=-3.0, outward=0.02, ahead=-1.96, across=0.5), settings)
    assert after.u == pytest.approx(e.u - 0.03)
    assert after.w == pytest.approx(e.w - 0.06)
    assert after.puu - e.puu == pytest.approx(0.03**2)
    assert after.pww - e.pww == pytest.approx(0.015**2)


def two_days_of_fixes(seed, n):
    """The estimates of n filters after two days of hourly fixes."""
    rng = np.random.default_rng(seed)

    def fix():
        return Error(*(SIGMAS[:, None] * rng.normal(size=(4, n))))

    e = single_fix(fix(), 10.0, 0.1)
    for _ in range(48):
        e = fixed(propagated(e, 3_600.0, 0.0), fix(), 10.0, 0.1)
    return e


def test_the_filter_knows_its_errors():
    """Error squared over covariance is four on average."""
    e = two_days_of_fixes(5, 2000)
    errors, covariance = np.array(e[:4]), matrix([np.mean(x) for x in e])
    size = np.einsum("in,ij,jn->n", errors, np.linalg.inv(covariance), errors)
    assert size.mean() == pytest.approx(4.0, abs=0.3)


def test_two_days_of_fixes_bring_a_tenth_of_a_metre_per_second_to_a_few_tenths_of_a_millimetre():
    e = two_days_of_fixes(6, 500)
    assert np.std(e.w) < 3e-4
    assert np.std(e.w) * 0.35126 < 2e-4  # deg/rev
