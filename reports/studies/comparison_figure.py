"""The figure of a comparison: how far each metric moved from run A to run B, and how its spread changed."""

from dataclasses import replace

import numpy as np

from mc_engine.statistics.change_tests import UNKNOWN, Estimate, MetricChange
from mc_engine.studies.comparison import Comparison
from reports.document.blocks import FigureBlock
from reports.drawing.marks import Drawing
from reports.figures.rows import change_axis, change_panel
from reports.text.numbers import number, percent, words

MOST_ROWS = 40  # of the figure
ROWS_TOGETHER = 18  # of a panel: a lower one finds room on a page that is begun
WIDEST, FEW_SIGMA = 20.0, 5.0  # the axis of shifts: so many medians, or so many σ at least


def change_figure(comparison: Comparison, moved: list[MetricChange]) -> FigureBlock:
    """moved : the metrics that differ, in the order of the rows."""
    shown = moved[:MOST_ROWS]
    reach = _reach([abs(item.shift_in_sigma.value) for item in shown])
    far = [item for item in shown if abs(item.shift_in_sigma.value) > reach]
    names = tuple(words(item.metric, comparison.units[item.metric]) for item in shown)
    caption = "How far each metric moved and how much its spread changed from run A to run B"
    if len(shown) < len(moved):
        caption += f"; the {len(shown)} of {len(moved)} metrics with the largest changes"
    if far:
        values = (
            f"{words(change.metric, comparison.units[change.metric])} {number(change.shift_in_sigma.value, 3)} σ"
            for change in far
        )
        caption += f". Shifts beyond the axis, not drawn: {', '.join(values)}"
    shifts = [UNKNOWN if item in far else item.shift_in_sigma for item in shown]
    shifted, spread = (np.array([getattr(item, p) <= comparison.alpha for item in shown], dtype=bool)
                       for p in ("shift_adjusted", "spread_adjusted"))  # fmt: skip
    ratios, interval = [item.ratio for item in shown], percent(comparison.confidence)
    kinds = (
        ("Shift [σ of run A]", _ends(shifts), shifted, 0.0),
        ("Spread, run B over run A", _ends(ratios), spread, 1.0),
    )
    parts = np.array_split(np.arange(len(shown)), -(-len(shown) // ROWS_TOGETHER))
    plots = [
        replace(
            change_panel(title, [names[row] for row in part], ends[part], significant[part], unchanged, interval),
            x=change_axis(ends, unchanged),
        )
        for part in parts
        for title, ends, significant, unchanged in kinds
    ]
    return FigureBlock(f"{caption}.", Drawing("Changes from run A to run B", tuple(plots)), "half")


def _reach(shifts: list[float]) -> float:
    """The largest shift on the axis; shifts far beyond most others are told in the caption instead."""
    known = np.sort([shift for shift in shifts if np.isfinite(shift)])
    return max(WIDEST * float(np.quantile(known, 0.5, method="lower")), FEW_SIGMA) if known.size else FEW_SIGMA


def _ends(estimates: list[Estimate]) -> np.ndarray:
    """float64[n, 3]: values and both ends of their intervals."""
    return np.array(
        [(estimate.value, estimate.lower, estimate.upper) for estimate in estimates], dtype=np.float64
    ).reshape(-1, 3)
