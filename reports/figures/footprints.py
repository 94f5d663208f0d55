"""A footprint: the ends of the flights about their mean impact point, with the regions that hold them."""

from collections.abc import Mapping, Sequence
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

    x_label: str = "east of the mean [km]"
    y_label: str = "north of the mean [km]"
    angle: float = 0.0
    equal: bool = True

    @property
    def columns(self) -> tuple[str, str]:
        """Names of the places on its axes, as columns of the cases."""
        return (f"place: {self.x_label}", f"place: {self.y_label}")

    def turned(self, points: np.ndarray) -> np.ndarray:
        """Points float64[k, 2] in these axes."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        return np.column_stack([c * points[:, 0] + s * points[:, 1], c * points[:, 1] - s * points[:, 0]])


def footprint_views(long_axis: float | None) -> list[View]:
    """The map; for a long cloud also the same along and across it, each with a scale of its own.

    long_axis : direction of a cloud much longer than wide [rad, from east to north].
    """
    along = View("along the long axis [km]", "across it, to the left [km]", long_axis or 0.0, False)
    return [View()] if long_axis is None else [View(), along]


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
    plot = Plot(tuple(marks), Axis(view.x_label), Axis(view.y_label), title, height, view.equal)
    return over_coasts(plot, coasts) if coasts and view.equal else plot


def surroundings(coasts: Sequence[np.ndarray], reach: float) -> Plot:
    """Where the footprint lies, when its own map shows no coast: a map that reaches so many km to the north."""
    x, y = (Axis(label, reach=(-end, end)) for label, end in
            ((View.x_label, WIDE * reach), (View.y_label, reach)))  # fmt: skip
    return over_coasts(Plot((MEAN,), x, y, "The surroundings", 300.0, True), coasts)


def over_coasts(plot: Plot, coasts: Sequence[np.ndarray]) -> Plot:
    """The map over its coasts, which do not make it larger."""
    x, y = joined(coasts).T
    coast = Line(x, y, MUTED, COAST, width=1.2, text=COAST, key=COAST)
    across, up = (replace(axis, reach=ends) for axis, ends in zip((plot.x, plot.y), plot.ends, strict=True))
    return replace(plot, marks=(coast, *plot.marks), x=across, y=up)


def footprint_places(
    views: Sequence[View], points: np.ndarray, cases: np.ndarray
) -> Mapping[str, tuple[str, np.ndarray, np.ndarray]]:
    """Where all cases lie on the axes: by column, its label, cases and numbers."""
    return {
        column: (label, cases, view.turned(points)[:, k])
        for view in views
        for k, (column, label) in enumerate(zip(view.columns, (view.x_label, view.y_label), strict=True))
    }


def footprint_drawing(plots: Sequence[Plot], places: Mapping[str, tuple[str, np.ndarray, np.ndarray]]) -> Drawing:
    """The maps in one figure."""
    return Drawing("Ends of flights about their mean place", tuple(plots), 1, places=places)
