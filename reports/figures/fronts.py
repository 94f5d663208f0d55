"""Objectives of a tuning against each other: every candidate, the front, and what is published."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.document import Drawing, Key
from reports.figures import paper, screen
from reports.figures.palette import BLUE, INK, MUTED, ORANGE, SKY, VERMILION, on_paper
from reports.numbers import count, number

MOST_PANELS = 6
MARGIN = 0.06  # of the shown range


@dataclass(frozen=True)
class FrontDrawing(Drawing):
    """labels : axis label of every objective, two or more.  The arrays have a column for each of them.

    first_small : whether the first objective is to be small; the line runs round what the front dominates
    feasible, infeasible : candidates to show, the front not among them, of n_feasible and n_infeasible
    front : float64[n, n_objectives], in the order of the first objective; relaxed : whether it leaves out constraints
    published : name and values of each point
    """

    labels: tuple[str, ...]
    feasible: np.ndarray
    infeasible: np.ndarray
    front: np.ndarray
    relaxed: bool
    n_feasible: int
    n_infeasible: int
    first_small: bool = True
    published: tuple[tuple[str, tuple[float, ...]], ...] = ()

    @property
    def key(self) -> tuple[Key, ...]:
        entries = []
        if len(self.front):
            what = "best if the constraints are left out" if self.relaxed else "front"
            entries.append(Key("line", self._front_colour, f"{what}: {count(len(self.front))} candidates"))
        if self.n_feasible:
            entries.append(Key("point", SKY, f"{count(self.n_feasible)} feasible candidates"))
        if self.n_infeasible:
            entries.append(Key("point", MUTED, f"{count(self.n_infeasible)} candidates outside a constraint"))
        entries += [Key("ring", self._published_colour(k), name) for k, (name, _) in enumerate(self.published)]
        return tuple(entries)

    @property
    def _front_colour(self) -> str:
        return ORANGE if self.relaxed else BLUE

    def _published_colour(self, index: int) -> str:
        return (VERMILION, INK)[index % 2]

    @property
    def alternative(self) -> str:
        if not len(self.front):
            return f"No candidate has a number for {' and '.join(self.labels)}."
        ranges = [
            f"{label} {number(float(values.min()), 4)} to {number(float(values.max()), 4)}"
            for label, values in zip(self.labels, self.front.T, strict=True)
        ]
        points = [f"{name} at ({', '.join(number(value, 4) for value in values)})" for name, values in self.published]
        return f"Front of {len(self.front)} candidates: {'; '.join([*ranges, *points])}."

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """The objectives of each panel."""
        return list(combinations(range(len(self.labels)), 2))[:MOST_PANELS]

    def reach(self, objective: int) -> tuple[float, float]:
        """Axis range: the front, the published points, and the nearer half of the candidates."""
        cloud = np.concatenate([self.feasible[:, objective], self.infeasible[:, objective]])
        near = [self.front[:, objective], np.array([values[objective] for _, values in self.published])]
        middle = np.array([np.median(cloud)]) if cloud.size else np.empty(0)
        places = np.concatenate([*near, middle])
        low, high = (float(places.min()), float(places.max())) if places.size else (0.0, 1.0)
        margin = MARGIN * (high - low) or 0.05 * max(abs(low), 1.0)
        return low - margin, high + margin

    @property
    def n_outside(self) -> int:
        """Candidates beyond the axes of the first panel."""
        cloud = np.vstack([self.feasible, self.infeasible])
        inside = np.ones(len(cloud), dtype=bool)
        for objective in (0, 1):
            low, high = self.reach(objective)
            inside &= (cloud[:, objective] >= low) & (cloud[:, objective] <= high)
        return int(np.count_nonzero(~inside))

    def interactive(self) -> list[dict[str, Any]]:
        return [self._screen_panel(*pair) for pair in self.pairs]

    def _screen_panel(self, i: int, j: int) -> dict[str, Any]:
        data = []
        for points, colour, name in ((self.infeasible, MUTED, "infeasible"), (self.feasible, SKY, "feasible")):
            marker = {"size": 4, "color": colour, "opacity": 0.45}
            data.append(_trace(points[:, i], points[:, j], "markers", name, marker=marker))
        mode = "lines+markers" if len(self.labels) == 2 else "markers"
        steps = {"shape": "hv" if self.first_small else "vh", "color": self._front_colour, "width": 1.6}
        marker = {"size": 6, "color": self._front_colour}
        data.append(_trace(self.front[:, i], self.front[:, j], mode, "front", marker=marker, line=steps))
        for k, (name, values) in enumerate(self.published):
            marker = {"size": 12, "color": "#ffffff", "line": {"width": 3, "color": self._published_colour(k)}}
            data.append(_trace([values[i]], [values[j]], "markers", name, marker=marker))
        x = screen.axis(self.labels[i], zeroline=False, range=list(self.reach(i)))
        y = screen.axis(self.labels[j], zeroline=False, range=list(self.reach(j)))
        return {"data": data, "layout": screen.layout(x, y, 440, hovermode="closest")}

    def printed(self) -> Figure:
        columns = min(2, len(self.pairs))
        rows = -(-len(self.pairs) // columns)
        figure, axes = paper.new_figure(0.5 + (3.4 if columns == 1 else 2.6) * rows, rows, columns)
        for axis, pair in zip(axes, self.pairs, strict=False):
            self._print_panel(axis, *pair)
        for axis in axes[len(self.pairs) :]:
            axis.set_axis_off()
        paper.add_key(figure, self.key)
        return figure

    def _print_panel(self, axis: Axes, i: int, j: int) -> None:
        for points, colour in ((self.infeasible, MUTED), (self.feasible, SKY)):
            axis.scatter(points[:, i], points[:, j], s=3.0, color=on_paper(colour), alpha=0.5, linewidths=0)
        front = self.front
        if len(self.labels) == 2:
            axis.step(
                front[:, i],
                front[:, j],
                where="post" if self.first_small else "pre",
                color=self._front_colour,
                linewidth=1.2,
            )
        axis.scatter(front[:, i], front[:, j], s=12.0, color=self._front_colour, linewidths=0, zorder=3)
        for k, (_, values) in enumerate(self.published):
            colour = on_paper(self._published_colour(k))
            axis.plot(values[i], values[j], "o", markersize=7, markerfacecolor="white", color=colour, zorder=4)
        axis.set(xlim=self.reach(i), ylim=self.reach(j))
        axis.set(xlabel=paper.literal(self.labels[i]), ylabel=paper.literal(self.labels[j]))


def _trace(x: Sequence[float] | np.ndarray, y: Sequence[float] | np.ndarray, mode: str, name: str, **more: Any) -> Any:
    return {
        "type": "scatter",
        "mode": mode,
        "x": screen.rounded(x),
        "y": screen.rounded(y),
        "name": screen.plain(name),
        "hovertemplate": "(%{x}, %{y})<extra>%{fullData.name}</extra>",
        **more,
    }
