"""Rank (Spearman) correlation between dispersions, imposed on their uniform numbers before the quantile functions.

`gaussian_copula` works case by case, and is for designs that can be extended.  `iman_conover` reorders the columns of a
whole Latin hypercube, which keeps its strata.  Neither changes the first column or a dispersion without a correlation.
Rank correlations do not depend on the distributions, so these may be any.
"""

import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np

# Below this least eigenvalue the target is singular for the digits people write in a file.
_LEAST_EIGENVALUE = 1e-8


def normal_correlation(rank: np.ndarray) -> np.ndarray:
    """Correlation of normal deviates whose Spearman correlation is `rank`: 2 sin(pi rank / 6).

    Pearson, Mathematical contributions to the theory of evolution XVI (1907); Kruskal, J. Am. Stat. Assoc.
    53 (1958), 814-861.
    """
    return 2.0 * np.sin(math.pi * np.asarray(rank) / 6.0)


def group_matrix(names: Sequence[str], pairs: Iterable[tuple[str, str, float]]) -> tuple[tuple[int, ...], np.ndarray]:
    """(members, matrix): indices in `names` of all correlated ones, in that order, and their rank correlations.

    Pairs that are not given are uncorrelated.
    """
    pairs = list(pairs)
    touched = {name for first, second, _ in pairs for name in (first, second)}
    members = tuple(place for place, name in enumerate(names) if name in touched)
    row = {names[place]: k for k, place in enumerate(members)}
    matrix = np.eye(len(members))
    for first, second, rank in pairs:
        matrix[row[first], row[second]] = matrix[row[second], row[first]] = rank
    return members, matrix


def correlated(
    method: Callable[[list[np.ndarray], np.ndarray], list[np.ndarray]],
    columns: list[np.ndarray],
    names: Sequence[str],
    pairs: Iterable[tuple[str, str, float]],
) -> list[np.ndarray]:
    """The columns, with those of correlated names changed by `method`, `gaussian_copula` or `iman_conover`."""
    members, matrix = group_matrix(names, pairs)
    if members:
        for place, column in zip(members, method([columns[place] for place in members], matrix), strict=True):
            columns[place] = column
    return columns


def _normal_matrix(rank_matrix: np.ndarray) -> np.ndarray:
    matrix = normal_correlation(rank_matrix)
    np.fill_diagonal(matrix, 1.0)  # which the sine gives to the last digits only
    return matrix


def is_positive_definite(rank_matrix: np.ndarray) -> bool:
    """True where normal deviates with these rank correlations exist."""
    return bool(np.linalg.eigvalsh(_normal_matrix(rank_matrix))[0] > _LEAST_EIGENVALUE)


def _mix(factor: np.ndarray, columns: list[np.ndarray]) -> list[np.ndarray]:
    """factor @ columns, row by row, because a library's product rounds differently for one case and for many."""
    mixed = []
    for row in range(len(columns)):
        total = factor[row, 0] * columns[0]
        for k in range(1, row + 1):
            total = total + factor[row, k] * columns[k]
        mixed.append(total)
    return mixed


def gaussian_copula(u: list[np.ndarray], rank_matrix: np.ndarray) -> list[np.ndarray]:
    """Uniform numbers with these rank correlations, from independent ones; each case separately."""
    from scipy.special import ndtr, ndtri

    factor = np.linalg.cholesky(_normal_matrix(rank_matrix))
    deviates = [ndtri(np.clip(column, 2.0**-54, 1.0 - 2.0**-53)) for column in u]
    mixed = _mix(factor, deviates)
    # A row without partners before it is left alone: ndtr(ndtri(u)) is u only to the last digits.
    return [u[k] if factor[k, k] == 1.0 else ndtr(mixed[k]) for k in range(len(u))]


def iman_conover(u: list[np.ndarray], rank_matrix: np.ndarray) -> list[np.ndarray]:
    """The columns of a whole design, reordered to these rank correlations; each keeps its set of values.

    Needs more cases than columns.
    Iman & Conover, A distribution-free approach to inducing rank correlation among input variables, Commun.
    Stat. B 11 (1982), 311-334, with van der Waerden scores and the correction for their sample correlation.
    """
    from scipy.special import ndtri

    n_cases = u[0].size
    ranks = [_ranks(column) for column in u]
    scores = [ndtri((rank + 1.0) / (n_cases + 1.0)) for rank in ranks]
    present = np.linalg.cholesky(_sample_correlation(scores))
    factor = np.linalg.cholesky(_normal_matrix(rank_matrix)) @ np.linalg.inv(present)
    mixed = _mix(factor, scores)
    return [u[0], *(np.sort(u[k])[_ranks(mixed[k])] for k in range(1, len(u)))]


def _ranks(column: np.ndarray) -> np.ndarray:
    ranks = np.empty(column.size, dtype=np.int64)
    ranks[np.argsort(column, kind="stable")] = np.arange(column.size)
    return ranks


def _sample_correlation(scores: list[np.ndarray]) -> np.ndarray:
    # Scores are a permutation of one symmetric set: mean zero and one common sum of squares.
    squares = np.sum(scores[0] * scores[0])
    matrix = np.eye(len(scores))
    for i in range(len(scores)):
        for j in range(i):
            matrix[i, j] = matrix[j, i] = np.sum(scores[i] * scores[j]) / squares
    return matrix
