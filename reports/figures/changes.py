"""Changes from one run to another: a row a metric, how far its mean moved and how much its spread grew or shrank."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.document import Drawing, Key
from reports.figures import paper, screen
from reports.figures.palette import BLUE, INK, VERMILION, on_paper
from reports.numbers import number

MARKS = ((BLUE, "circle"), (VERMILION, "diamond"))  # by whether the change is significant


@dataclass(frozen=True)
class ChangePanel:
    """One kind of change.  value, lower, upper : float64[n_metrics], NaN where not defined; significant : bool.

    none : where nothing changed, 0 of a difference, 1 of a ratio; a ratio stands on a logarithmic axis.
    """

    title: str
    value: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    significant: np.ndarray
    none: float

    @property
    def span(self) -> tuple[float, float]:
        """Ends of the axis: every value and, unless they reach far beyond, every interval."""
        values = self.value[np.isfinite(self.value)]
        place = np.log(np.append(values, self.none)) if self.none else np.append(values, self.none)
        ends = np.log(np.concatenate([self.lower, self.upper])) if self.none else np.r_[self.lower, self.upper]
        ends = ends[np.isfinite(ends)]
        reach = max(float(np.ptp(place)), 0.1)
        low = max(float(min(place.min(), *ends, place.min())), float(place.min()) - reach) - 0.05 * reach
        high = min(float(max(place.max(), *ends, place.max())), float(place.max()) + reach) + 0.05 * reach
        return (float(np.exp(low)), float(np.exp(high))) if self.none else (low, high)


@dataclass(frozen=True)
class ChangeDrawing(Drawing):
    """Panels over the same metrics, of which the first stands on top.  content : of the intervals."""

    metrics: tuple[str, ...]
    panels: tuple[ChangePanel, ...]
    content: str

    @property
    def key(self) -> tuple[Key, ...]:
        (plain, sign), (changed, other) = MARKS
        return (
            Key("point", changed, f"significant, with its {self.content} interval", other),
            Key("point", plain, "not significant", sign),
            Key("dash", INK, "no change"),
        )

    @property
    def alternative(self) -> str:
        parts = []
        for panel in self.panels:
            moved = [
                f"{name} {number(float(value), 3)}"
                for name, value, sure in zip(self.metrics, panel.value, panel.significant, strict=True)
                if sure and np.isfinite(value)
            ]
            parts.append(f"{panel.title}: {', '.join(moved) if moved else 'no metric changed significantly'}")
        return f"{'; '.join(parts)}."

    def interactive(self) -> list[dict[str, Any]]:
        return [self._screen_panel(panel) for panel in self.panels]

    def _screen_panel(self, panel: ChangePanel) -> dict[str, Any]:
        data: list[dict[str, Any]] = []
        for sure, (colour, sign) in enumerate(MARKS):
            rows = np.flatnonzero(np.isfinite(panel.value) & (panel.significant == bool(sure)))
            data.append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "x": screen.rounded(panel.value[rows]),
                    "y": rows.tolist(),
                    "error_x": {
                        "type": "data",
                        "symmetric": False,
                        "array": screen.rounded((panel.upper - panel.value)[rows]),
                        "arrayminus": screen.rounded((panel.value - panel.lower)[rows]),
                        "color": colour,
                        "thickness": 1.5,
                        "width": 0,
                    },
                    "marker": {"size": 9, "color": colour, "symbol": sign},
                    "text": [screen.plain(self._words(panel, int(row))) for row in rows],
                    "hovertemplate": "%{text}<extra></extra>",
                }
            )
        line = {"type": "line", "x0": panel.none, "x1": panel.none, "yref": "paper", "y0": 0, "y1": 1}
        shapes = [{**line, "line": {"color": INK, "width": 1, "dash": "dash"}}]
        ends = np.log10(panel.span).tolist() if panel.none else list(panel.span)
        kind = {"type": "log", "tickvals": ratio_ticks(panel.span)} if panel.none else {"nticks": 7}
        x = screen.axis("", zeroline=False, range=ends, **kind)
        ticks = {"tickvals": list(range(len(self.metrics))), "ticktext": [screen.plain(name) for name in self.metrics]}
        y = screen.axis("", range=[len(self.metrics) - 0.5, -0.5], zeroline=False, **ticks)
        height = 90 + 24 * len(self.metrics)
        return {"data": data, "layout": screen.layout(x, y, height, panel.title, shapes=shapes, hovermode="closest")}

    def _words(self, panel: ChangePanel, row: int) -> str:
        ends = f"{number(float(panel.lower[row]), 3)} to {number(float(panel.upper[row]), 3)}"
        return f"{self.metrics[row]}: {number(float(panel.value[row]), 3)}, {ends}"

    def printed(self) -> Figure:
        figure, axes = paper.new_figure(0.7 + 0.17 * len(self.metrics), 1, len(self.panels))
        for axis, panel in zip(axes, self.panels, strict=True):
            self._print_panel(axis, panel)
        axes[0].set_yticks(range(len(self.metrics)), [paper.literal(name) for name in self.metrics])
        for axis in axes[1:]:
            axis.set_yticks(range(len(self.metrics)), [])
        paper.add_key(figure, self.key)
        return figure

    def _print_panel(self, axis: Axes, panel: ChangePanel) -> None:
        if panel.none:
            axis.set_xscale("log")
            axis.set_xticks(ratio_ticks(panel.span), [number(tick, 3) for tick in ratio_ticks(panel.span)])
            axis.minorticks_off()
        for sure, (colour, sign) in enumerate(MARKS):
            rows = np.flatnonzero(np.isfinite(panel.value) & (panel.significant == bool(sure)))
            axis.hlines(rows, panel.lower[rows], panel.upper[rows], on_paper(colour), linewidth=1.2)
            axis.plot(panel.value[rows], rows, paper.SIGNS[sign], color=on_paper(colour), markersize=4)
        axis.axvline(panel.none, color=on_paper(INK), linestyle="--", linewidth=0.7)
        axis.set_xlim(panel.span)
        axis.set_ylim(len(self.metrics) - 0.5, -0.5)
        axis.set_title(paper.literal(panel.title), fontsize=7.5)


def ratio_ticks(span: tuple[float, float]) -> list[float]:
    """Round ratios inside the span, at most seven of them, 1 always among them."""
    for steps in ((1.0, 1.02, 1.04, 1.06, 1.08), (1.0, 1.05, 1.1, 1.15, 1.2), (1.0, 1.1, 1.2, 1.3, 1.5),
                  (1.0, 1.25, 1.5, 2.0, 3.0), (1.0, 2.0, 5.0, 10.0, 20.0), (1.0, 10.0, 100.0, 1e3, 1e4)):  # fmt: skip
        if max(span[1], 1.0 / span[0]) <= steps[-1] * 1.05:
            break
    ticks = sorted({round(1.0 / step, 3) for step in steps} | set(steps))
    return [tick for tick in ticks if span[0] <= tick <= span[1]]
