import numpy as np
import pytest
from scipy.special import ndtri
from scipy.stats import ttest_ind, ttest_rel

from mc_engine.sampling.designs import unit_cube
from mc_engine.statistics.change_tests import MOST_CASES, metric_change
from mc_engine.statistics.first_order import contributors
from mc_engine.statistics.picked_cases import picked_rows
from mc_engine.statistics.regions import density_regions


def sobol_normals(n):
    return [ndtri(column) for column in unit_cube("sobol", 1, ["a", "b"], np.arange(n), n)]


@pytest.mark.parametrize(("n", "most"), [(10, 10), (3, 10), (0, 5), (7, 3), (32768, 20_000)])
def test_the_rows_ascend_one_from_each_of_equal_stretches(n, most):
    rows = picked_rows(n, most)
    edges = np.linspace(0, n, min(n, most) + 1).astype(int)
    assert ((edges[:-1] <= rows) & (rows < edges[1:])).all()
    assert rows.size == min(n, most)


@pytest.mark.parametrize(("n", "most"), [(4000, 2000), (32768, 20_000), (65536, 20_000), (100_000, 50_000)])
def test_some_of_many_sobol_points_fill_the_range_of_every_input(n, most):
    # every second point lies in one half of the second input, every fourth in one half of the first one, too
    cube = np.array(unit_cube("sobol", 1, list("abcdef"), np.arange(n), n))[:, picked_rows(n, most)]
    assert np.abs((cube < 0.5).mean(axis=1) - 0.5).max() < 0.03


def test_two_equal_inputs_contribute_half_each_to_many_cases_of_a_sobol_design():
    a, b = sobol_normals(32768)
    shares = {one.name: one.share for one in contributors({"a": a, "b": b}, a + b, sobol=True)}
    assert shares == pytest.approx({"a": 0.5, "b": 0.5}, abs=0.02)


def test_the_region_of_half_of_the_cases_holds_half_of_them_in_a_sobol_design():
    region = density_regions(np.column_stack(sobol_normals(4096)), (0.5,))[0]
    assert 0.5 <= region.inside / region.n < 0.54


def test_the_shift_of_many_sobol_cases_is_that_of_all_of_them():
    a, b = sobol_normals(2 * MOST_CASES)
    change = metric_change("y", a + b, a + np.where(b > 0.0, b + 1.0, b), paired=False)
    assert change.shift.value == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize("paired", [True, False])
def test_the_spread_of_very_many_cases_is_that_of_all_of_them(paired):
    """Of forty pairs that differ in a million, the selection has few: their change of spread was not significant."""
    a, rng = np.random.default_rng(1).normal(size=5 * MOST_CASES), np.random.default_rng(2)
    b = a.copy() if paired else rng.normal(size=3 * MOST_CASES)
    few = rng.choice(b.size, 40, replace=False)
    b[few] += 50.0 * np.sign(b[few])
    before, after = (np.abs(values - np.median(values)) for values in (a, b))
    test = ttest_rel(after, before) if paired else ttest_ind(after, before)
    change = metric_change("y", a, b, paired=paired)
    assert change.spread_p == pytest.approx(test.pvalue, rel=1e-6)
    ratio = after.mean() / before.mean()
    assert change.ratio.value == pytest.approx(ratio, rel=1e-9)
    assert change.ratio.lower < ratio < change.ratio.upper
