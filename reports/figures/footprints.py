"""A footprint: the ends of the flights about their mean place, with the regions that hold them."""

from dataclasses import dataclass, replace

import numpy as np

from reports.drawing.marks import Axis, Drawing, Line, Mark, Plot, Points, joined, nominal_ring, region
from reports.drawing.palette import BLUE, DASHES, GREEN, INK, MUTED, ORANGE, PURPLE, VERMILION
from reports.text.numbers import count

EAST, NORTH = "east of the mean [km]", "north of the mean [km]"
WIDE = 3.0  # width over height of the map of the surroundings
COAST = "coastline (Natural Earth)"
ALONG, ACROSS = "along the long axis [km]", "across it, to the left [km]"


MEAN = Points(np.zeros(1), np.zeros(1), INK, "mean impact point", "cross", 11.0, key="mean impact point")
STYLES = {"ellipse": VERMILION, "region": GREEN, "CEP": PURPLE, "target": ORANGE}  # colour by kind; a dash for each


@dataclass(frozen=True)
class FootprintCurve:
    """Outlines, each float64[k, 2] in km east and north, and the words for the key.  kind : one of STYLES."""

    kind: str
    text: str
    outlines: tuple[np.ndarray, ...]


@dataclass(frozen=True)
class FootprintDrawing(Drawing):
    """points : float64[k, 2], km east and north, of the cases shown, with the words that say where each one is.

    n_used of n_tried have a place; aim : words and point of the place that distances count from, if there is one.
    long_axis : direction of a cloud much longer than wide [rad, from east to north].
    case_ids : of the points;  everywhere, every_case : the same of all n_used cases, those not shown among them.
    coasts : float64[k, 2] in km, those in reach of the map;  around : of a wider map, up to so many km north and
    south, where the first has none.
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
    coasts: tuple[np.ndarray, ...] = ()
    around: tuple[np.ndarray, ...] = ()
    around_reach: float = 0.0
    across = 1
    form = "Ends of flights about their mean place"

    @property
    def styled(self) -> list[tuple[FootprintCurve, str, str]]:
        """Curves with colour and dash."""
        counts = dict.fromkeys(STYLES, 0)
        found = []
        for curve in self.curves:
            found.append((curve, STYLES[curve.kind], DASHES[counts[curve.kind] % len(DASHES)]))
            counts[curve.kind] += 1
        return found

    @property
    def plots(self) -> tuple[Plot, ...]:
        maps = tuple(self._plot(view) for view in self.views)
        return (*maps, self._wider()) if self.around else maps

    def _plot(self, view: "View") -> Plot:
        points = view.turned(self.points)
        shown = "all shown" if len(points) == self.n_used else f"{count(len(points))} shown"
        marks: list[Mark] = [
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
        marks.append(MEAN)
        if self.aim:
            x, y = view.turned(np.array([self.aim[1]]))[0].tolist()
            marks.append(nominal_ring((x, y), INK, self.aim[0]))
        height = 60.0 + 720.0 * self._flatness() if view.equal else 380.0
        title = "" if view.equal else "Along and across, each with a scale of its own"
        plot = Plot(tuple(marks), Axis(view.x_label), Axis(view.y_label), title, height, view.equal)
        return plot if not (view.equal and self.coasts) else _over(self.coasts, plot)

    def _wider(self) -> Plot:
        """Where the footprint lies, when its own map shows no coast."""
        x, y = (Axis(label, reach=(-reach, reach)) for label, reach in
                ((EAST, WIDE * self.around_reach), (NORTH, self.around_reach)))  # fmt: skip
        return _over(self.around, Plot((MEAN,), x, y, "The surroundings", 300.0, True))

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


def _over(coasts: tuple[np.ndarray, ...], plot: Plot) -> Plot:
    """The map over its coasts, which do not make it larger."""
    line = joined(coasts)
    coast = Line(line[:, 0], line[:, 1], MUTED, COAST, width=1.2, text=COAST, key=COAST)
    x, y = (replace(axis, reach=ends) for axis, ends in zip((plot.x, plot.y), plot.ends, strict=True))
    return replace(plot, marks=(coast, *plot.marks), x=x, y=y)


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
