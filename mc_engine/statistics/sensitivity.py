"""Sensitivity of a metric to the inputs, from the cases of a run: no further flights, any random design and dimension.

spearman     rank correlation: a monotonic trend of any shape
src          standardised regression coefficient: change of the metric in standard deviations per standard deviation of
             the input, others fixed; for independent inputs and r_squared near 1, src**2 is the fraction of variance
prcc         partial rank correlation: the monotonic trend without the (linear) effect of the other ranks
first_order  Var(E[metric | input]) / Var(metric): first-order Sobol' index, for effects of any shape; over independent
             inputs, 1 minus the sum of the indices is due to interactions
total        E[Var(metric | all other inputs)] / Var(metric): effect of the input alone and with others (total Sobol'
             index), from a surrogate (`total_order`) of at least 200 cases; NaN for correlated inputs, for which it has
             no such meaning, and where most of the variance is that of fewer than 40 cases, such as a rare flag's: two
             of three inputs without effect had one

For correlated inputs, src and prcc separate the inputs as far as the cases allow, while spearman and first_order
include effects of the inputs with which one is correlated.  first_order and total have standard errors for independent
cases (`mc`); `lhs` and `sobol` scatter less.  NaN: not defined, or too few cases.

Saltelli et al., Global Sensitivity Analysis: The Primer (2008), ch. 1 (SRC, first-order index); Marino et al.,
J. Theor. Biol. 254 (2008), 178-196 (PRCC).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mc_engine.statistics.first_order import first_orders, standardised
from mc_engine.statistics.input_columns import (
    InputColumn,
    average_ranks,
    beyond_chance,
    finite_rows,
    input_columns,
    rank_correlations,
)
from mc_engine.statistics.moments import near_one, varying_rows
from mc_engine.statistics.total_order import FEWEST_CASES as FEWEST_OF_TOTALS
from mc_engine.statistics.total_order import total_order

FEWEST_CASES = 20
FEWEST_VARYING = 40  # that make up most of a variance of which there are total effects
_INDICES = ("spearman", "src", "prcc", "first_order", "first_order_error", "total", "total_error")


@dataclass(frozen=True)
class Sensitivity:
    """Indices and standard errors, float64[n_inputs, n_metrics]; n_used int64[n_metrics] of n_tried cases.

    r_squared : float64[n_metrics], fraction of variance that the linear regression of `src` explains.
    unexplained : float64[n_metrics], fraction that the surrogate of `total` leaves; total may be larger by it.
    correlated : the two inputs with the strongest rank correlation, and its value; None for too few cases, and where no
        two inputs with an order (numbers, or two levels) are correlated, not even by chance.
    """

    inputs: tuple[str, ...]
    metrics: tuple[str, ...]
    n_used: np.ndarray
    n_tried: int
    spearman: np.ndarray
    src: np.ndarray
    prcc: np.ndarray
    first_order: np.ndarray
    first_order_error: np.ndarray
    total: np.ndarray
    total_error: np.ndarray
    r_squared: np.ndarray
    unexplained: np.ndarray
    correlated: tuple[str, str, float] | None


class _Fit(NamedTuple):
    """A regression of standardised metrics on standardised columns.

    coefficient : float64[n_columns, n_metrics];  partial : partial correlations, likewise;  r_squared : [n_metrics]
    """

    coefficient: np.ndarray
    partial: np.ndarray
    r_squared: np.ndarray


def sensitivity(inputs: Mapping[str, Any], metrics: Mapping[str, np.ndarray], *, sobol: bool = False) -> Sensitivity:
    """Indices of every input and metric.  inputs : numbers, switches or words; metrics : float64[n], NaN where none.

    sobol : the cases are Sobol' points.

    A case counts for a metric if it has a number there and in all inputs.  An input with more than two words has only a
    first-order index, and is held constant in the regressions.
    """
    columns = input_columns(inputs)
    names = tuple(metrics)
    table = np.column_stack([np.asarray(metrics[name], dtype=np.float64) for name in names]) if names else None
    tried = len(next(iter([*metrics.values(), *inputs.values()]), ()))
    shape = (len(columns), len(names))
    indices: dict[str, np.ndarray] = {index: np.full(shape, np.nan) for index in _INDICES}
    indices |= {share: np.full(len(names), np.nan) for share in ("r_squared", "unexplained")}
    n_used = np.zeros(len(names), dtype=np.int64)
    strongest = _strongest_correlation(columns, tried)
    independent = strongest is None or not beyond_chance(strongest[2], tried)
    if table is not None and columns:
        used = np.isfinite(table) & finite_rows(columns, tried)[:, None]
        n_used[:] = used.sum(axis=0)
        # Most metrics are numbers in the same cases, so that inputs are ranked and sorted once for all of them.
        _, pattern = np.unique(used, axis=1, return_inverse=True)
        for group in np.unique(pattern):
            where = np.flatnonzero(pattern == group)
            rows = np.flatnonzero(used[:, where[0]])
            part, _ = near_one(table[np.ix_(rows, where)])
            _fill(indices, [column.at(rows) for column in columns], part, where, independent, sobol)
    return Sensitivity(tuple(inputs), names, n_used, int(tried), correlated=strongest, **indices)


def _fill(
    indices: dict[str, np.ndarray],
    columns: Sequence[InputColumn],
    table: np.ndarray,
    where: np.ndarray,
    independent: bool,
    sobol: bool,
) -> None:
    """The indices of the metrics at `where`, whose numbers `table` (float64[n_used, len(where)]) holds, all finite."""
    n = len(table)
    live = [k for k, column in enumerate(columns) if column.varies]
    moving = np.ptp(table, axis=0) > 1e-12 * np.abs(table).max(axis=0) if n >= FEWEST_CASES else np.zeros(0, dtype=bool)
    if not live or not moving.any():
        return
    varying, where = table[:, moving], where[moving]
    alive = np.ix_(np.array(live), where)
    moved = [columns[k] for k in live]
    indices["first_order"][alive], indices["first_order_error"][alive] = first_orders(moved, varying, sobol)
    spread = np.array([varying_rows(column[:, None]) >= FEWEST_VARYING for column in standardised(varying).T])
    if independent and n >= FEWEST_OF_TOTALS and spread.any():
        place = np.ix_(np.array(live), where[spread])
        indices["total"][place], indices["total_error"][place], indices["unexplained"][where[spread]] = total_order(
            moved, varying[:, spread]
        )
    ordered = [k for k in live if columns[k].ordered]
    if not ordered:
        return
    unordered = [columns[k].values for k in live if not columns[k].ordered]
    groups = [(values == level).astype(np.float64) for values in unordered for level in np.unique(values)[1:]]
    place = np.ix_(np.array(ordered), where)
    plain = np.column_stack([columns[k].values for k in ordered])
    ranks, metric_ranks = average_ranks(plain), average_ranks(varying)
    indices["spearman"][place] = standardised(ranks).T @ standardised(metric_ranks) / n
    fit = _regression(np.column_stack([plain, *groups]), varying)
    if fit is not None:
        indices["src"][place] = fit.coefficient[: len(ordered)]
        indices["r_squared"][where] = fit.r_squared
    fit = _regression(np.column_stack([ranks, *groups]), metric_ranks)
    if fit is not None:
        indices["prcc"][place] = fit.partial[: len(ordered)]


def _regression(columns: np.ndarray, table: np.ndarray) -> _Fit | None:
    """Least squares of each metric on all columns; None where the cases are too few for it.

    A column that the others give exactly has no coefficient of its own: NaN.
    """
    n = len(columns)
    x, y = standardised(columns), standardised(table)
    value, vector = np.linalg.eigh(x.T @ x / n)
    null = value < 1e-10 * value[-1]
    if n - 1 - np.count_nonzero(~null) < 2:
        return None
    tied = (np.abs(vector[:, null]) > 1e-6).any(axis=1)
    inverse = (vector[:, ~null] / value[~null]) @ vector[:, ~null].T
    correlation = x.T @ y / n
    coefficient = inverse @ correlation
    r_squared = np.clip((coefficient * correlation).sum(axis=0), 0.0, 1.0)
    # Above 0: else rounding would be the whole trend of an input that an exact model does not hold.
    spread = np.maximum(1.0 - r_squared, 1e-12) * np.diag(inverse)[:, None]
    partial = coefficient / np.sqrt(coefficient**2 + spread)
    coefficient[tied] = partial[tied] = np.nan
    return _Fit(coefficient, partial, r_squared)


def _strongest_correlation(columns: Sequence[InputColumn], n: int) -> tuple[str, str, float] | None:
    rows = np.flatnonzero(finite_rows(columns, n))
    rho = np.triu(rank_correlations([column.at(rows) for column in columns]))
    if rows.size < FEWEST_CASES or not rho.any():
        return None
    first, second = np.unravel_index(np.abs(rho).argmax(), rho.shape)
    return columns[first].name, columns[second].name, float(rho[first, second])
