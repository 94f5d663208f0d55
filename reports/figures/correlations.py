"""A matrix of correlations: its lower half, a cell with a number for each pair."""

from collections.abc import Sequence

import numpy as np

from reports.drawing.marks import Axis, Bar, Plot
from reports.drawing.palette import BLUE, VERMILION, blended

LIGHT = 0.6  # a cell of a weaker correlation is light, and takes black numbers


def correlation_matrix(names: Sequence[str], rho: np.ndarray) -> Plot:
    """rho : float64[n, n], symmetric, NaN where there is none; blue cells are positive, red ones negative."""
    rows, columns = np.tril_indices(len(names), -1)
    known = np.isfinite(rho[rows, columns])
    rows, columns = rows[known], columns[known]
    values = rho[rows, columns]
    labels = tuple(f"{value:.2f}".replace("-0.00", "0.00").replace("-", "−") for value in values)
    told = [f"{names[i]}, {names[k]}: {label}" for i, k, label in zip(rows, columns, labels, strict=True)]
    cells = Bar(
        columns - 0.48,
        columns + 0.48,
        rows - 0.46,
        rows + 0.46,
        tuple(blended(VERMILION if value < 0.0 else BLUE, abs(value)) for value in values),
        1.0,
        tuple(told),
        labels,
        tuple("#000000" if abs(value) < LIGHT else "#ffffff" for value in values),
        "rank correlation: blue positive, red negative",
    )
    x = Axis(reach=(-0.5, len(names) - 1.5), ticks=tuple(enumerate(names[:-1])), grid=False)
    y = Axis(reach=(len(names) - 0.5, 0.5), ticks=tuple(enumerate(names))[1:], grid=False)
    return Plot((cells,), x, y, height=60.0 + 28.0 * len(names))
