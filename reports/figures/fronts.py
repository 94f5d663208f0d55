"""Objectives of a tuning against each other: every candidate, the front, and what is published."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from reports.drawing.marks import Axis, Drawing, Line, Plot, Points, nominal_ring
from reports.drawing.palette import BLUE, INK, MUTED, ORANGE, PAPER, SKY, VERMILION
from reports.text.numbers import count, number

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

    @property
    def plots(self) -> tuple[Plot, ...]:
        return tuple(self._plot(*pair) for pair in self.pairs)

    def _plot(self, i: int, j: int) -> Plot:
        clouds = (
            (self.infeasible, MUTED, "candidates outside a constraint", self.n_infeasible),
            (self.feasible, SKY, "feasible candidates", self.n_feasible),
        )
        marks: list[Points | Line] = [
            Points(points[:, i], points[:, j], colour, name, opacity=0.45, key=f"{count(n)} {name}" if n else "")
            for points, colour, name, n in clouds
        ]
        name = "best if the constraints are left out" if self.relaxed else "front"
        x, y = self.front[:, i], self.front[:, j]
        if len(self.labels) == 2:
            marks.append(Line(x, y, self._front_colour, "front", width=1.6, step="hv" if self.first_small else "vh"))
        key = f"{name}: {count(len(x))} candidates" if len(x) else ""
        marks.append(Points(x, y, self._front_colour, name, size=6.0, key=key))
        for k, (name, values) in enumerate(self.published):
            marks.append(nominal_ring((values[i], values[j]), self._published_colour(k), name, PAPER))
        x_axis, y_axis = (Axis(self.labels[k], reach=self.reach(k)) for k in (i, j))
        return Plot(tuple(marks), x_axis, y_axis, height=440.0 if len(self.pairs) == 1 else 340.0)
