"""Two runs laid over one another: lines, bands and points of each in the same panels."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from reports.figures.marks import Axis, Band, Drawing, Line, Plot, Points, between
from reports.figures.palette import BLUE, VERMILION

COLOURS = (BLUE, VERMILION)
SIGNS = ("circle", "diamond")


@dataclass(frozen=True)
class Overlay:
    """One mark of run 0 or 1: a "line" or "points" x, y, or a "band" between y and y2; float64[n] each."""

    run: int
    kind: str
    x: np.ndarray
    y: np.ndarray
    y2: np.ndarray | None = None


@dataclass(frozen=True)
class OverlayPanel:
    """The marks of both runs over the same axes.  equal : the axes have the same scale."""

    x_label: str
    y_label: str
    marks: tuple[Overlay, ...]
    equal: bool = False


@dataclass(frozen=True)
class OverlayDrawing(Drawing):
    """Panels of two runs; names : what the runs are called; meanings : of each kind of mark, in words."""

    names: tuple[str, str]
    meanings: dict[str, str]
    panels: tuple[OverlayPanel, ...]
    across: ClassVar[int] = 3
    form: ClassVar[str] = "Two runs over one another"

    @property
    def plots(self) -> tuple[Plot, ...]:
        return tuple(self._plot(panel) for panel in self.panels)

    def _plot(self, panel: OverlayPanel) -> Plot:
        marks = tuple(self._mark(mark) for mark in panel.marks)
        height = 500.0 if panel.equal else 260.0
        return Plot(marks, Axis(panel.x_label), Axis(panel.y_label), height=height, equal=panel.equal)

    def _mark(self, mark: Overlay) -> Band | Line | Points:
        colour, name = COLOURS[mark.run], self.names[mark.run]
        key = f"{name}: {self.meanings[mark.kind]}"
        if mark.kind == "points":
            return Points(mark.x, mark.y, colour, name, SIGNS[mark.run], opacity=0.5, key=key)
        if mark.y2 is not None:
            return between(mark.x, mark.y, mark.y2, colour, 0.2, key=key)
        return Line(mark.x, mark.y, colour, name, key=key)
