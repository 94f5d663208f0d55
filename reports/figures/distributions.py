"""Histograms as small multiples: quantiles, their distribution-free intervals, nominal, limits, printed laws."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mc_engine.statistics import Quantile, Summary
from reports.document import Drawing, Key
from reports.figures import paper, screen
from reports.figures.palette import BLUE, GREEN, INK, ORANGE, SKY, VERMILION, on_paper
from reports.numbers import count, interval, number, percent

FEWEST_BINS, MOST_BINS = 8, 48
CENTRAL = (0.005, 0.995)  # what a histogram must show well
SPOILT = 3.0  # times the width of the central part: a wider range is cut
FAR = 10.0  # times the width of all bins: a nominal or limit farther away is told, not drawn
LAW_REACH, LAW_POINTS = 4.0, 81  # standard deviations on either side, places of the curve
PANELS_IN_A_ROW = 3
SCREEN_LINE = 28  # characters above a panel on the screen


@dataclass(frozen=True)
class DistributionPanel:
    """One metric: finite values (float64[n]), its summary, nominal value and required limits.

    law : mean and standard deviation of the normal law that the source prints for such cases
    """

    title: str
    label: str
    values: np.ndarray
    summary: Summary
    nominal: float | None
    limits: tuple[float, ...]
    law: tuple[float, float] | None = None

    @cached_property
    def edges(self) -> np.ndarray:
        """Edges of the bins."""
        low, high = shown_range(self.values)
        return bin_edges(self.values[(self.values >= low) & (self.values <= high)])

    @cached_property
    def counts(self) -> np.ndarray:
        """Cases in each bin."""
        return np.histogram(self.values, self.edges)[0]

    @property
    def beyond(self) -> str:
        """What lies outside the axis, in words: how many cases (how far, the table says), nominal and limits."""
        outside = self.values.size - int(self.counts.sum())
        limits = [number(limit) for limit in self.limits if not self.near(limit)]
        said = [count(outside)] if outside else []
        if self.nominal is not None and not self.near(self.nominal):
            said.append(f"nominal {number(self.nominal)}")
        if limits:
            said.append(f"limit{'s' * (len(limits) > 1)} {' and '.join(limits)}")
        return f"{', '.join(said)} beyond the axis" if said else ""

    def near(self, place: float) -> bool:
        """Whether a place is so near to the bins that an axis with both still shows their shape."""
        low, high = (float(end) for end in self.edges[[0, -1]])
        return low - FAR * (high - low) <= place <= high + FAR * (high - low)


def shown_range(values: np.ndarray) -> tuple[float, float]:
    """The range of a histogram of finite values (float64[n], n > 0): all of them, unless a few would squeeze the rest.

    If the central 99 % take less than a third of the whole range, it ends half of their width outside them.
    """
    low, high = float(values.min()), float(values.max())
    inner_low, inner_high = (float(end) for end in np.quantile(values, CENTRAL))
    width = inner_high - inner_low
    if width <= 0.0 or high - low <= SPOILT * width:
        return low, high
    return max(low, inner_low - 0.5 * width), min(high, inner_high + 0.5 * width)


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


def law_curve(panel: DistributionPanel, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(places, cases per bin) of the printed normal law, if it had made as many cases; empty without one."""
    if panel.law is None:
        return np.empty(0), np.empty(0)
    mean, deviation = panel.law
    z = np.linspace(-LAW_REACH, LAW_REACH, LAW_POINTS)
    cases_per_bin = panel.values.size * (edges[1] - edges[0])
    return mean + deviation * z, cases_per_bin * np.exp(-0.5 * z * z) / (deviation * np.sqrt(2.0 * np.pi))


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
        if any(panel.nominal is not None and panel.near(panel.nominal) for panel in self.panels):
            entries.append(Key("dot", INK, "nominal"))
        if any(panel.near(limit) for panel in self.panels for limit in panel.limits):
            entries.append(Key("line", VERMILION, "required limit"))
        if any(panel.law for panel in self.panels):
            entries.append(Key("line", GREEN, "normal law that the source prints"))
        return tuple(entries)

    @property
    def alternative(self) -> str:
        parts = []
        for panel in self.panels:
            summary, median = panel.summary, panel.summary.at(0.5)
            middle = f", median {number(median.value)}" if median else ""
            mean, deviation = panel.law or (0.0, 0.0)
            law = f", printed law {number(mean)} ± {number(deviation)} (1 σ)" if panel.law else ""
            parts.append(
                f"{panel.label}: {count(summary.n_used)} of {count(summary.n_tried)} cases from "
                f"{number(summary.minimum)} to {number(summary.maximum)}{middle}{law}"
            )
        return f"Histograms. {'; '.join(parts)}."

    def interactive(self) -> list[dict[str, Any]]:
        return [self._screen_panel(panel) for panel in self.panels]

    def _screen_panel(self, panel: DistributionPanel) -> dict[str, Any]:
        edges, counts = panel.edges, panel.counts
        x_law, y_law = law_curve(panel, edges)
        top = 1.06 * max([float(counts.max()), *y_law])
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
        if panel.law:
            data.append(_screen_law(x_law, y_law, panel.law))
        shapes = [
            {"type": "rect", "xref": "x", "yref": "paper", "x0": low, "x1": high, "y0": 0, "y1": 1,
             "fillcolor": BLUE, "opacity": 0.25, "line": {"width": 0}, "layer": "below"}
            for low, high in self._bands(panel)
        ]  # fmt: skip
        title = "\n".join(filter(None, (panel.title, fill(panel.beyond, SCREEN_LINE))))
        x, y = (
            screen.axis(panel.label, nticks=_tick_count(edges), range=self._reach(panel, edges)),
            screen.axis("cases", range=[0, top], nticks=5),
        )
        return {
            "data": data,
            "layout": screen.layout(x, y, 250 + screen.TITLE_LINE * title.count("\n"), title, bargap=0, shapes=shapes),
        }

    def _reach(self, panel: DistributionPanel, edges: np.ndarray) -> list[float]:
        """The range of an axis that shows every bar, line and band."""
        places = [
            *edges[[0, -1]],
            *law_curve(panel, edges)[0],
            *(line[0] for line in self._lines(panel)),
            *sum(self._bands(panel), ()),
        ]
        margin = 0.03 * (max(places) - min(places))
        return [float(min(places) - margin), float(max(places) + margin)]

    def _bands(self, panel: DistributionPanel) -> list[tuple[float, float]]:
        if not self.with_intervals:
            return []
        drawn = self._quantiles(panel)
        return [(q.lower, q.upper) for q in drawn if q.lower is not None and q.upper is not None]

    def _quantiles(self, panel: DistributionPanel) -> list[Quantile]:
        """The quantiles to draw: those with no part outside a range that was cut; the others stand in the table."""
        found = [quantile for p in (0.5, *self.outer) if (quantile := panel.summary.at(p)) is not None]
        low, high = panel.edges[[0, -1]]
        return [
            one for one in found if all(end is None or low <= end <= high for end in (one.value, one.lower, one.upper))
        ]

    def _lines(self, panel: DistributionPanel) -> list[tuple[float, str, str, str]]:
        """(place, colour, dash, what) of every upright line of a panel."""
        lines = []
        for found in self._quantiles(panel):
            colour, dash = (ORANGE, "solid") if found.probability == 0.5 else (BLUE, "dash")
            bounds = f" {interval(found.lower, found.upper)}" if self.with_intervals else ""
            what = f"{percent(found.probability, 3)} quantile {number(found.value)}{bounds}"
            lines.append((found.value, colour, dash, what))
        if panel.nominal is not None and panel.near(panel.nominal):
            lines.append((panel.nominal, INK, "dot", f"nominal {number(panel.nominal)}"))
        near = [limit for limit in panel.limits if panel.near(limit)]
        lines += [(limit, VERMILION, "solid", f"required limit {number(limit)}") for limit in near]
        return lines

    def printed(self) -> Figure:
        columns = 2 if len(self.panels) in (2, 4) else min(PANELS_IN_A_ROW, len(self.panels))
        rows = -(-len(self.panels) // columns)
        figure, axes = paper.new_figure(0.45 + 1.65 * rows, rows, columns)
        for axis, panel in zip(axes, self.panels, strict=False):
            self._print_panel(axis, panel, columns)
        for axis in axes[len(self.panels) :]:
            axis.set_axis_off()
        paper.add_key(figure, self.key)
        return figure

    def _print_panel(self, axis: Axes, panel: DistributionPanel, columns: int) -> None:
        edges = panel.edges
        axis.stairs(panel.counts, edges, fill=True, color=SKY, alpha=0.6, linewidth=0)
        for low, high in self._bands(panel):
            axis.axvspan(low, high, color=BLUE, alpha=0.3, linewidth=0)
        styles = {"solid": "-", "dash": "--", "dot": ":"}
        for place, colour, dash, _ in self._lines(panel):
            axis.axvline(place, color=on_paper(colour), linestyle=styles[dash], linewidth=1.0)
        axis.plot(*law_curve(panel, edges), color=GREEN, linewidth=1.2)
        axis.set_xlim(*self._reach(panel, edges))
        beyond = fill(panel.beyond, 96 // min(columns, 2) - 12 * (columns > 2))
        axis.set_title(paper.literal("\n".join(filter(None, (panel.title, beyond)))), fontsize=7.5)
        axis.set_xlabel(paper.literal(panel.label), fontsize=7.0)
        axis.set_ylabel("cases", fontsize=7.0)
        axis.grid(axis="x", visible=False)
        paper.few_ticks(axis, 3 if len(self.panels) > 4 else 5, whole=edges[1] - edges[0] == 1.0)
        paper.label_below_power(axis)


def _tick_count(edges: np.ndarray) -> int:
    """Fewer ticks where their numbers are long."""
    return 4 if max(abs(edges[0]), abs(edges[-1])) > 500.0 * (edges[-1] - edges[0]) else 6


def _screen_law(x: np.ndarray, y: np.ndarray, law: tuple[float, float]) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "x": screen.rounded(x, 9),
        "y": screen.rounded(y, 6),
        "line": {"color": GREEN, "width": 2.0},
        "text": screen.plain(f"printed normal law, {number(law[0])} ± {number(law[1])} (1 σ)"),
        "hovertemplate": "%{text}<extra></extra>",
    }


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
