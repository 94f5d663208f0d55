"""How a small probability was reached: the probability of each level over its margin, down to the limit."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from reports.document import Drawing, Key
from reports.figures import paper, screen
from reports.figures.palette import BLUE, INK, VERMILION, on_paper
from reports.numbers import number

Y_LABEL = "probability of being nearer"


@dataclass(frozen=True)
class Tail(Drawing):
    """margin, probability : float64[n], of the levels;  estimate : (probability, lower, upper) at margin zero.

    label : of the margin, with its unit.
    """

    label: str
    margin: np.ndarray
    probability: np.ndarray
    estimate: tuple[float, float, float]

    @property
    def key(self) -> tuple[Key, ...]:
        return (Key("line", BLUE, "levels"), Key("point", VERMILION, "not met, with its interval"))

    @property
    def alternative(self) -> str:
        p, lower, upper = (number(value, 4) for value in self.estimate)
        return (
            f"The probability falls over {self.margin.size} levels as the margin falls to zero, where it is {p}, "
            f"interval {lower} to {upper}."
        )

    def interactive(self) -> list[dict[str, Any]]:
        p, lower, upper = self.estimate
        levels = {
            "type": "scatter",
            "mode": "lines+markers",
            "x": screen.rounded(self.margin),
            "y": screen.rounded(self.probability),
            "line": {"color": BLUE, "width": 2},
            "hovertemplate": "margin %{x}: %{y:.3g}<extra></extra>",
        }
        point = {
            "type": "scatter",
            "mode": "markers",
            "x": [0.0],
            "y": screen.rounded([p]),
            "marker": {"size": 8, "color": VERMILION},
            "error_y": {
                "type": "data",
                "symmetric": False,
                "array": screen.rounded([upper - p]),
                "arrayminus": screen.rounded([p - lower]),
                "color": VERMILION,
            },
            "hovertemplate": "not met: %{y:.3g}<extra></extra>",
        }
        axes = screen.axis(self.label, autorange="reversed"), screen.axis(Y_LABEL, type="log", dtick=1)
        return [{"data": [levels, point], "layout": screen.layout(*axes, 340)}]

    def printed(self) -> Figure:
        p, lower, upper = self.estimate
        figure, (axis,) = paper.new_figure(2.8)
        axis.semilogy(self.margin, self.probability, color=BLUE, marker="o", markersize=3, linewidth=1.2)
        axis.errorbar([0.0], [p], [[p - lower], [upper - p]], color=VERMILION, marker="o", markersize=4, capsize=3)
        axis.axvline(0.0, color=on_paper(INK), linewidth=0.6)
        axis.invert_xaxis()
        axis.set_xlabel(paper.literal(self.label))
        axis.set_ylabel(Y_LABEL)
        paper.add_key(figure, self.key)
        return figure
