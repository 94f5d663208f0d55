"""The figure of a comparison: how far each metric moved from run A to run B, and how its spread changed."""

from dataclasses import astuple

import numpy as np

from mc_engine.statistics.change_tests import UNKNOWN, Estimate, MetricChange, hidden_by_ties
from mc_engine.studies.comparison import Comparison
from reports.document.blocks import FigureBlock
from reports.drawing.marks import Drawing
from reports.figures.rows import change_panel, difference_scale, ratio_scale
from reports.text.numbers import given_percent, words

MOST_ROWS = 40  # of the figure
ROWS_TOGETHER = 18  # of a panel: a lower one finds room on a page that is begun


def change_figure(comparison: Comparison, moved: list[MetricChange]) -> FigureBlock:
    """moved : the metrics that differ, in the order of the rows."""
    shown = moved[:MOST_ROWS]
    names = tuple(words(item.metric, comparison.units[item.metric]) for item in shown)
    caption = "How far each metric moved and how much its spread changed from run A to run B"
    if len(shown) < len(moved):
        caption += f"; the {len(shown)} of {len(moved)} metrics with the largest changes"
    interval = given_percent(comparison.confidence)
    shifted, spread = (np.array([getattr(item, p) <= comparison.alpha for item in shown], dtype=bool)
                       for p in ("shift_adjusted", "spread_adjusted"))  # fmt: skip
    shifts = _ends([item.shift_in_sigma for item in shown], 0.0, shifted)
    ratios = _ends([item.ratio for item in shown], 1.0, spread)
    kinds = (
        ("Shift [σ of run A]", shifts, shifted, difference_scale(shifts)),
        ("Spread, run B over run A", ratios, spread, ratio_scale(ratios)),
    )
    parts = np.array_split(np.arange(len(shown)), -(-len(shown) // ROWS_TOGETHER))
    plots = [
        change_panel(title, [names[row] for row in part], ends[part], significant[part], scale, interval)
        for part in parts
        for title, ends, significant, scale in kinds
    ]
    return FigureBlock(f"{caption}.", Drawing("Changes from run A to run B", tuple(plots)), "half")


def _ends(estimates: list[Estimate], unchanged: float, significant: np.ndarray) -> np.ndarray:
    """float64[n, 3]: values and both ends of their intervals; NaN where there is none, or ties hide it."""
    rows = [
        astuple(UNKNOWN if hidden_by_ties(estimate, unchanged, bool(sure)) else estimate)
        for estimate, sure in zip(estimates, significant, strict=True)
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, 3)
