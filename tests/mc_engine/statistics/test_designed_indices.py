"""Saltelli's blocks and Morris's trajectories: the engine's designs, analysed, give the indices of known functions."""

import numpy as np
import pytest

from mc_engine.sampling.designs import unit_cube
from mc_engine.statistics.designed_indices import designed_indices


def flown(design, n_blocks, function, names=("x0", "x1", "x2"), seed=4):
    size = len(names) + (2 if design == "saltelli" else 1)
    cases = np.arange(n_blocks * size)
    x = unit_cube(design, seed, names, cases, cases.size)
    return cases, dict(zip(names, x, strict=True)), function(*x)


def ishigami(*u):
    x, y, z = (np.pi * (2.0 * one - 1.0) for one in u)
    return np.sin(x) + 7.0 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)


def test_saltellis_blocks_give_the_indices_of_ishigami():
    # Ishigami & Homma (1990), a = 7, b = 0.1: first order 0.3139, 0.4424, 0; total 0.5576, 0.4424, 0.2437.
    cases, x, y = flown("saltelli", 2**13, ishigami)
    found = designed_indices("saltelli", cases, x, {"y": y})
    assert found.values["first_order"][:, 0] == pytest.approx([0.3139, 0.4424, 0.0], abs=0.02)
    assert found.values["total"][:, 0] == pytest.approx([0.5576, 0.4424, 0.2437], abs=0.02)
    assert (found.reach["total"] > 0.0).all()
    assert (found.n_used.tolist(), found.n_tried) == ([2**13], 2**13)


def test_morriss_trajectories_give_the_effects_of_a_line_and_a_product():
    # Of 3 x0: each step is 3 times half of the unit interval, over 2/3 of the range between the outer levels.
    cases, x, y = flown("morris", 500, lambda a, b, c: 3.0 * a + 4.0 * b * c)
    found = designed_indices("morris", cases, x, {"y": y})
    mu_star, sigma = found.values["mu_star"][:, 0], found.values["sigma"][:, 0]
    assert mu_star[0] == pytest.approx(3.0 * 0.5 / (2.0 / 3.0), rel=1e-9)
    assert sigma[0] == pytest.approx(0.0, abs=1e-9)
    # Of 4 x1 x2: x2 is one of 1/8, 3/8, 5/8, 7/8, with mean 0.5 and variance 5/64.
    assert mu_star[1] == pytest.approx(4.0 * 0.5 * 0.75, rel=0.06)
    assert sigma[1] == pytest.approx(4.0 * np.sqrt(5.0 / 64.0) * 0.75, rel=0.06)


def test_effects_of_words_have_a_size_and_no_direction():
    """Their sign and their scatter were those of the alphabet: other names of the same levels gave others."""
    cases, x, _ = flown("morris", 50, lambda a, b, c: a)
    level = np.digitize(x["x1"], [1 / 3, 2 / 3])
    y = 3.0 * x["x0"] + np.array([0.0, 1.0, -2.0])[level]
    words = [np.array(names)[level] for names in (["fast", "slow", "coast"], ["slow", "coast", "fast"])]
    found = [designed_indices("morris", cases, {**x, "x1": word}, {"y": y}).values for word in words]
    np.testing.assert_array_equal(found[0]["mu_star"], found[1]["mu_star"])
    for name in ("mu", "sigma"):
        np.testing.assert_array_equal(np.isnan(found[0][name][:, 0]), [False, True, False])
        np.testing.assert_array_equal(found[0][name], found[1][name])
    switch = designed_indices("morris", cases, {**x, "x1": x["x1"] > 0.5}, {"y": y}).values
    assert np.isfinite(switch["mu"]).all()


@pytest.mark.parametrize("design", ["saltelli", "morris"])
def test_a_block_with_a_failed_case_is_left_out_whole_and_counted(design):
    cases, x, y = flown(design, 200, ishigami)
    size = cases.size // 200
    holes = y.copy()
    holes[[5 * size + 1, 9 * size]] = np.nan
    found = designed_indices(design, cases, x, {"y": holes, "whole": y})
    kept = ~np.isin(cases // size, [5, 9])
    alone = designed_indices(design, cases[kept], {k: v[kept] for k, v in x.items()}, {"y": y[kept]})
    assert found.n_used.tolist() == [198, 200]
    for name in found.values:
        assert found.values[name][:, 0] == pytest.approx(alone.values[name][:, 0], rel=1e-12)


@pytest.mark.parametrize("design", ["saltelli", "morris"])
def test_cases_of_an_unfinished_block_do_not_count(design):
    cases, x, y = flown(design, 40, ishigami)
    found = designed_indices(design, cases[:-1], {k: v[:-1] for k, v in x.items()}, {"y": y[:-1]})
    assert (found.n_used.tolist(), found.n_tried) == ([39], 39)


@pytest.mark.parametrize("rest", [0.0, 0.003])
def test_what_few_blocks_make_most_of_the_variance_of_has_no_sobol_indices(rest):
    """Intervals of 90 % of a flag that 3 of 256 blocks have contained its first-order index in 4 of 100 trials."""
    for limit, told in ((1.93, False), (1.6, True)):
        cases, x, raised = flown("saltelli", 256, lambda a, b, c, limit=limit: a + b > limit, seed=5)
        blocks = np.count_nonzero(raised.reshape(256, -1).any(axis=1))
        assert (blocks >= 10) == told
        assert blocks > 0
        found = designed_indices("saltelli", cases, x, {"metric": raised + rest * x["x0"]})
        for index in (found.values, found.reach):
            assert np.isfinite(index["total"]).all() == np.isfinite(index["first_order"]).all() == told
        assert found.n_used.tolist() == [256]
