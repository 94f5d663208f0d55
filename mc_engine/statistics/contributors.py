"""The inputs that contribute most to a metric: first-order Sobol' indices estimated from the case table."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from mc_engine.statistics.first_order import first_order
from mc_engine.statistics.input_columns import finite_rows, input_columns

FEWEST_CASES = 20
MOST_CASES = 20_000  # above, so many are picked evenly


class Contributor(NamedTuple):
    """An input and its first-order index: the fraction of the metric's variance that it explains alone.

    NaN for too few cases.
    """

    name: str
    share: float


def contributors(inputs: Mapping[str, Any], values: np.ndarray) -> list[Contributor]:
    """The inputs that differ between the cases, the strongest contributor first; of too few cases in their own order.

    inputs : numbers, switches or words, by name;  values : float64[n], the metric, NaN for a case without a number.
    """
    columns = input_columns(inputs)
    rows = np.flatnonzero(np.isfinite(values) & finite_rows(columns, len(values)))
    rows = rows[:: -(-rows.size // MOST_CASES) or 1]
    live = [column for column in (input_column.at(rows) for input_column in columns) if column.varies]
    table = np.asarray(values, dtype=np.float64)[rows, None]
    if rows.size < FEWEST_CASES or not np.ptp(table) > 1e-12 * np.abs(table).max():
        return [Contributor(column.name, np.nan) for column in live]
    shares = [Contributor(column.name, float(first_order(column, table)[0][0])) for column in live]
    return sorted(shares, key=lambda contributor: -np.nan_to_num(contributor.share, nan=-1.0))
