"""Dispersed inputs as columns of numbers: numbers unchanged, words and switches as the index of their level."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class InputColumn:
    """One dispersed input.

    values : float64[n], the numbers, or the index of each case's level.  levels : the words; empty for numbers.
    """

    name: str
    values: np.ndarray
    levels: tuple[str, ...] = ()

    @property
    def ordered(self) -> bool:
        """Whether the values have an order: numbers, and inputs with two levels."""
        return len(self.levels) in (0, 2)

    @property
    def varies(self) -> bool:
        """Whether the input differs between cases."""
        finite = self.values[np.isfinite(self.values)]
        return bool(finite.size and finite.min() < finite.max())

    def at(self, rows: np.ndarray) -> "InputColumn":
        """The column of the cases in `rows`."""
        return InputColumn(self.name, self.values[rows], self.levels)


def input_columns(inputs: Mapping[str, Any]) -> list[InputColumn]:
    """One column per input: of numbers, of switches (levels "no" and "yes"), or of words (levels in their order)."""
    columns = []
    for name, values in inputs.items():
        array = np.asarray(values)
        if array.dtype.kind in "fiu":
            columns.append(InputColumn(name, array.astype(np.float64)))
        elif array.dtype.kind == "b":
            columns.append(InputColumn(name, array.astype(np.float64), ("no", "yes")))
        else:
            levels, index = np.unique(array.astype(str), return_inverse=True)
            columns.append(InputColumn(name, index.astype(np.float64), tuple(str(level) for level in levels)))
    return columns


def finite_rows(columns: Sequence[InputColumn], n: int) -> np.ndarray:
    """bool[n]: cases with a number, or a level, in every column."""
    rows = np.ones(n, dtype=bool)
    for column in columns:
        rows &= np.isfinite(column.values)
    return rows


def average_ranks(values: np.ndarray) -> np.ndarray:
    """Ranks from 1 of float64[n], or of each column of float64[n, k]; equal values share the middle of theirs.

    `scipy.stats.rankdata`, without the third of a second that `scipy.stats` takes to load.
    """
    if values.ndim == 2:
        return np.column_stack([average_ranks(column) for column in values.T])
    order = np.argsort(values, kind="stable")
    ordered = values[order]
    first = np.flatnonzero(np.concatenate([[True], ordered[1:] != ordered[:-1]])[: values.size])
    sizes = np.diff(first, append=values.size)
    ranks = np.empty(values.size)
    ranks[order] = np.repeat(first + 0.5 * (sizes + 1), sizes)
    return ranks


def rank_correlations(columns: Sequence[InputColumn]) -> np.ndarray:
    """Spearman's correlation of each two inputs, float64[n_columns, n_columns]; 0 with itself, or without an order."""
    found = np.zeros((len(columns), len(columns)))
    usable = [k for k, column in enumerate(columns) if column.ordered and column.varies]
    if len(usable) > 1:
        ranks = average_ranks(np.column_stack([columns[k].values for k in usable]))
        found[np.ix_(usable, usable)] = np.corrcoef(ranks, rowvar=False)
        np.fill_diagonal(found, 0.0)
    return found


def beyond_chance(rank_correlation: Any, n_cases: int) -> Any:
    """Whether a rank correlation is not by chance: five standard errors of the correlation of independent inputs."""
    return abs(rank_correlation) > max(5.0 / np.sqrt(n_cases), 0.05)


def equal_bins(column: InputColumn, bins: int) -> tuple[np.ndarray, int]:
    """Bin of each case (int64[n]) and the number of bins: about equally full, ties together, no bin empty.

    Words, switches, and numbers with at most `bins` different values have a bin for each level or value.
    """
    distinct, index = np.unique(column.values, return_inverse=True)
    if not column.levels and distinct.size > bins:
        place = ((average_ranks(column.values) - 0.5) * bins / column.values.size).astype(np.int64)
        distinct, index = np.unique(place, return_inverse=True)
    return index.astype(np.int64), int(distinct.size)
