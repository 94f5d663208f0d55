"""Shares of the metrics' variance by input: a field of inputs by metrics with the numbers in it."""

from dataclasses import dataclass

import numpy as np

from reports.figures.marks import Axis, Bar, Drawing, Plot
from reports.figures.palette import field_colour
from reports.numbers import count

DARK = 0.55  # a field below this share is dark, and takes white numbers


@dataclass(frozen=True)
class IndexMap(Drawing):
    """share : float64[n_inputs, n_metrics], NaN where there is none; n_used of n_tried cases, the fewest and most.

    index : its name; none, all : what 0 and 1 mean; counted : what n_used counts.
    """

    inputs: tuple[str, ...]
    metrics: tuple[str, ...]
    share: np.ndarray
    n_used: tuple[int, int]
    n_tried: int
    index: str = "first-order index"
    none: str = "knowing the input says nothing of the metric"
    all: str = "it says all"
    counted: str = "cases"

    @property
    def alternative(self) -> str:
        parts = []
        for k, metric in enumerate(self.metrics):
            column = self.share[:, k]
            order = [int(row) for row in np.argsort(-np.nan_to_num(column, nan=-1.0)) if np.isfinite(column[row])][:3]
            parts.append(f"{metric}: " + ", ".join(f"{self.inputs[row]} {_digits(column[row])}" for row in order))
        return f"Share of the variance of each metric by input, {self.index}. {'; '.join(parts)}."

    @property
    def plots(self) -> tuple[Plot, ...]:
        rows, columns = (places.ravel() for places in np.indices(self.share.shape))
        shares = self.share.ravel()
        known = np.isfinite(shares)
        rows, columns, shares = rows[known], columns[known], shares[known]
        labels = tuple(_digits(value) for value in shares)
        where = [f"{self.metrics[k]}, {self.inputs[row]}" for row, k in zip(rows, columns, strict=True)]
        few, most = self.n_used
        used = count(most) if few == most else f"{count(few)} to {count(most)}"
        meaning = f"from 0, dark: {self.none}, to 1, bright: {self.all}"
        cells = Bar(
            columns - 0.48,
            columns + 0.48,
            rows - 0.46,
            rows + 0.46,
            tuple(field_colour(value) for value in shares),
            1.0,
            tuple(f"{place}: {label}" for place, label in zip(where, labels, strict=True)),
            labels,
            tuple("#ffffff" if value < DARK else "#000000" for value in shares),
            f"{self.index} {meaning}; {used} of {count(self.n_tried)} {self.counted}",
        )
        x = Axis(reach=(-0.5, len(self.metrics) - 0.5), ticks=tuple(enumerate(self.metrics)), top=True, grid=False)
        y = Axis(reach=(len(self.inputs) - 0.5, -0.5), ticks=tuple(enumerate(self.inputs)), grid=False)
        return (Plot((cells,), x, y, height=50.0 + 30.0 * len(self.inputs)),)


def _digits(value: float) -> str:
    """Two decimals, as far as the errors allow; an estimate below 0 is one of 0."""
    return f"{max(value, 0.0):.2f}" if np.isfinite(value) else ""
