"""One column against another, a point a case."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from reports.document import Drawing, Key
from reports.figures import paper, screen
from reports.figures.palette import BLUE, VERMILION
from reports.numbers import count, number


@dataclass(frozen=True)
class ScatterDrawing(Drawing):
    """x, y : float64[k] of the cases shown (finite), with case_ids int64[k]; n_used of n_tried have both numbers."""

    x: np.ndarray
    y: np.ndarray
    case_ids: np.ndarray
    x_label: str
    y_label: str
    n_used: int
    n_tried: int
    nominal: tuple[float, float] | None

    @property
    def key(self) -> tuple[Key, ...]:
        shown = "all shown" if self.x.size == self.n_used else f"{count(self.x.size)} shown"
        cases = Key("point", BLUE, f"{count(self.n_used)} of {count(self.n_tried)} cases, {shown}")
        return (cases, Key("ring", VERMILION, "nominal")) if self.nominal else (cases,)

    @property
    def alternative(self) -> str:
        return (
            f"Scatter of {self.y_label}, {number(float(self.y.min()), 4)} to {number(float(self.y.max()), 4)}, against "
            f"{self.x_label}, {number(float(self.x.min()), 4)} to {number(float(self.x.max()), 4)}; "
            f"{count(self.n_used)} of {count(self.n_tried)} cases."
        )

    def interactive(self) -> list[dict[str, Any]]:
        cloud = {
            "type": "scatter",
            "mode": "markers",
            "x": screen.rounded(self.x, 8),
            "y": screen.rounded(self.y, 8),
            "customdata": [int(case) for case in self.case_ids],
            "marker": {"size": 4, "color": BLUE, "opacity": 0.55},
            "hovertemplate": "case %{customdata}: (%{x}, %{y})<extra></extra>",
        }
        data: list[dict[str, Any]] = [cloud]
        if self.nominal:
            data.append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "x": [self.nominal[0]],
                    "y": [self.nominal[1]],
                    "marker": {"size": 11, "color": "#ffffff", "line": {"width": 3, "color": VERMILION}},
                    "hovertemplate": "nominal (%{x}, %{y})<extra></extra>",
                }
            )
        x, y = screen.axis(self.x_label, zeroline=False), screen.axis(self.y_label, zeroline=False)
        return [{"data": data, "layout": screen.layout(x, y, 420, hovermode="closest")}]

    def printed(self) -> Figure:
        figure, (axis,) = paper.new_figure(3.4)
        axis.scatter(self.x, self.y, s=3.0, color=BLUE, alpha=0.5, linewidths=0)
        if self.nominal:
            axis.plot(*self.nominal, "o", markersize=6, markerfacecolor="white", color=VERMILION, markeredgewidth=1.6)
        axis.set(xlabel=paper.literal(self.x_label), ylabel=paper.literal(self.y_label))
        paper.add_key(figure, self.key)
        return figure
