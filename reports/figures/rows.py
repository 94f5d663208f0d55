"""Figures with a row for each requirement, metric, level or input: margins, changes, levels, contributors."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reports.drawing.marks import Axis, Bar, Drawing, Limit, Line, Mark, Plot, Points, rows_axis
from reports.drawing.palette import BLUE, GREEN, INK, MUTED, ORANGE, PAPER, SKY, VERMILION
from reports.text.numbers import SPACE, count, number

MOST_MARGIN = 1.0  # of the width of the limits, either way; margins beyond are drawn at the edge
TONES = {"good": GREEN, "bad": VERMILION, "open": MUTED}
SPREAD = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)  # probabilities of what is drawn of a level
SPANS = ((0, 6, MUTED, 1.2, "all cases"), (1, 5, SKY, 7.0, "5 % to 95 %"),
         (2, 4, BLUE, 11.0, "middle half of the cases"))  # of SPREAD, with colour, width and words  # fmt: skip
FAR_APART = 30.0  # levels whose medians differ by such a ratio are drawn on a logarithmic axis
RATIOS = ((1.02, 1.04, 1.06, 1.08), (1.05, 1.1, 1.15, 1.2), (1.1, 1.2, 1.3, 1.5), (1.25, 1.5, 2.0, 3.0),
          (2.0, 5.0, 10.0, 20.0), (10.0, 100.0, 1e3, 1e4))  # fmt: skip


@dataclass(frozen=True)
class MarginRow:
    """A requirement: its demonstrated and worst margin over the width of its limits, negative outside.

    tone : of its verdict, "good", "bad" or "open".
    """

    name: str
    demonstrated: float | None
    worst: float
    tone: str


def margin_figure(rows: Sequence[MarginRow]) -> Drawing:
    """Margins of requirements relative to the width of their limits."""
    marks: list[Mark] = []
    for place, row in enumerate(rows):
        y, bound = np.array([float(place)]), "none" if row.demonstrated is None else _percent(row.demonstrated)
        text = f"{row.name}: demonstrated {bound}, worst case {_percent(row.worst)}"
        if row.demonstrated is not None:
            x, key = _drawn_margin(row.demonstrated), "demonstrated bound (tolerance limit)"
            ends = np.minimum(x, 0.0), np.maximum(x, 0.0)
            marks.append(Bar(*ends, y - 0.3, y + 0.3, TONES[row.tone], 0.35, (text,)))
            marks.append(Points(x, y, BLUE, key, "diamond", 9.0, texts=(text,), key=key))
        marks.append(Points(_drawn_margin(row.worst), y, INK, "worst case", "x", 8.0, texts=(text,), key="worst case"))
    marks.append(Limit(0.0, "x", VERMILION, "limit", key="limit"))
    names = [row.name if row.demonstrated is None else f"{row.name}, {_percent(row.demonstrated)}" for row in rows]
    reached = [
        float(_drawn_margin(margin)[0])
        for row in rows
        for margin in (row.demonstrated, row.worst)
        if margin is not None
    ]
    x_axis = Axis("margin over width of the limits [%]", reach=(min(*reached, 0.0) - 5.0, max(*reached, 0.0) + 5.0))
    plot = Plot(tuple(marks), x_axis, rows_axis(names), height=70.0 + 26.0 * len(rows))
    return Drawing("Margins relative to the width of the limits", (plot,), 1)


def _drawn_margin(margin: float) -> np.ndarray:
    return np.array([100.0 * min(max(margin, -MOST_MARGIN), MOST_MARGIN)])


def _percent(margin: float) -> str:
    return f"{number(100.0 * margin, 3)}{SPACE}%"


def change_panel(
    title: str, metrics: Sequence[str], estimates: np.ndarray, significant: np.ndarray, unchanged: float, interval: str
) -> Plot:
    """One kind of change from a run to another, of each metric.

    estimates : float64[n, 3], value and ends of its interval, NaN where not defined.  significant : bool[n].
    unchanged : 0 of a difference; 1 of a ratio, whose axis is logarithmic.
    """
    value, lower, upper = estimates.T
    reach = change_reach(estimates, unchanged)
    marks: list[Mark] = [Limit(unchanged, "x", INK, "no change", "dash", 1.0, key="no change")]
    for sure, colour, sign, key in (
        (False, BLUE, "circle", "not significant"),
        (True, VERMILION, "diamond", f"significant, with its {interval} interval"),
    ):
        rows = np.flatnonzero(np.isfinite(value) & (significant == sure)).tolist()
        texts = [f"{metrics[k]}: {number(value[k], 3)}, {number(lower[k], 3)} to {number(upper[k], 3)}" for k in rows]
        ends = lower[rows], upper[rows]
        marks.append(Points(value[rows], np.array(rows), colour, key, sign, 8.0, texts=texts, x_ends=ends, key=key))
    ticks = tuple((tick, number(tick, 3)) for tick in ratio_ticks(reach)) if unchanged else None
    x = Axis(reach=reach, log=bool(unchanged), ticks=ticks)
    return Plot(tuple(marks), x, rows_axis(metrics, True), title, 70.0 + 24.0 * len(metrics))


def change_reach(estimates: np.ndarray, unchanged: float) -> tuple[float, float]:
    """Ends of the axis of changes: every value and, unless they reach far beyond, every interval."""
    scaled = np.log(estimates) if unchanged else estimates
    values = np.append(scaled[np.isfinite(scaled[:, 0]), 0], np.log(unchanged) if unchanged else 0.0)
    every = np.append(scaled[np.isfinite(scaled)], values)
    room = max(float(np.ptp(values)), 0.1)
    low = max(float(every.min()), float(values.min()) - room) - 0.05 * room
    high = min(float(every.max()), float(values.max()) + room) + 0.05 * room
    return (float(np.exp(low)), float(np.exp(high))) if unchanged else (low, high)


def ratio_ticks(span: tuple[float, float]) -> list[float]:
    """Round ratios inside the span, at most seven of them, 1 always among them."""
    widest = max(span[1], 1.0 / span[0])
    steps = next((steps for steps in RATIOS if widest <= steps[-1] * 1.05), RATIOS[-1])
    ticks = sorted({round(1.0 / step, 3) for step in steps} | {1.0, *steps})
    return [tick for tick in ticks if span[0] <= tick <= span[1]]


def level_panel(label: str, levels: Sequence[str], quantiles: np.ndarray, used: Sequence[int]) -> Plot:
    """A metric by level: quantiles float64[n_levels, 7] at SPREAD, NaN for a level without a number, and counts."""
    marks: list[Mark] = []
    # Places are numbers, not words: plotly would read a level such as "2" as a number or a date.
    for place, (level, row, cases) in enumerate(zip(levels, quantiles, used, strict=True)):
        for low, high, colour, width, key in SPANS:
            text = f"{level}, {count(cases)} cases: {number(float(row[low]), 4)} to {number(float(row[high]), 4)}"
            marks.append(Line(row[[low, high]], np.full(2, place), colour, width=width, text=text, key=key))
    median = quantiles[:, 3]
    texts = [f"{level}: median {number(float(value), 4)}" for level, value in zip(levels, median, strict=True)]
    marks.append(Points(median, np.arange(median.size), ORANGE, size=8.0, edge=PAPER, texts=texts, key="median"))
    known = median[np.isfinite(median)]
    log = bool(known.size and np.nanmin(quantiles) > 0.0 and known.max() > FAR_APART * known.min())
    title = f"{label}{', logarithmic' if log else ''}"
    return Plot(tuple(marks), Axis(log=log), rows_axis(levels), title, 40.0 + 26.0 * len(levels))


def tornado(metric: str, names: Sequence[str], total: np.ndarray, first: np.ndarray, interval: str) -> Plot:
    """Bars of total effects, those of first effects beside them; float64[n, 3]: value and both ends of its interval."""
    marks: list[Mark] = []
    for values, colour, offset, key in ((total, BLUE, -0.18, "total effect"), (first, SKY, 0.2, "first-order effect")):
        rows = np.flatnonzero(np.isfinite(values[:, 0]))
        value, place = values[rows, 0], rows + offset
        texts = [f"{names[row]}: {key} {number(size, 2)}" for row, size in zip(rows.tolist(), value, strict=True)]
        size = np.fmax(value, 0.0)
        marks.append(Bar(np.zeros(rows.size), size, place - 0.17, place + 0.17, colour, 0.9, texts, key=key))
        known = np.isfinite(values[rows, 1])
        low, high = np.fmax(values[rows[known], 1:], 0.0).T
        key = f"{interval} interval" if known.any() else ""
        marks.append(Points(size[known], place[known], INK, size=2.5, x_ends=(low, high), key=key,
                            texts=[texts[k] for k in np.flatnonzero(known)]))  # fmt: skip
    x = Axis("fraction of the variance", zero=True, most=5)
    return Plot(tuple(marks), x, rows_axis(names), metric, 34.0 + 20.0 * len(names))
