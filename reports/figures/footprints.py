"""A footprint: the ends of the flights about their mean place, with the regions that hold them."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from reports.figures.marks import Axis, Drawing, Line, Plot, Points, nominal_ring, region
from reports.figures.palette import BLUE, DASHES, GREEN, INK, VERMILION
from reports.numbers import count

EAST, NORTH = "east of the mean place [km]", "north of the mean place [km]"
ALONG, ACROSS = "along the long axis [km]", "across it, to the left [km]"


@dataclass(frozen=True)
class FootprintCurve:
    """A region's outlines, each float64[k, 2] in km east and north, and the words for the key.  kind : as `Outline`."""

    kind: str
    text: str
    outlines: tuple[np.ndarray, ...]


@dataclass(frozen=True)
class FootprintDrawing(Drawing):
    """points : float64[k, 2], km east and north, of the cases shown, with the words that say where each one is.

    n_used of n_tried have a place; aim : words and point of the place that distances count from, if there is one.
    long_axis : direction of a cloud much longer than wide [rad, from east to north].
    case_ids : of the points;  everywhere, every_case : the same of all n_used cases, those not shown among them.
    """

    points: np.ndarray
    names: tuple[str, ...]
    curves: tuple[FootprintCurve, ...]
    n_used: int
    n_tried: int
    aim: tuple[str, tuple[float, float]] | None
    long_axis: float | None = None
    case_ids: np.ndarray | None = None
    everywhere: np.ndarray | None = None
    every_case: np.ndarray | None = None
    across: ClassVar[int] = 1
    form: ClassVar[str] = "Ends of flights about their mean place"

    @property
    def styled(self) -> list[tuple[FootprintCurve, str, str]]:
        """Curves with colour and dash: ellipses vermilion, regions green, a dash for each content."""
        counts = {"ellipse": 0, "region": 0}
        found = []
        for curve in self.curves:
            colour = VERMILION if curve.kind == "ellipse" else GREEN
            found.append((curve, colour, DASHES[counts[curve.kind] % len(DASHES)]))
            counts[curve.kind] += 1
        return found

    @property
    def plots(self) -> tuple[Plot, ...]:
        return tuple(self._plot(view) for view in self.views)

    def _plot(self, view: "View") -> Plot:
        points = view.turned(self.points)
        shown = "all shown" if len(points) == self.n_used else f"{count(len(points))} shown"
        marks: list[Line | Points] = [
            Points(
                points[:, 0],
                points[:, 1],
                BLUE,
                opacity=0.5,
                texts=self.names,
                cases=self.case_ids,
                columns=view.columns if self.everywhere is not None else None,
                key=f"{count(self.n_used)} of {count(self.n_tried)} cases, {shown}",
            )
        ]
        for curve, colour, dash in self.styled:
            marks.append(region([view.turned(one) for one in curve.outlines], colour, dash, curve.text))
        if self.aim:
            x, y = view.turned(np.array([self.aim[1]]))[0].tolist()
            marks.append(nominal_ring((x, y), INK, self.aim[0]))
        height = 60.0 + 720.0 * self._flatness() if view.equal else 380.0
        return Plot(tuple(marks), Axis(view.x_label), Axis(view.y_label), height=height, equal=view.equal)

    @property
    def places(self) -> dict[str, tuple[str, np.ndarray, np.ndarray]]:
        """Where all cases lie on the axes: by column, its label, cases and numbers."""
        if self.everywhere is None or self.every_case is None:
            return {}
        return {
            column: (label, self.every_case, view.turned(self.everywhere)[:, k])
            for view in self.views
            for k, (column, label) in enumerate(zip(view.columns, (view.x_label, view.y_label), strict=True))
        }

    @property
    def views(self) -> tuple["View", ...]:
        """The map; for a long cloud also the same along and across it, each with a scale of its own."""
        map_view = View(EAST, NORTH, 0.0, True)
        if self.long_axis is None:
            return (map_view,)
        return (map_view, View(ALONG, ACROSS, self.long_axis, False))

    def _flatness(self) -> float:
        """Height over width of what is drawn, between bounds that keep a picture readable."""
        outlines = [outline for curve in self.curves for outline in curve.outlines]
        spans = np.ptp(np.concatenate([self.points, *outlines]), axis=0)
        return float(np.clip(spans[1] / max(spans[0], 1e-9), 0.25, 0.75))


@dataclass(frozen=True)
class View:
    """Axes turned anticlockwise by an angle [rad] against east and north; equal: one scale for both."""

    x_label: str
    y_label: str
    angle: float
    equal: bool

    @property
    def columns(self) -> tuple[str, str]:
        """Names of the places on its axes, as columns of the cases."""
        return (f"place: {self.x_label}", f"place: {self.y_label}")

    def turned(self, points: np.ndarray) -> np.ndarray:
        """Points float64[k, 2] in these axes."""
        if self.angle == 0.0:
            return points
        c, s = np.cos(self.angle), np.sin(self.angle)
        return np.column_stack([c * points[:, 0] + s * points[:, 1], c * points[:, 1] - s * points[:, 0]])
