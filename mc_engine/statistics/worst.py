"""The worst cases of a metric among those that have a number; failed cases have none and are listed apart."""

import numpy as np


def worst_cases(values: np.ndarray, ok: np.ndarray, count: int, largest: bool = True) -> np.ndarray:
    """Row numbers (int64[<= count]), worst first, ties in row order.

    values : float64[n], ok : bool[n].  largest : whether large values are the bad ones.
    """
    values = np.asarray(values, dtype=np.float64)
    rows = np.flatnonzero(np.asarray(ok, dtype=bool) & np.isfinite(values))
    goodness = -values[rows] if largest else values[rows]
    if 0 < count < rows.size:  # sort none but those that can be among them: a table may have a million rows
        among = np.flatnonzero(goodness <= np.partition(goodness, count - 1)[count - 1])
        rows, goodness = rows[among], goodness[among]
    return rows[np.argsort(goodness, kind="stable")[:count]]
