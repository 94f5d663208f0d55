"""Histograms as small multiples: quantiles, their distribution-free intervals, nominal, limits, printed laws."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from textwrap import fill

import numpy as np

from mc_engine.statistics import Quantile, Summary
from reports.drawing.marks import Axis, Bar, Drawing, Limit, Line, Mark, Plot
from reports.drawing.palette import BLUE, GREEN, INK, ORANGE, SKY, VERMILION
from reports.text.numbers import count, interval, number, percent

FEWEST_BINS, MOST_BINS = 8, 48
CENTRAL = (0.005, 0.995)  # what a histogram must show well
SPOILT = 3.0  # times the width of the central part: a wider range is cut
FAR = 10.0  # times the width of all bins: a nominal or limit farther away is told, not drawn
LAW_REACH, LAW_POINTS = 4.0, 81  # standard deviations on either side, places of the curve
TITLE_WIDTH = 28  # characters above a narrow panel


@dataclass(frozen=True)
class DistributionPanel:
    """One metric: finite values (float64[n]), its summary, nominal value and required limits.

    law : mean and standard deviation of the normal law that the source prints for such cases
    column : the metric's name in the table of cases
    """

    title: str
    label: str
    values: np.ndarray
    summary: Summary
    nominal: float | None
    limits: tuple[float, ...]
    law: tuple[float, float] | None = None
    column: str = ""

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
    height: float = 240.0
    across = 4

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

    @property
    def plots(self) -> tuple[Plot, ...]:
        return tuple(self._plot(panel) for panel in self.panels)

    def _plot(self, panel: DistributionPanel) -> Plot:
        edges, counts = panel.edges, panel.counts
        x_law, y_law = law_curve(panel, edges)
        top = 1.06 * max([float(counts.max()), *y_law])
        told = tuple(
            f"{number(a)} to {number(b)}: {count(int(n))} cases"
            for (a, b), n in zip(pairwise(edges), counts, strict=True)
        )
        marks: list[Mark] = [self._box(panel, low, high, top) for low, high in self._bands(panel)]
        sides = edges[:-1], edges[1:], np.zeros(counts.size), counts
        marks.append(Bar(*sides, SKY, texts=told, column=panel.column, key="cases"))
        marks += [Limit(at, "x", colour, what, dash, key=key) for at, colour, dash, what, key in self._lines(panel)]
        if panel.law:
            what = f"printed normal law, {number(panel.law[0])} ± {number(panel.law[1])} (1 σ)"
            marks.append(Line(x_law, y_law, GREEN, width=2.0, text=what, key="normal law that the source prints"))
        title = "\n".join(filter(None, (panel.title, fill(panel.beyond, TITLE_WIDTH))))
        whole = bool(edges[1] - edges[0] == 1.0)
        return Plot(
            tuple(marks),
            Axis(panel.label, most=5, whole=whole, grid=False, margin=0.03),
            Axis("cases", reach=(0.0, top), most=4, whole=True),
            title,
            self.height,
        )

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

    def _lines(self, panel: DistributionPanel) -> list[tuple[float, str, str, str, str]]:
        """(place, colour, dash, what, key) of every upright line of a panel."""
        lines = []
        for found in self._quantiles(panel):
            colour, dash = (ORANGE, "solid") if found.probability == 0.5 else (BLUE, "dash")
            bounds = f" {interval(found.lower, found.upper)}" if self.with_intervals else ""
            what = f"{percent(found.probability, 3)} percentile {number(found.value)}{bounds}"
            outer = f"{' and '.join(percent(p, 3) for p in self.outer)} percentiles"
            lines.append((found.value, colour, dash, what, "median" if found.probability == 0.5 else outer))
        if panel.nominal is not None and panel.near(panel.nominal):
            lines.append((panel.nominal, INK, "dot", f"nominal {number(panel.nominal)}", "nominal"))
        near = [limit for limit in panel.limits if panel.near(limit)]
        lines += [(limit, VERMILION, "solid", f"required limit {number(limit)}", "required limit") for limit in near]
        return lines

    def _box(self, panel: DistributionPanel, low: float, high: float, top: float) -> Bar:
        """An interval of a quantile, as high as the panel."""
        each = percent(0.5 * (1.0 + panel.summary.confidence))
        key = f"{each} confidence bounds of a percentile, distribution-free"
        return Bar(np.array([low]), np.array([high]), np.zeros(1), np.array([top]), BLUE, 0.3, key=key)
