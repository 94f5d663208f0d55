"""Sensitivity from given cases against closed forms: linear models, Ishigami, Sobol's g, groups, and nothing at all."""

import numpy as np
import pytest
from scipy.stats import rankdata, spearmanr

from mc_engine.sampling.designs import unit_cube
from mc_engine.sampling.streams import uniforms
from mc_engine.statistics.first_order import contributors, first_order
from mc_engine.statistics.input_columns import beyond_chance, input_columns
from mc_engine.statistics.sensitivity import sensitivity

N = 2**13


def draws(count, n=N, seed=3):
    return [uniforms(seed, f"x{k}", np.arange(n)) for k in range(count)]


def named(columns):
    return {f"x{k}": column for k, column in enumerate(columns)}


def test_squared_coefficients_of_a_linear_model_are_its_shares_of_variance():
    x = draws(3)
    y = 3.0 * x[0] - 2.0 * x[1] + 1e9
    indices = sensitivity(named(x), {"y": y})
    wanted = np.array([3.0 * x[0].std(), -2.0 * x[1].std(), 0.0]) / y.std()
    assert indices.src[:, 0] == pytest.approx(wanted, abs=1e-6)
    assert indices.r_squared[0] == pytest.approx(1.0, abs=1e-9)
    assert indices.src[:, 0] ** 2 == pytest.approx([9 / 13, 4 / 13, 0.0], abs=0.03)  # the draws' own covariance
    assert indices.prcc[:2, 0] == pytest.approx([1.0, -1.0], abs=0.1)


def test_trends_are_those_of_scipy_least_squares_and_the_inverse_correlation_of_ranks():
    """Of noisy cases with correlated inputs; partial correlation -P_ij / sqrt(P_ii P_jj) of the precision matrix."""
    a, b, c, noise = np.random.Generator(np.random.Philox(key=2)).normal(size=(4, 60))
    x = np.column_stack([a, b + 0.5 * a, c])
    y = np.exp(x @ [0.5, -0.3, 0.0] + 0.4 * noise)
    found = sensitivity(named(x.T), {"y": y, "again": y, "other": noise})
    slope, left, *_ = np.linalg.lstsq(x - x.mean(axis=0), y - y.mean())
    ranks = rankdata(np.column_stack([x, y]), axis=0)
    precision = np.linalg.inv(np.corrcoef(ranks.T))
    assert found.src[:, 0] == pytest.approx(slope * x.std(axis=0) / y.std(), rel=1e-9)
    assert found.r_squared[0] == pytest.approx(1.0 - left[0] / (y.size * y.var()), rel=1e-9)
    assert found.spearman[:, 0] == pytest.approx([spearmanr(column, y).statistic for column in x.T], rel=1e-9)
    assert found.prcc[:, 0] == pytest.approx(-precision[:3, 3] / np.sqrt(precision.diagonal()[:3] * precision[3, 3]))
    assert found.prcc[:, 1] == pytest.approx(found.prcc[:, 0], rel=1e-12)


def test_inputs_are_correlated_beyond_five_standard_errors_and_a_twentieth():
    found = [beyond_chance(*pair) for pair in ((0.49, 100), (-0.51, 100), (0.04, 40_000), (0.06, 40_000))]
    assert found == [False, True, False, True]


def test_an_input_or_a_metric_that_does_not_vary_has_no_index_and_changes_none():
    (a,), noise = draws(1, 300), draws(2, 300)[1]
    alone = sensitivity({"a": a}, {"y": a + noise})
    found = sensitivity({"same": np.full(300, 7.0), "a": a}, {"y": a + noise, "constant": np.full(300, 0.1)})
    for index in ("spearman", "src", "prcc", "first_order", "first_order_error", "total", "total_error"):
        values = getattr(found, index)
        assert values[1, 0] == pytest.approx(getattr(alone, index)[0, 0], rel=1e-9), index
        assert np.isnan([*values[0], values[1, 1]]).all(), index
    assert found.correlated is None


def test_contributors_come_strongest_first_and_without_a_share_where_nothing_can_be_told():
    (weak, strong), same = draws(2, 400), np.full(400, 7.0)
    inputs, y = {"weak": weak, "same": same, "strong": strong}, weak + 3.0 * strong
    y[5] = np.nan
    found = contributors(inputs, y)
    assert [one.name for one in found] == ["strong", "weak"]
    assert [one.share for one in found] == pytest.approx([0.9, 0.1], abs=0.04)
    for few in (np.where(np.arange(400) < 19, y + 0.0, np.nan), np.where(np.isfinite(y), 0.1, np.nan)):
        untold = contributors(inputs, few)
        assert [one.name for one in untold] == ["weak", "strong"]
        assert np.isnan([one.share for one in untold]).all()
    assert np.isnan(first_order(*input_columns({"same": same}), strong[:, None])).all()


def test_first_order_indices_of_ishigami_lie_within_two_hundredths():
    # Ishigami & Homma (1990), a = 7, b = 0.1 on (-pi, pi): 0.3139, 0.4424, 0 (Saltelli et al., The Primer, p. 196).
    x = [np.pi * (2.0 * u - 1.0) for u in draws(3)]
    y = np.sin(x[0]) + 7.0 * np.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * np.sin(x[0])
    indices = sensitivity(named(x), {"y": y})
    assert indices.first_order[:, 0] == pytest.approx([0.3139, 0.4424, 0.0], abs=0.02)
    # x2 is even about the middle: no trend shows it
    assert abs(indices.spearman[1, 0]) < 4.0 / np.sqrt(N)
    assert abs(indices.prcc[1, 0]) < 4.0 / np.sqrt(N)


def test_first_order_indices_of_sobols_g_lie_within_two_hundredths():
    # Sobol', Math. Comput. Simul. 55 (2001), 271-280: V_i = 1/(3 (1 + a_i)^2), V = prod(1 + V_i) - 1.
    a = np.array([0.0, 1.0, 4.5, 9.0])
    x = draws(4)
    y = np.prod([(np.abs(4.0 * u - 2.0) + k) / (1.0 + k) for u, k in zip(x, a, strict=True)], axis=0)
    partial = 1.0 / (3.0 * (1.0 + a) ** 2)
    assert sensitivity(named(x), {"y": y}).first_order[:, 0] == pytest.approx(
        partial / (np.prod(1.0 + partial) - 1.0), abs=0.02
    )


def test_the_standard_errors_are_the_scatter_over_many_samples():
    results = []
    for seed in range(200):
        x = draws(2, 400, seed)
        results.append(sensitivity(named(x), {"y": x[0] + (x[1] - 0.5) ** 2 + 0.3 * draws(3, 400, seed)[2]}))
    values = np.array([result.first_order[:, 0] for result in results])
    told = np.mean([result.first_order_error[:, 0] for result in results], axis=0)
    ratio = told / values.std(axis=0)  # of an index near 0, the error is sqrt(2) too large
    assert ((ratio > 0.8) & (ratio < 1.7)).all(), ratio


def test_words_and_switches_enter_as_groups():
    u, v, w = draws(3)
    word = np.array(["aim", "coast", "burn"], dtype=object)[(3.0 * u).astype(int)]
    level = np.array([0.0, 5.0, 1.0])[(3.0 * u).astype(int)]
    indices = sensitivity({"word": word, "switch": v > 0.5, "x": w}, {"y": level + 2.0 * (v > 0.5) + w})
    parts = np.array([np.var([0.0, 5.0, 1.0]), 1.0, 1.0 / 12.0])
    assert indices.first_order[:, 0] == pytest.approx(parts / parts.sum(), abs=0.02)
    assert np.isnan(indices.src[0, 0])  # three words have no order
    assert indices.src[1, 0] == pytest.approx(np.sqrt(parts[1] / parts.sum()), abs=0.02)
    assert indices.r_squared[0] == pytest.approx(1.0, abs=1e-9)  # the group is held constant by the regression


def test_inputs_that_give_each_other_have_no_coefficient_of_their_own():
    x, y, noise = draws(3)
    indices = sensitivity({"x": x, "again": 2.0 * x + 1.0, "y": y}, {"m": x + y + noise})
    assert np.isnan(indices.src[:2, 0]).all()
    assert np.isfinite(indices.src[2, 0])
    assert indices.first_order[0, 0] == pytest.approx(indices.first_order[1, 0], abs=1e-9)
    assert indices.correlated == ("x", "again", pytest.approx(1.0))


def test_cases_without_a_number_are_counted_and_change_nothing_else():
    x = draws(2, 500)
    lost = np.arange(500) % 7 == 0
    y = x[0] + x[1] ** 2
    indices = sensitivity(named(x), {"y": np.where(lost, np.nan, y), "whole": y})
    alone = sensitivity(named([u[~lost] for u in x]), {"y": y[~lost]})
    assert indices.n_used.tolist() == [int((~lost).sum()), 500]
    assert indices.n_tried == 500
    for index in ("spearman", "src", "prcc", "first_order"):
        assert getattr(indices, index)[:, 0] == pytest.approx(getattr(alone, index)[:, 0], rel=1e-12)


@pytest.mark.parametrize("n", [100, 1000])
def test_the_interval_of_a_first_order_index_covers_the_true_one(n):
    """The interval of 90 % in 200 campaigns; bins without slopes covered an index of 1 never, one of 0.8 in 60 %."""
    truths = {"all of it": 1.0, "linear": 4.0 / 5.25, "noisy": 0.8}
    covered = {name: [] for name in truths}
    for seed in range(200):
        a, b, c, noise = np.random.Generator(np.random.Philox(key=seed)).normal(size=(4, n))
        metrics = {"all of it": 1e-12 * (1.0 + 0.1 * a), "linear": 2.0 * a + b + 0.5 * c, "noisy": a + 0.5 * noise}
        table = np.column_stack([*metrics.values()])
        share, error = first_order(*input_columns({"a": a}), table)
        for name, index, reach in zip(metrics, share, 1.645 * error, strict=True):
            covered[name].append(abs(index - truths[name]) <= reach + 1e-9)
    assert min(np.mean(hits) for hits in covered.values()) > 0.8


def test_a_number_of_few_values_is_as_good_as_their_names():
    step, noise = (draws(2, 700)[0] * 7).astype(int), draws(2, 700)[1]
    values, names = np.array([0.1, 0.3, 0.7, 1.1, 1.3, 1.7, 1.9])[step], np.array(list("abcdefg"))[step]
    (table,) = (np.sin(5.0 * values) + noise)[None, :, None]
    by_value, by_name = (first_order(*input_columns({"x": x}), table) for x in (values, names))
    assert by_value[0] == pytest.approx(by_name[0], rel=1e-12)


@pytest.mark.parametrize(("n", "count"), [(1000, 24), (2048, 10)])
def test_inputs_without_effect_have_no_first_order_index_among_sobol_points(n, count):
    names = [f"x{k}" for k in range(count)]
    points = dict(zip(names, unit_cube("sobol", 1, names, np.arange(n), n), strict=True))
    waves = {name: np.cos(2.0 * np.pi * points[name]) + 0.5 * points["x0"] for name in names[1:]}
    found = sensitivity(points, waves, sobol=True).first_order
    wave, line = 0.5 / (0.5 + 0.25 / 12.0), 0.25 / 12.0 / (0.5 + 0.25 / 12.0)
    true = np.vstack([np.full(count - 1, line), wave * np.eye(count - 1)])
    assert np.abs(found - true).max() < 0.03
    by_bins = sensitivity(points, waves).first_order  # those of the bins alone
    assert (by_bins - true).max() > 0.1
    assert contributors(points, waves["x3"], sobol=True)[0].name == "x3"


def test_a_correlated_input_keeps_what_it_owes_to_its_correlation_among_sobol_points():
    n = 2048
    a, b = unit_cube("sobol", 1, ["a", "b"], np.arange(n), n, (("a", "b", 0.7),))
    (first, second) = sensitivity({"a": a, "b": b}, {"y": a}, sobol=True).first_order[:, 0]
    assert first == pytest.approx(1.0, abs=1e-3)
    assert second > 0.4
    assert second == pytest.approx(sensitivity({"a": a, "b": b}, {"y": a}).first_order[1, 0])


@pytest.mark.parametrize("rest", [0.0, 0.003])
def test_what_few_cases_make_most_of_the_variance_of_has_no_total_effects(rest):
    """Of a flag that one case of a hundred has, two of three inputs without effect had one, of up to 0.66."""
    draw = np.random.default_rng(1)
    inputs = {name: draw.normal(size=1000) for name in "xabcde"}
    x = inputs["x"]
    metrics = {"rare": (x > 2.33) + rest * x, "frequent": (x > 1.28) + rest * x, "plain": x + inputs["a"]}
    found = sensitivity(inputs, metrics)
    assert np.isfinite(found.total).all(axis=0).tolist() == [False, True, True]
    assert np.isnan(found.total[:, 0]).all()
    assert np.isnan([found.unexplained[0], *found.total_error[:, 0]]).all()
    assert np.isfinite(found.first_order).all()
