"""Metrics by the level of a choice: where half and nine tenths of the cases lie, a row a level, a panel a metric."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.document import Drawing, Key
from reports.figures import paper, screen
from reports.figures.palette import BLUE, MUTED, ORANGE, SKY, on_paper
from reports.numbers import count, number

SPREAD = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)  # probabilities of what is drawn
LOGARITHMIC = 30.0  # medians this far apart are drawn on a logarithmic axis
PANELS_IN_A_ROW = 2


@dataclass(frozen=True)
class LevelPanel:
    """One metric: quantiles float64[n_levels, 7] at SPREAD (NaN for a level without a number) and counts of numbers."""

    label: str
    quantiles: np.ndarray
    used: tuple[int, ...]

    @property
    def logarithmic(self) -> bool:
        """Whether the levels lie too far apart for one linear axis."""
        middle = self.quantiles[:, 3][np.isfinite(self.quantiles[:, 3])]
        return bool(middle.size and np.nanmin(self.quantiles) > 0.0 and middle.max() > LOGARITHMIC * middle.min())

    @property
    def title(self) -> str:
        return f"{self.label}{', logarithmic' if self.logarithmic else ''}"


@dataclass(frozen=True)
class LevelsDrawing(Drawing):
    """Panels over the same levels, of which the first stands on top.  what : the choice, in words."""

    what: str
    levels: tuple[str, ...]
    panels: tuple[LevelPanel, ...]

    @property
    def key(self) -> tuple[Key, ...]:
        return (
            Key("point", ORANGE, "median"),
            Key("bar", BLUE, "middle half of the cases"),
            Key("bar", SKY, "5 % to 95 %"),
            Key("line", MUTED, "all cases"),
        )

    @property
    def alternative(self) -> str:
        parts = []
        for panel in self.panels:
            medians = ", ".join(
                f"{level} {number(float(row[3]), 3) if used else 'no number'}"
                for level, row, used in zip(self.levels, panel.quantiles, panel.used, strict=True)
            )
            parts.append(f"{panel.label}: {medians}")
        return f"Medians by {self.what}. {'; '.join(parts)}."

    def interactive(self) -> list[dict[str, Any]]:
        return [self._screen_panel(panel) for panel in self.panels]

    def _screen_panel(self, panel: LevelPanel) -> dict[str, Any]:
        data: list[dict[str, Any]] = []
        # Places are numbers, not words: plotly would read a level such as "2" as a number or a date.
        for place, (level, row, used) in enumerate(zip(self.levels, panel.quantiles, panel.used, strict=True)):
            text = f"{level}, {count(used)} cases"
            for low, high, colour, width in ((0, 6, MUTED, 1.2), (1, 5, SKY, 7), (2, 4, BLUE, 11)):
                trace = {
                    "type": "scatter",
                    "mode": "lines",
                    "x": screen.rounded(row[[low, high]]),
                    "y": [place, place],
                    "line": {"color": colour, "width": width},
                    "text": screen.plain(text),
                    "hovertemplate": "%{text}: %{x:.5g}<extra></extra>",
                }
                data.append(trace)
        middle = {
            "type": "scatter",
            "mode": "markers",
            "x": screen.rounded(panel.quantiles[:, 3]),
            "y": list(range(len(self.levels))),
            "marker": {"size": 8, "color": ORANGE, "line": {"width": 1, "color": "#ffffff"}},
            "text": [screen.plain(level) for level in self.levels],
            "hovertemplate": "%{text}: median %{x:.5g}<extra></extra>",
        }
        data.append(middle)
        kind = {"type": "log"} if panel.logarithmic else {}
        x = screen.axis("", zeroline=False, nticks=6, **kind)
        ticks = {"tickvals": list(range(len(self.levels))), "ticktext": [screen.plain(level) for level in self.levels]}
        y = screen.axis("", range=[len(self.levels) - 0.5, -0.5], showgrid=False, zeroline=False, **ticks)
        height = 90 + 26 * len(self.levels)
        return {"data": data, "layout": screen.layout(x, y, height, panel.title, hovermode="closest")}

    def printed(self) -> Figure:
        columns = min(PANELS_IN_A_ROW, len(self.panels))
        rows = -(-len(self.panels) // columns)
        figure, axes = paper.new_figure(0.4 + rows * (0.65 + 0.17 * len(self.levels)), rows, columns)
        for axis, panel in zip(axes, self.panels, strict=False):
            self._print_panel(axis, panel)
        for axis in axes[len(self.panels) :]:
            axis.set_axis_off()
        paper.add_key(figure, self.key, columns=4)
        return figure

    def _print_panel(self, axis: Axes, panel: LevelPanel) -> None:
        places = np.arange(len(self.levels))
        for low, high, colour, width in ((0, 6, MUTED, 0.8), (1, 5, SKY, 4.0), (2, 4, BLUE, 7.0)):
            axis.hlines(places, panel.quantiles[:, low], panel.quantiles[:, high], on_paper(colour), linewidth=width)
        axis.plot(panel.quantiles[:, 3], places, "o", color=ORANGE, markersize=4, markeredgecolor="white")
        if panel.logarithmic:
            axis.set_xscale("log")
        axis.set_yticks(places, [paper.literal(level) for level in self.levels])
        axis.set_ylim(len(self.levels) - 0.5, -0.5)
        axis.set_title(paper.literal(panel.title), fontsize=7.5)
        axis.grid(axis="y", visible=False)
