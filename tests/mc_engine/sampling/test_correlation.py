import numpy as np
import pytest
from scipy.stats import spearmanr

from mc_engine.sampling.correlation import (
    gaussian_copula,
    group_matrix,
    iman_conover,
    is_positive_definite,
)
from mc_engine.sampling.streams import uniforms

TARGET = np.array([[1.0, 0.7, -0.3], [0.7, 1.0, 0.2], [-0.3, 0.2, 1.0]])


def _independent(n_cases, n_columns=3):
    return [uniforms(1, f"column {k}", np.arange(n_cases)) for k in range(n_columns)]


def _hypercube(n_cases, n_columns=3):
    return [(np.argsort(u) + 0.5) / n_cases for u in _independent(n_cases, n_columns)]


def test_the_matrix_of_a_group_has_its_members_in_their_order_whichever_way_pairs_are_written():
    members, matrix = group_matrix(("a", "b", "c", "d"), [("d", "a", 0.5), ("a", "c", -0.3)])
    assert members == (0, 2, 3)
    assert matrix.tolist() == [[1.0, -0.3, 0.5], [-0.3, 1.0, 0.0], [0.5, 0.0, 1.0]]


def test_the_copula_reaches_the_rank_correlations_asked_for():
    u = gaussian_copula(_independent(200_000), TARGET)
    assert spearmanr(np.column_stack(u)).statistic == pytest.approx(TARGET, abs=0.01)


def test_the_copula_keeps_each_column_uniform():
    for u in gaussian_copula(_independent(200_000), TARGET):
        assert np.histogram(u, bins=10, range=(0.0, 1.0))[0] == pytest.approx([20_000] * 10, rel=0.03)


def test_the_copula_works_on_each_case_for_itself():
    columns = _independent(1000)
    whole = gaussian_copula(columns, TARGET)
    for case in (0, 17, 999):
        alone = gaussian_copula([u[case : case + 1] for u in columns], TARGET)
        assert [float(u[0]) for u in alone] == [float(u[case]) for u in whole]


def test_iman_and_conover_reach_the_rank_correlations_with_few_cases():
    u = iman_conover(_hypercube(200), TARGET)
    # Scores, not ranks, are matched exactly; on 200 cases the ranks follow within a few hundredths.
    assert spearmanr(np.column_stack(u)).statistic == pytest.approx(TARGET, abs=0.03)


def test_iman_and_conover_only_pair_the_values_anew():
    columns = _hypercube(500)
    mixed = iman_conover(columns, TARGET)
    assert mixed[0] is columns[0]
    assert all(np.sort(ours).tolist() == np.sort(theirs).tolist() for ours, theirs in zip(mixed, columns, strict=True))


def test_three_dispersions_cannot_all_oppose_each_other():
    assert is_positive_definite(TARGET)
    assert not is_positive_definite(np.array([[1.0, -0.6, -0.6], [-0.6, 1.0, -0.6], [-0.6, -0.6, 1.0]]))
    assert not is_positive_definite(np.array([[1.0, 1.0], [1.0, 1.0]]))
