"""Matplotlib figures for paper: made with the object interface, written as SVG with the same bytes every time."""

import re
from collections.abc import Callable, Sequence
from io import StringIO
from textwrap import fill
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator, ScalarFormatter

from reports.document import Key
from reports.figures.palette import on_paper

WIDTH = 6.7  # inches, the text width of the page
STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.titlelocation": "left",
    "axes.labelsize": 8.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "axes.edgecolor": "#555555",
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-3, 5),
    "grid.color": "#dddddd",
    "grid.linewidth": 0.5,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "xtick.color": "#333333",
    "ytick.color": "#333333",
    "legend.fontsize": 7.0,
    "legend.frameon": False,
    "svg.fonttype": "path",
    "svg.hashsalt": "mc-engine",
}
SIGNS: dict[str, Any] = {  # a point's shape: by plotly's name, matplotlib's
    "circle": "o",
    "x": "x",
    "diamond": "D",
    "square": "s",
    "triangle-up": "^",
    "cross": "P",
    "star": "*",
}
FILLED = {"bar": 0.6, "field": 0.6, "band": 0.3}  # opacity
BELOW_POWER = 7.0  # points, a line of small print
LONGEST_LINE = 104  # characters of a key that fit the width of the page
_SUPERSCRIPT = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_DASH: dict[str, Any] = {"line": "-", "dash": "--", "dot": ":"}


class PlainNumbers(ScalarFormatter):
    """Numbers at the ticks as plain text, a power of ten beside them as ×10⁶.

    Matplotlib's own way to such a power lays out every tick as mathematics, in half of the time of a whole report.
    """

    def get_offset(self) -> str:
        power = super().get_offset().removeprefix("1e").replace("−", "-")
        return f"×10{power.translate(_SUPERSCRIPT)}" if power else ""


def new_figure(
    height: float, rows: int = 1, columns: int = 1, heights: Sequence[float] | None = None
) -> tuple[Figure, list[Axes]]:
    """A figure as wide as the text, `height` inches high, and its axes row by row.  heights : of the rows, relative."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, height_ratios=heights)
    found = [axis for row in axes for axis in row]
    for axis in found:
        axis.xaxis.set_major_formatter(PlainNumbers())
        axis.yaxis.set_major_formatter(PlainNumbers())
    return figure, found


def literal(text: str) -> str:
    """User text for matplotlib, which would read a pair of dollar signs as mathematics."""
    return text.replace("$", r"\$")


def few_ticks(axis: Axes, x: int = 5, y: int = 4, whole: bool = False) -> None:
    """At most so many intervals between ticks, fewer for long numbers, so that labels of narrow panels keep apart."""
    low, high = axis.get_xlim()
    long = max(abs(low), abs(high)) > 500.0 * (high - low)
    axis.xaxis.set_major_locator(MaxNLocator(2 if long else x, integer=whole))
    axis.yaxis.set_major_locator(MaxNLocator(y))


def label_below_power(axis: Axes) -> None:
    """Moves the label of x down where a power of ten stands at the end of the axis, which a long label would cover."""
    formatter = axis.xaxis.get_major_formatter()
    formatter.set_locs(list(axis.xaxis.get_major_locator()()))
    if formatter.get_offset():
        axis.xaxis.labelpad += BELOW_POWER


def add_key(figure: Figure, key: Sequence[Key], columns: int = 3) -> None:
    """The figure's key in rows above the axes."""
    if key:
        handles = [_handle(entry) for entry in key]
        columns = min(columns, len(handles))
        figure.legend(handles=handles, loc="outside upper left", ncols=columns, handlelength=2.2, columnspacing=1.4)


def _handle(entry: Key) -> Line2D | Patch:
    colour, label = on_paper(entry.colour), literal(fill(entry.text, LONGEST_LINE))
    if entry.mark in FILLED:
        return Patch(color=colour, alpha=FILLED[entry.mark], linewidth=0, label=label)
    if entry.mark == "point":
        size = 3 if entry.sign == "circle" else 4.5
        return Line2D([], [], linestyle="", marker=SIGNS[entry.sign], markersize=size, color=colour, label=label)
    if entry.mark == "ring":
        return Line2D(
            [], [], linestyle="", marker="o", markersize=6, markerfacecolor="white", color=colour, label=label
        )
    return Line2D([], [], linestyle=_DASH[entry.mark], color=colour, linewidth=1.4, label=label)


def svg(draw: Callable[[], Figure]) -> str:
    """The figure that `draw` makes, in the style of the page, as SVG text without date or creator.

    The style is read while drawing and again while saving, so both happen inside it.
    """
    text = StringIO()
    with mpl.rc_context({**mpl.rcParamsDefault, **STYLE, "backend": "agg"}):
        draw().savefig(text, format="svg", metadata={"Date": None, "Creator": None}, transparent=True)
    return re.sub(r"<metadata>.*?</metadata>", "", text.getvalue(), flags=re.DOTALL)
