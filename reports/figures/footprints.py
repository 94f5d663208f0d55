"""A footprint: the ends of the flights about their mean impact point, with the regions that hold them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from reports.drawing.marks import Axis, Drawing, Line, Mark, Plot, Points, joined, nominal_ring
from reports.drawing.palette import BLUE, INK, MUTED
from reports.figures.clouds import Outline, outline_lines
from reports.text.numbers import count

WIDE = 3.0  # width over height of the map of the surroundings
COAST = "coastline (Natural Earth)"
MEAN = Points(np.zeros(1), np.zeros(1), INK, "mean impact point", "cross", 11.0, key="mean impact point")


@dataclass(frozen=True)
class View:
    """Axes turned anticlockwise by an angle [rad] against east and north; equal: one scale for both."""

    labels: tuple[str, str]
    angle: float = 0.0
    equal: bool = True

    @property
    def columns(self) -> tuple[str, str]:
        """Names of the places on its axes, as columns of the cases."""
        return (f"place: {self.labels[0]}", f"place: {self.labels[1]}")

    def turned(self, points: np.ndarray) -> np.ndarray:
        """Points float64[k, 2] in these axes."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        return np.column_stack([c * points[:, 0] + s * points[:, 1], c * points[:, 1] - s * points[:, 0]])


MAP = View(("east of the mean [km]", "north of the mean [km]"))


def footprint_views(long_axis: float | None) -> list[View]:
    """The map; for a long cloud also the same along and across it, each with a scale of its own.

    long_axis : direction of a cloud much longer than wide [rad, from east to north].
    """
    along = View(("along the long axis [km]", "across it, to the left [km]"), long_axis or 0.0, False)
    return [MAP] if long_axis is None else [MAP, along]


def footprint_plot(
    view: View,
    points: np.ndarray,
    names: Sequence[str],
    case_ids: np.ndarray,
    counts: tuple[int, int],
    outlines: Sequence[Outline] = (),
    aim: tuple[str, np.ndarray] | None = None,
    coasts: Sequence[np.ndarray] = (),
) -> Plot:
    """points : float64[k, 2], km east and north, of the cases shown, with their places in words and their numbers.

    counts : cases that came down, and all.  aim : words and point of the place that distances count from.
    coasts : float64[k, 2] in km.
    """
    shown = "all shown" if len(points) == counts[0] else f"{count(len(points))} shown"
    key = f"{count(counts[0])} of {count(counts[1])} cases, {shown}"
    x, y = view.turned(points).T
    turned = [replace(outline, curves=tuple(map(view.turned, outline.curves))) for outline in outlines]
    marks: list[Mark] = [
        *coast_lines(coasts if view.equal else ()),
        Points(x, y, BLUE, opacity=0.5, texts=names, cases=case_ids, columns=view.columns, key=key),
        *outline_lines(turned),
        MEAN,
    ]
    if aim:
        marks.append(nominal_ring(tuple(view.turned(aim[1][None, :])[0]), INK, aim[0]))
    spans = np.ptp(np.concatenate([points, *(curve for outline in outlines for curve in outline.curves)]), axis=0)
    flatness = float(np.clip(spans[1] / max(spans[0], 1e-9), 0.25, 0.75))
    height = 60.0 + 720.0 * flatness if view.equal else 380.0
    title = "" if view.equal else "Along and across, each with a scale of its own"
    return Plot(tuple(marks), Axis(view.labels[0]), Axis(view.labels[1]), title, height, view.equal)


def surroundings(coasts: Sequence[np.ndarray], reach: float) -> Plot:
    """Where the footprint lies, when its own map shows no coast: a map that reaches so many km to the north."""
    x, y = Axis(MAP.labels[0], (-WIDE * reach, WIDE * reach)), Axis(MAP.labels[1], (-reach, reach))
    return Plot((*coast_lines(coasts), MEAN), x, y, "The surroundings", 300.0, True)


def coast_lines(coasts: Sequence[np.ndarray]) -> Iterator[Line]:
    """The coasts in one line, which does not make a map larger."""
    if coasts:
        x, y = joined(coasts).T
        yield Line(x, y, MUTED, COAST, width=1.2, text=COAST, near=False, key=COAST)


def footprint_drawing(plots: Sequence[Plot], views: Sequence[View], points: np.ndarray, cases: np.ndarray) -> Drawing:
    """The maps in one figure.  points : km east and north of all cases that came down;  cases : their numbers."""
    places = {
        column: (label, cases, values)
        for view in views
        for column, label, values in zip(view.columns, view.labels, view.turned(points).T, strict=True)
    }
    return Drawing("Impact points about the mean impact point", tuple(plots), 1, places=places)
