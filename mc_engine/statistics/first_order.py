"""First-order Sobol' indices from any random cases: variance of a metric between the bins of an input.

`contributors` ranks the inputs of a metric by them.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy  # loads its packages when they are used

from mc_engine.statistics.input_columns import (
    InputColumn,
    beyond_chance,
    equal_bins,
    finite_rows,
    input_columns,
    rank_correlations,
)
from mc_engine.statistics.picked_cases import picked_rows

MOST_BINS = 100
FEWEST_CASES = 20
MOST_CASES = 20_000  # above, so many are picked evenly
_ROUNDING = 1e-24  # of a bin's variance: what remains of equal values
_SURE = 3.0  # standard errors
_LEFT = 1e-9  # of a metric's standard deviation: what rounding leaves where the other inputs explain all


def first_order(column: InputColumn, table: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First-order index and its standard error per metric (columns of `table`, float64[n, n_metrics], finite).

    The index is 1 minus the residual variance about a straight line in each bin of the input, or about the mean of each
    level of words or switches, with the degrees of freedom subtracted (Kelley's ε², Proc. Natl. Acad. Sci. 21 (1935),
    554-559), so it may be below 0.  The number of bins, 0.7 sqrt(n), is that of Plischke, Borgonovo & Smith, Eur. J.
    Oper. Res. 226 (2013), 536-550.  Without the lines, the trend within the wide outer bins would count as noise.
    The error is that of the influence function of the ratio of the two variances, too large at an index of 0.  It does
    not cover that a jump or a long tail within a bin counts as scatter, which makes the index too small.
    """
    share, error, _ = _by_bins(column, standardised(table))
    return share, error


def first_orders(columns: Sequence[InputColumn], table: np.ndarray, sobol: bool) -> tuple[np.ndarray, np.ndarray]:
    """Index and error of several inputs, float64[n_columns, n_metrics] each.  sobol : the cases are Sobol' points.

    In a bin of one input, Sobol' points do not cover the other inputs evenly, so the bins of an input without effect
    show the effect of another one: up to 0.4 of the variance with 2048 points of ten inputs.  Therefore the part of the
    metric explained by the bins of stronger inputs is subtracted before a further input, uncorrelated with them, is
    analysed; a second round does so for the strongest, too.  The errors are those of independent cases, which are
    larger than the scatter of Sobol' points.
    """
    shape = (len(columns), table.shape[1])
    alone = [first_order(column, table) for column in columns]
    share, error = (np.reshape([one[part] for one in alone], shape) for part in (0, 1))
    if not sobol:
        return share, error
    correlated = beyond_chance(rank_correlations(columns), len(table))
    for metric, values in enumerate(standardised(table).T):
        explained: dict[int, np.ndarray] = {}
        strongest = np.argsort(-np.nan_to_num(share[:, metric], nan=-1.0))
        for k in [*strongest, *strongest]:
            explained.pop(k, None)
            left = values - sum(part for other, part in explained.items() if not correlated[k, other])
            size = left.std()
            if not size > _LEFT:
                share[k, metric] = 0.0
                continue
            one, its_error, fitted = _by_bins(columns[k], standardised(left[:, None]))
            share[k, metric] = one[0] * size**2
            if one[0] > _SURE * its_error[0]:
                explained[k] = fitted[:, 0] * size
    return share, error


def _by_bins(column: InputColumn, centred: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Index and standard error per metric (mean 0, variance 1), and what the bins explain of each case."""
    n = len(centred)
    nothing = np.full(centred.shape[1], np.nan)
    index, bins = equal_bins(column, min(max(int(0.7 * np.sqrt(n)), 2), MOST_BINS))
    if bins < 2:
        return nothing, nothing, np.zeros_like(centred)
    place = standardised(column.values[:, None])[:, 0]
    members = scipy.sparse.csr_array((np.ones(n), (index, np.arange(n))), shape=(bins, n))
    size = members.sum(axis=1)
    mean = (members @ centred) / size[:, None]
    off = place - (members @ place / size)[index]
    width = members @ off**2
    sloped = (width > _ROUNDING * size) & (not column.levels)
    parameters = bins + int(np.count_nonzero(sloped))
    if n <= 2 * parameters:
        return nothing, nothing, np.zeros_like(centred)
    slope = np.where(sloped, 1.0 / np.where(sloped, width, 1.0), 0.0)[:, None] * (members @ (off[:, None] * centred))
    fitted = mean[index] + off[:, None] * slope[index]
    inside = centred - fitted
    share = 1.0 - (inside**2).sum(axis=0) / (n - parameters) * (n - 1) / n
    influence = fitted**2 + 2.0 * fitted * inside - share * centred**2
    return share, influence.std(axis=0) / np.sqrt(n), fitted


def standardised(table: np.ndarray) -> np.ndarray:
    """Columns with mean 0 and standard deviation 1 (n in its denominator), safe from overflow."""
    scaled = table / np.abs(table).max(axis=0)
    centred = scaled - scaled.mean(axis=0)
    return centred / centred.std(axis=0)


class Contributor(NamedTuple):
    """An input and its first-order index: the fraction of the metric's variance that it explains alone.

    NaN for too few cases.
    """

    name: str
    share: float


def contributors(inputs: Mapping[str, Any], values: np.ndarray, sobol: bool = False) -> list[Contributor]:
    """The inputs that differ between the cases, the strongest contributor first; with too few cases, in their order.

    inputs : numbers, switches or words, by name;  values : float64[n], the metric, NaN for a case without a number.
    sobol : the cases are Sobol' points.
    """
    columns = input_columns(inputs)
    rows = np.flatnonzero(np.isfinite(values) & finite_rows(columns, len(values)))
    rows = rows[picked_rows(rows.size, MOST_CASES)]
    live = [column for column in (input_column.at(rows) for input_column in columns) if column.varies]
    table = np.asarray(values, dtype=np.float64)[rows, None]
    if rows.size < FEWEST_CASES or not np.ptp(table) > 1e-12 * np.abs(table).max():
        return [Contributor(column.name, np.nan) for column in live]
    found = first_orders(live, table, sobol)[0][:, 0]
    shares = [Contributor(column.name, float(share)) for column, share in zip(live, found, strict=True)]
    return sorted(shares, key=lambda contributor: -np.nan_to_num(contributor.share, nan=-1.0))


def cases_by_input(inputs: Mapping[str, np.ndarray], nominal: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Rows of the cases in which an input is not nominal, by its name; those with all inputs nominal under "".

    For a design in which one input alone is not nominal in each case.  Without names that have no rows.
    """
    changed = {name: values != nominal.get(name) for name, values in inputs.items()}
    rows = {"": np.flatnonzero(~np.any([*changed.values()], axis=0))}
    rows |= {name: np.flatnonzero(cases) for name, cases in changed.items()}
    return {name: found for name, found in rows.items() if found.size}


def ranked_by_change(
    inputs: Mapping[str, np.ndarray], nominal: Mapping[str, Any], values: np.ndarray
) -> list[Contributor]:
    """The inputs of such a design, that first which alone changes the metric most, by its largest change.

    Empty without a number where all inputs are nominal.
    """
    rows = cases_by_input(inputs, nominal)
    start = values[rows.pop("", np.empty(0, np.int64))[:1]]
    if not np.isfinite(start).any():
        return []
    changes = {name: np.abs(values[cases] - start) for name, cases in rows.items()}
    found = [Contributor(name, float(np.max(np.nan_to_num(change)))) for name, change in changes.items()]
    return sorted(found, key=lambda contributor: -contributor.share)
