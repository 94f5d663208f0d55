"""What contributes to a metric: a tornado of total and first-order effects."""

from collections.abc import Sequence

import numpy as np

from reports.drawing.marks import Axis, Bar, Mark, Plot, Points
from reports.drawing.palette import BLUE, INK, SKY
from reports.text.numbers import number

ROW, AROUND = 20.0, 34.0  # pixels of a row, and of what stands above and below the rows


def tornado(metric: str, names: Sequence[str], total: np.ndarray, first: np.ndarray, interval: str) -> Plot:
    """Bars of total effects, those of first effects beside them; float64[n, 3]: value and both ends of its interval."""
    marks: list[Mark] = []
    for values, colour, offset, key in ((total, BLUE, -0.18, "total effect"), (first, SKY, 0.2, "first-order effect")):
        rows = np.flatnonzero(np.isfinite(values[:, 0]))
        value, low, high = values[rows].T
        place = rows + offset
        texts = [f"{names[row]}: {key} {number(one, 2)}" for row, one in zip(rows.tolist(), value, strict=True)]
        shown = np.fmax(value, 0.0)
        marks.append(Bar(np.zeros(rows.size), shown, place - 0.17, place + 0.17, colour, 0.9, tuple(texts), key=key))
        sure = np.isfinite(low)
        ends = np.fmax(low, 0.0)[sure], np.fmax(high, 0.0)[sure]
        key = f"{interval} interval" if sure.any() else ""
        marks.append(
            Points(shown[sure], place[sure], INK, size=2.5, x_ends=ends, texts=[texts[k] for k in np.flatnonzero(sure)],
                   key=key)
        )  # fmt: skip
    y = Axis(reach=(len(names) - 0.5, -0.5), ticks=tuple(enumerate(names)), grid=False)
    x = Axis("fraction of the variance", zero=True, most=5)
    return Plot(tuple(marks), x, y, metric, AROUND + ROW * len(names))
