"""How a search went on: one curve a panel over the candidates flown so far."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from reports.document import Drawing, Key
from reports.figures import paper, screen
from reports.figures.palette import BLUE
from reports.numbers import number

X_LABEL = "candidates flown"


@dataclass(frozen=True)
class Convergence(Drawing):
    """x : float64[n], candidates flown up to each generation; curves : float64[n] by label, NaN where undefined."""

    x: np.ndarray
    curves: dict[str, np.ndarray]

    @property
    def key(self) -> tuple[Key, ...]:
        return (Key("line", BLUE, f"after each of {self.x.size} generations"),)

    @property
    def alternative(self) -> str:
        ends = [f"{label} {number(float(y[0]), 4)} to {number(float(y[-1]), 4)}" for label, y in self.curves.items()]
        return f"Curves over {number(float(self.x[-1]), 6)} candidates: {'; '.join(ends)}."

    def interactive(self) -> list[dict[str, Any]]:
        return [self._screen_panel(label, y) for label, y in self.curves.items()]

    def _screen_panel(self, label: str, y: np.ndarray) -> dict[str, Any]:
        curve = {
            "type": "scatter",
            "mode": "lines",
            "x": screen.rounded(self.x),
            "y": screen.rounded(y),
            "line": {"color": BLUE, "width": 2, "shape": "hv"},
            "hovertemplate": "%{x}: %{y:.5g}<extra></extra>",
        }
        axes = screen.axis(X_LABEL, zeroline=False), screen.axis("", nticks=6, rangemode="tozero")
        return {"data": [curve], "layout": screen.layout(*axes, 250, label)}

    def printed(self) -> Figure:
        figure, axes = paper.new_figure(2.3, 1, len(self.curves))
        for axis, (label, y) in zip(axes, self.curves.items(), strict=True):
            axis.step(self.x, y, where="post", color=BLUE, linewidth=1.2)
            axis.set_ylim(bottom=min(0.0, float(np.nanmin(y, initial=0.0))))
            axis.set_title(paper.literal(label))
            axis.set_xlabel(X_LABEL)
            paper.few_ticks(axis, 4, 4)
        return figure
