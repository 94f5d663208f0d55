"""Histograms as small multiples, with quantiles, their distribution-free intervals, nominal and limits."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mc_engine.statistics import Summary
from reports.document import Drawing, Key
from reports.figures import paper, screen
from reports.figures.palette import BLUE, INK, ORANGE, SKY, VERMILION, on_paper
from reports.numbers import count, interval, number, percent

FEWEST_BINS, MOST_BINS = 8, 48
PANELS_IN_A_ROW = 3


@dataclass(frozen=True)
class DistributionPanel:
    """One metric: finite values (float64[n]), its summary, nominal value and required limits."""

    title: str
    label: str
    values: np.ndarray
    summary: Summary
    nominal: float | None
    limits: tuple[float, ...]


def bin_edges(values: np.ndarray) -> np.ndarray:
    """Edges by Freedman & Diaconis's rule, between 8 and 48 bins, over the whole range of the values.

    Counts (whole numbers over a short range) get a bin each.
    """
    low, high = float(values.min()), float(values.max())
    if 0.0 < high - low < MOST_BINS and bool((values == np.round(values)).all()):
        return np.arange(low - 0.5, high + 1.0)
    if high - low <= 1e-12 * max(abs(low), abs(high)):
        half = max(abs(low), 1.0) * 1e-3
        return np.linspace(low - half, high + half, FEWEST_BINS + 1)
    spread = float(np.subtract(*np.percentile(values, [75, 25])))
    width = 2.0 * spread / values.size ** (1.0 / 3.0)
    bins = int(np.ceil((high - low) / width)) if width * MOST_BINS > high - low else MOST_BINS
    return np.linspace(low, high, min(max(bins, FEWEST_BINS), MOST_BINS) + 1)


@dataclass(frozen=True)
class Distributions(Drawing):
    """Panels of histograms.  outer : the probabilities whose quantiles are drawn beside the median."""

    panels: tuple[DistributionPanel, ...]
    outer: tuple[float, ...]
    with_intervals: bool

    @property
    def key(self) -> tuple[Key, ...]:
        outer = " and ".join(percent(p, 3) for p in self.outer)
        entries = [Key("bar", SKY, "cases"), Key("line", ORANGE, "median"), Key("dash", BLUE, f"{outer} quantiles")]
        if self.with_intervals:
            confidence = percent(self.panels[0].summary.confidence)
            entries.append(Key("band", BLUE, f"{confidence} interval of a quantile, free of distribution"))
        if any(panel.nominal is not None for panel in self.panels):
            entries.append(Key("dot", INK, "nominal"))
        if any(panel.limits for panel in self.panels):
            entries.append(Key("line", VERMILION, "required limit"))
        return tuple(entries)

    @property
    def alternative(self) -> str:
        parts = []
        for panel in self.panels:
            summary, median = panel.summary, panel.summary.at(0.5)
            middle = f", median {number(median.value)}" if median else ""
            parts.append(
                f"{panel.label}: {count(summary.n_used)} of {count(summary.n_tried)} cases from "
                f"{number(summary.minimum)} to {number(summary.maximum)}{middle}"
            )
        return f"Histograms. {'; '.join(parts)}."

    def interactive(self) -> list[dict[str, Any]]:
        return [self._screen_panel(panel) for panel in self.panels]

    def _screen_panel(self, panel: DistributionPanel) -> dict[str, Any]:
        edges = bin_edges(panel.values)
        counts, _ = np.histogram(panel.values, edges)
        top = 1.06 * float(counts.max())
        bars = {
            "type": "bar",
            "x": screen.rounded(0.5 * (edges[1:] + edges[:-1]), 9),
            "y": counts.tolist(),
            "width": float(edges[1] - edges[0]),
            "marker": {"color": SKY, "opacity": 0.6, "line": {"width": 0}},
            "customdata": [[number(a), number(b)] for a, b in pairwise(edges)],
            "hovertemplate": "%{customdata[0]} to %{customdata[1]}: %{y} cases<extra></extra>",
        }
        data = [bars, *(_screen_line(*line, top) for line in self._lines(panel))]
        shapes = [
            {"type": "rect", "xref": "x", "yref": "paper", "x0": low, "x1": high, "y0": 0, "y1": 1,
             "fillcolor": BLUE, "opacity": 0.25, "line": {"width": 0}, "layer": "below"}
            for low, high in self._bands(panel)
        ]  # fmt: skip
        x, y = (
            screen.axis(panel.label, nticks=_tick_count(edges), range=self._reach(panel, edges)),
            screen.axis("cases", range=[0, top], nticks=5),
        )
        return {"data": data, "layout": screen.layout(x, y, 250, panel.title, bargap=0, shapes=shapes)}

    def _reach(self, panel: DistributionPanel, edges: np.ndarray) -> list[float]:
        """The range of an axis that shows every bar, line and band."""
        places = [*edges[[0, -1]], *(line[0] for line in self._lines(panel)), *sum(self._bands(panel), ())]
        margin = 0.03 * (max(places) - min(places))
        return [float(min(places) - margin), float(max(places) + margin)]

    def _bands(self, panel: DistributionPanel) -> list[tuple[float, float]]:
        if not self.with_intervals:
            return []
        drawn = [panel.summary.at(p) for p in (0.5, *self.outer)]
        return [(q.lower, q.upper) for q in drawn if q and q.lower is not None and q.upper is not None]

    def _lines(self, panel: DistributionPanel) -> list[tuple[float, str, str, str]]:
        """(place, colour, dash, what) of every upright line of a panel."""
        lines = []
        for probability in (0.5, *self.outer):
            found = panel.summary.at(probability)
            if found is not None:
                colour, dash = (ORANGE, "solid") if probability == 0.5 else (BLUE, "dash")
                bounds = f" {interval(found.lower, found.upper)}" if self.with_intervals else ""
                lines.append(
                    (found.value, colour, dash, f"{percent(probability, 3)} quantile {number(found.value)}{bounds}")
                )
        if panel.nominal is not None:
            lines.append((panel.nominal, INK, "dot", f"nominal {number(panel.nominal)}"))
        lines += [(limit, VERMILION, "solid", f"required limit {number(limit)}") for limit in panel.limits]
        return lines

    def printed(self) -> Figure:
        columns = 2 if len(self.panels) in (2, 4) else min(PANELS_IN_A_ROW, len(self.panels))
        rows = -(-len(self.panels) // columns)
        figure, axes = paper.new_figure(0.45 + 1.65 * rows, rows, columns)
        for axis, panel in zip(axes, self.panels, strict=False):
            self._print_panel(axis, panel)
        for axis in axes[len(self.panels) :]:
            axis.set_axis_off()
        paper.add_key(figure, self.key)
        return figure

    def _print_panel(self, axis: Axes, panel: DistributionPanel) -> None:
        edges = bin_edges(panel.values)
        axis.stairs(np.histogram(panel.values, edges)[0], edges, fill=True, color=SKY, alpha=0.6, linewidth=0)
        for low, high in self._bands(panel):
            axis.axvspan(low, high, color=BLUE, alpha=0.3, linewidth=0)
        styles = {"solid": "-", "dash": "--", "dot": ":"}
        for place, colour, dash, _ in self._lines(panel):
            axis.axvline(place, color=on_paper(colour), linestyle=styles[dash], linewidth=1.0)
        axis.set_xlim(*self._reach(panel, edges))
        axis.set_title(paper.literal(panel.title), fontsize=7.5)
        axis.set_xlabel(paper.literal(panel.label), fontsize=7.0)
        axis.set_ylabel("cases", fontsize=7.0)
        axis.grid(axis="x", visible=False)
        paper.few_ticks(axis, 3 if len(self.panels) > 4 else 5, whole=edges[1] - edges[0] == 1.0)


def _tick_count(edges: np.ndarray) -> int:
    """Fewer ticks where their numbers are long."""
    return 4 if max(abs(edges[0]), abs(edges[-1])) > 500.0 * (edges[-1] - edges[0]) else 6


def _screen_line(place: float, colour: str, dash: str, what: str, top: float) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "x": [place] * 2,
        "y": [0, top],
        "line": {"color": colour, "dash": dash, "width": 1.8},
        "text": screen.plain(what),
        "hovertemplate": "%{text}<extra></extra>",
    }
