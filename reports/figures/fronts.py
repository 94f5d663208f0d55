"""Objectives of a tuning against each other: every candidate, the front, and what is published."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from reports.drawing.marks import Axis, Drawing, Line, Mark, Plot, Points, nominal_ring, stepped
from reports.drawing.palette import BLUE, INK, MUTED, ORANGE, SKY, VERMILION
from reports.text.numbers import counted

MOST_PANELS = 6
MARGIN = 0.06  # of the shown range


def front_figure(
    labels: Sequence[str],
    candidates: Sequence[tuple[str, int, np.ndarray]],
    front: np.ndarray,
    published: Sequence[tuple[str, Sequence[float]]],
    *,
    relaxed: bool,
    first_small: bool,
) -> Drawing:
    """Panels of all pairs of the objectives.  labels : of their axes.

    candidates : of each kind, its words, how many there are, and the objectives float64[n, n_objectives] of those shown
    front : float64[n, n_objectives], in the order of the first objective, not among the candidates;
    relaxed : whether it leaves out constraints;  published : name and values of each point
    first_small : whether the first objective is to be small; the line runs round what the front dominates
    """
    cloud = np.vstack([shown for _, _, shown in candidates])
    pairs = list(combinations(range(len(labels)), 2))[:MOST_PANELS]
    name, colour = ("best if the constraints are left out", ORANGE) if relaxed else ("front", BLUE)
    # The front, the published points, and the nearer half of the candidates.
    middle = np.median(cloud, axis=0, keepdims=True) if cloud.size else cloud
    places = np.vstack([front, middle, *(values for _, values in published)])
    axes = [Axis(label, reach=Axis(margin=MARGIN).ends([seen])) for label, seen in zip(labels, places.T, strict=True)]
    plots = []
    for i, k in pairs:
        marks: list[Mark] = []
        for tint, (words, number, shown) in zip((MUTED, SKY), candidates, strict=True):
            key = f"{words}: {counted(number, 'candidate')}" * bool(number)
            marks.append(Points(shown[:, i], shown[:, k], tint, words, opacity=0.45, key=key))
        x, y = front[:, i], front[:, k]
        if len(pairs) == 1:
            steps = stepped(x, y) if first_small else stepped(y, x)[::-1]
            marks.append(Line(*steps, colour, "front", width=1.6))
        marks.append(
            Points(x, y, colour, name, size=6.0, key=f"{name}: {counted(len(x), 'candidate')}" if len(x) else "")
        )
        for place, (point, values) in enumerate(published):
            marks.append(nominal_ring((values[i], values[k]), (VERMILION, INK)[place % 2], point))
        plots.append(Plot(tuple(marks), axes[i], axes[k], height=440.0 if len(pairs) == 1 else 340.0))
    return Drawing("Candidates and the front of the objectives", tuple(plots))


def candidates_beyond(plot: Plot) -> int:
    """How many of the candidates drawn in a panel of `front_figure` lie beyond its axes."""
    (x_low, x_high), (y_low, y_high) = plot.ends
    clouds = [mark for mark in plot.marks[:2] if isinstance(mark, Points)]
    x, y = (np.concatenate([getattr(cloud, axis) for cloud in clouds]) for axis in "xy")
    return int(np.count_nonzero((x < x_low) | (x > x_high) | (y < y_low) | (y > y_high)))
