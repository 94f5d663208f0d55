"""The densities of importance sampling: they add up to one, are drawn as they say, and are found again by a fit."""

import math

import numpy as np
import pytest
from scipy import integrate

from mc_engine.statistics.direction_mixture import (
    DirectionMixture,
    fit_mixture,
    log_normal_density,
    log_sphere_factor,
)

TWO = DirectionMixture(
    np.array([0.6, 0.4]), np.array([[1.0, 0.0], [0.0, -1.0]]), np.array([20.0, 5.0]), np.array([15.0, 9.0])
)


def test_the_density_adds_up_to_one():
    def at(y, x):
        return math.exp(TWO.log_density(np.array([[x, y]]))[0])

    assert integrate.dblquad(at, -12, 12, -12, 12, epsabs=1e-5)[0] == pytest.approx(1.0, abs=1e-4)


def test_without_direction_and_with_a_distance_for_each_input_it_is_the_normal_density():
    for n_inputs in (2, 7, 150):
        whole = DirectionMixture(np.ones(1), np.eye(1, n_inputs), np.zeros(1), np.array([float(n_inputs)]))
        u = np.random.default_rng(1).standard_normal((50, n_inputs))
        np.testing.assert_allclose(whole.log_density(u), log_normal_density(u), rtol=1e-12)


def test_draws_have_the_density():
    """The mean of 1 / density over the draws inside a box is the box's area."""
    u = TWO.draw(np.random.default_rng(4), 200_000)
    inside = (np.abs(u - [4.0, 0.0]) < 0.5).all(axis=1)
    area = np.mean(inside * np.exp(-TWO.log_density(u)))
    assert area == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize(("n_inputs", "kappa"), [(2, 3.0), (20, 15.0), (102, 40.0), (300, 200.0)])
def test_the_factor_of_the_sphere_is_that_of_scipy_or_of_the_integral(n_inputs, kappa):
    """Over the cosine to the mean direction the density is exp(kappa c) (1 - c^2)^((n - 3) / 2)."""
    half = 0.5 * (n_inputs - 1)
    log_area = math.log(2.0) + half * math.log(math.pi) - math.lgamma(half)
    cosine = 1.0 - 2.0 * (np.arange(400_000) + 0.5) / 400_000
    logs = kappa * cosine + (half - 1.0) * np.log1p(-cosine * cosine)
    total = logs.max() + math.log(np.exp(logs - logs.max()).sum() * 2.0 / 400_000) + log_area
    assert float(log_sphere_factor(n_inputs, np.array(kappa))) == pytest.approx(-total, abs=2e-3)


def test_a_fit_finds_the_components_and_as_many_as_there_are():
    rng = np.random.default_rng(2)
    fitted = fit_mixture(TWO.draw(rng, 20_000), np.ones(20_000), rng)
    assert fitted.share.size == 3  # two, and the background in all directions
    order = np.argsort(-fitted.share[:2])
    np.testing.assert_allclose(fitted.mean[order], TWO.mean, atol=0.05)
    np.testing.assert_allclose(fitted.kappa[order], TWO.kappa, rtol=0.2)
    np.testing.assert_allclose(fitted.nu[order], TWO.nu, rtol=0.05)
    assert (fitted.kappa[2], fitted.share[2]) == (0.0, pytest.approx(0.1))
    assert fitted.nu[2] == pytest.approx(0.6 * 15.0 + 0.4 * 9.0, rel=0.05)  # as far out as all cases together
