"""The cases over two columns, coloured by the limits that they violate, with the limits where they run."""

from dataclasses import dataclass

import numpy as np

from reports.drawing.marks import Axis, Drawing, Line, Plot, Points, nominal_ring, region
from reports.drawing.palette import BLUE, DASHES, GREEN, INK, MUTED, ORANGE, PURPLE, SKY, VERMILION
from reports.text.numbers import count

INSIDE = 0  # the class of the cases inside all limits
COLOURS = (BLUE, VERMILION, ORANGE, PURPLE, GREEN, SKY, MUTED)
SIGNS = ("circle", "x", "diamond", "square", "triangle-up", "cross", "star")


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
    columns: tuple[str, str] | None = None
    form = "Cases by the limits that they violate"

    @property
    def plots(self) -> tuple[Plot, ...]:
        marks: list[Points | Line] = [self._cloud(k, *one) for k, one in enumerate(self.classes)]
        for k, limit in enumerate(self.limits):
            dash = (*DASHES[1:], DASHES[0])[k % len(DASHES)]
            marks.append(
                region(limit.curves, INK, dash, limit.text, f"{limit.text}, in the mean over the other inputs")
            )
        if self.nominal:
            marks.append(nominal_ring(self.nominal, INK))
        return (Plot(tuple(marks), Axis(self.x_label), Axis(self.y_label), height=440.0),)

    def _cloud(self, k: int, words: str, cases: int) -> Points:
        rows = self.member == k
        style = COLOURS[k % len(COLOURS)], words, SIGNS[k % len(SIGNS)], *((4.0, 0.55) if k == INSIDE else (6.0, 0.9))
        key = f"{words}: {count(cases)} of {count(self.n_tried)} cases" if cases else ""
        return Points(self.x[rows], self.y[rows], *style, cases=self.case_ids[rows], columns=self.columns, key=key)
