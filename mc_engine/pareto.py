"""Which of several candidates no other one beats, and how much of a box they dominate.  Small is good, everywhere."""

import numpy as np


def non_dominated(values: np.ndarray) -> np.ndarray:
    """bool[n], true where no other row is as small in every column and smaller in one; of equal rows the first.

    values : float64[n, n_objectives].  Rows that are not finite are never true.
    """
    best = np.zeros(len(values), dtype=bool)
    usable = np.flatnonzero(np.isfinite(values).all(axis=1))
    # a row can only be beaten by one that comes before it in this order
    order = usable[np.lexsort(values[usable].T[::-1])]
    front = np.empty((0, values.shape[1]))
    for row in order:
        if not (front <= values[row]).all(axis=1).any():
            best[row] = True
            front = np.vstack([front, values[row]])
    return best


def hypervolume(values: np.ndarray, reference: np.ndarray) -> float:
    """Volume between `reference` and the rows that are below it in every column; 0 where there are none.

    values : float64[n, n_objectives];  reference : float64[n_objectives].  Slice by slice along the last objective.
    """
    values = values[(values < reference).all(axis=1)]
    if not len(values):
        return 0.0
    if values.shape[1] == 1:
        return float(reference[0] - values.min())
    values = values[np.argsort(values[:, -1], kind="stable")]
    floors = np.append(values[:, -1], reference[-1])
    return float(
        sum(
            (floors[k + 1] - floors[k]) * hypervolume(values[: k + 1, :-1], reference[:-1])
            for k in range(len(values))
            if floors[k + 1] > floors[k]
        )
    )
