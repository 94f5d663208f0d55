"""Success probability along single inputs, with exact limits, a panel per requirement and input."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mc_engine.statistics.drivers import SuccessCurve
from reports.document import Drawing, Key
from reports.figures import paper, screen
from reports.figures.palette import BLUE, MUTED, VERMILION, on_paper
from reports.numbers import count, number, percent

PANELS_IN_A_ROW = 2


@dataclass(frozen=True)
class SuccessPanel:
    """title : the requirement;  label : of the input's axis;  overall : success probability of all cases."""

    title: str
    label: str
    curve: SuccessCurve
    overall: float

    @property
    def share(self) -> np.ndarray:
        """float64[n_bins], percent."""
        return 100.0 * self.curve.passed / self.curve.tried

    @property
    def errors(self) -> tuple[np.ndarray, np.ndarray]:
        """Distances to the limits below and above, percent."""
        below = np.maximum(self.share - 100.0 * self.curve.lower, 0.0)
        return below, np.maximum(100.0 * self.curve.upper - self.share, 0.0)

    @property
    def names(self) -> tuple[str, ...]:
        """Levels of a group, as far as they were flown."""
        return tuple(self.curve.levels[int(k)] for k in self.curve.middle) if self.curve.levels else ()

    @property
    def places(self) -> np.ndarray:
        return np.arange(self.curve.middle.size, dtype=np.float64) if self.curve.levels else self.curve.middle


@dataclass(frozen=True)
class SuccessDrawing(Drawing):
    """confidence : of the limits, two-sided."""

    panels: tuple[SuccessPanel, ...]
    confidence: float

    @property
    def key(self) -> tuple[Key, ...]:
        limits = f"share of the cases in a bin that pass, with its {percent(self.confidence)} Clopper–Pearson interval"
        return (
            Key("point", BLUE, f"{limits}; at the bin's median"),
            Key("line", MUTED, "extent of the bin"),
            Key("dash", VERMILION, "all cases"),
        )

    @property
    def alternative(self) -> str:
        parts = []
        for panel in self.panels:
            low, high = int(panel.share.argmin()), int(panel.share.argmax())
            ends = [panel.names[k] if panel.names else number(float(panel.curve.middle[k]), 3) for k in (low, high)]
            parts.append(
                f"{panel.title} along {panel.label}: lowest {number(float(panel.share[low]), 3)} % at {ends[0]}, "
                f"highest {number(float(panel.share[high]), 3)} % at {ends[1]}"
            )
        return f"Success probability in bins of single inputs. {'; '.join(parts)}."

    def interactive(self) -> list[dict[str, Any]]:
        return [self._screen_panel(panel) for panel in self.panels]

    def _screen_panel(self, panel: SuccessPanel) -> dict[str, Any]:
        below, above = panel.errors
        data: list[dict[str, Any]] = []
        if not panel.names:
            for low, high, share in zip(panel.curve.low, panel.curve.high, panel.share, strict=True):
                extent = {
                    "type": "scatter",
                    "mode": "lines",
                    "x": screen.rounded([low, high], 8),
                    "y": screen.rounded([share, share]),
                    "line": {"color": MUTED, "width": 1.5},
                    "hoverinfo": "skip",
                }
                data.append(extent)
        told = [
            f"{count(int(passed))} of {count(int(tried))} cases"
            for passed, tried in zip(panel.curve.passed, panel.curve.tried, strict=True)
        ]
        points = {
            "type": "scatter",
            "mode": "markers",
            "x": screen.rounded(panel.places, 8),
            "y": screen.rounded(panel.share),
            "error_y": {
                "type": "data",
                "symmetric": False,
                "array": screen.rounded(above),
                "arrayminus": screen.rounded(below),
                "color": BLUE,
                "thickness": 1.6,
                "width": 4,
            },
            "marker": {"size": 7, "color": BLUE},
            "text": told,
            "hovertemplate": "%{text} pass: %{y:.4g} %<extra></extra>",
        }
        data.append(points)
        level = {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": 100.0 * panel.overall,
                 "y1": 100.0 * panel.overall, "line": {"color": VERMILION, "width": 1.4, "dash": "dash"}}  # fmt: skip
        ticks = {"tickvals": panel.places.tolist(), "ticktext": [screen.plain(name) for name in panel.names]}
        x = screen.axis(panel.label, zeroline=False, nticks=6, **(ticks if panel.names else {}))
        y = screen.axis("pass [%]", zeroline=False, nticks=5)
        return {
            "data": data,
            "layout": screen.layout(x, y, 280, panel.title, hovermode="closest", shapes=[level]),
        }

    def printed(self) -> Figure:
        columns = min(PANELS_IN_A_ROW, len(self.panels))
        rows = -(-len(self.panels) // columns)
        figure, axes = paper.new_figure(0.5 + 1.75 * rows, rows, columns)
        for axis, panel in zip(axes, self.panels, strict=False):
            self._print_panel(axis, panel)
        for axis in axes[len(self.panels) :]:
            axis.set_axis_off()
        paper.add_key(figure, self.key, columns=1)
        return figure

    def _print_panel(self, axis: Axes, panel: SuccessPanel) -> None:
        if not panel.names:
            axis.hlines(panel.share, panel.curve.low, panel.curve.high, on_paper(MUTED), linewidth=0.9)
        axis.errorbar(
            panel.places,
            panel.share,
            np.array(panel.errors),
            fmt="o",
            color=BLUE,
            markersize=3,
            linewidth=1.0,
            capsize=2,
        )
        axis.axhline(100.0 * panel.overall, color=VERMILION, linestyle="--", linewidth=1.0)
        axis.set(xlabel=paper.literal(panel.label), ylabel="pass [%]")
        axis.set_title(paper.literal(panel.title), fontsize=7.5)
        paper.few_ticks(axis)
        if panel.names:
            axis.set_xticks(panel.places, [paper.literal(name) for name in panel.names])
            axis.set_xlim(-0.5, len(panel.names) - 0.5)
