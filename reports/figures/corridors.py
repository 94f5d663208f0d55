"""The cases over two columns, coloured by the limits that they violate, with the limits where they run."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from reports.document import Drawing, Key
from reports.figures import paper, screen
from reports.figures.palette import BLUE, GREEN, INK, MUTED, ORANGE, PURPLE, SKY, VERMILION, on_paper
from reports.numbers import count, number

INSIDE = 0  # the class of the cases inside all limits
COLOURS = (BLUE, VERMILION, ORANGE, PURPLE, GREEN, SKY, MUTED)
SIGNS = ("circle", "x", "diamond", "square", "triangle-up", "cross", "star")
_DASHES = ("dash", "dot", "solid")
_PRINT_DASHES = ("--", ":", "-")


@dataclass(frozen=True)
class LimitLine:
    """Where a limit runs: its words and curves float64[k, 2]."""

    text: str
    curves: tuple[np.ndarray, ...]


@dataclass(frozen=True)
class CorridorDrawing(Drawing):
    """Points of the cases shown and the class of each; 0 is inside, the others are in the order of `classes`.

    classes : words and number of cases of each class, of all that have a place;  n_used of n_tried have one.
    """

    x: np.ndarray
    y: np.ndarray
    case_ids: np.ndarray
    member: np.ndarray
    classes: tuple[tuple[str, int], ...]
    limits: tuple[LimitLine, ...]
    x_label: str
    y_label: str
    n_used: int
    n_tried: int
    nominal: tuple[float, float] | None

    @property
    def key(self) -> tuple[Key, ...]:
        entries = [
            Key("point", COLOURS[k % len(COLOURS)], f"{words}: {count(cases)}", SIGNS[k % len(SIGNS)])
            for k, (words, cases) in enumerate(self.classes)
            if cases
        ]
        entries += [
            Key(("dash", "dot", "line")[k % 3], INK, f"{limit.text}, in the mean over the other inputs")
            for k, limit in enumerate(self.limits)
        ]
        return (*entries, Key("ring", INK, "nominal")) if self.nominal else tuple(entries)

    @property
    def alternative(self) -> str:
        parts = ", ".join(f"{words}: {count(cases)}" for words, cases in self.classes if cases)
        return (
            f"{count(self.n_used)} of {count(self.n_tried)} cases over {self.x_label} from "
            f"{number(float(self.x.min()), 4)} to {number(float(self.x.max()), 4)} and {self.y_label} from "
            f"{number(float(self.y.min()), 4)} to {number(float(self.y.max()), 4)}; {parts}."
        )

    def interactive(self) -> list[dict[str, Any]]:
        data: list[dict[str, Any]] = []
        for k, (words, _) in enumerate(self.classes):
            rows = self.member == k
            if rows.any():
                trace = {
                    "type": "scatter",
                    "mode": "markers",
                    "x": screen.rounded(self.x[rows], 8),
                    "y": screen.rounded(self.y[rows], 8),
                    "meta": screen.CASES,
                    "customdata": [int(case) for case in self.case_ids[rows]],
                    "name": screen.plain(words),
                    "marker": {
                        "size": 4 if k == INSIDE else 6,
                        "color": COLOURS[k % len(COLOURS)],
                        "opacity": 0.55 if k == INSIDE else 0.9,
                        "symbol": SIGNS[k % len(SIGNS)],
                    },
                    "hovertemplate": "case %{customdata}: (%{x}, %{y})<extra>%{fullData.name}</extra>",
                }
                data.append(trace)
        for k, limit in enumerate(self.limits):
            for curve in limit.curves:
                trace = {
                    "type": "scatter",
                    "mode": "lines",
                    "x": screen.rounded(curve[:, 0], 8),
                    "y": screen.rounded(curve[:, 1], 8),
                    "line": {"color": INK, "width": 1.8, "dash": _DASHES[k % 3]},
                    "text": screen.plain(limit.text),
                    "hovertemplate": "%{text}<extra></extra>",
                }
                data.append(trace)
        if self.nominal:
            data.append(screen.ring(self.nominal, INK, "nominal"))
        x, y = screen.axis(self.x_label, zeroline=False), screen.axis(self.y_label, zeroline=False)
        return [{"data": data, "layout": screen.layout(x, y, 460, hovermode="closest", dragmode="select")}]

    def printed(self) -> Figure:
        figure, (axis,) = paper.new_figure(3.9)
        for k in range(len(self.classes)):
            rows = self.member == k
            size, opacity, width = (3.0, 0.5, 0.0) if k == INSIDE else (9.0, 1.0, 0.8)
            colour, sign = on_paper(COLOURS[k % len(COLOURS)]), paper.SIGNS[SIGNS[k % len(SIGNS)]]
            axis.scatter(self.x[rows], self.y[rows], s=size, color=colour, marker=sign, alpha=opacity, linewidths=width)
        for k, limit in enumerate(self.limits):
            for curve in limit.curves:
                axis.plot(*curve.T, color=on_paper(INK), linestyle=_PRINT_DASHES[k % 3], linewidth=1.0)
        if self.nominal:
            axis.plot(
                *self.nominal, "o", markersize=6, markerfacecolor="none", color=on_paper(INK), markeredgewidth=1.6
            )
        axis.set(xlabel=paper.literal(self.x_label), ylabel=paper.literal(self.y_label))
        paper.add_key(figure, self.key, columns=2)
        return figure
