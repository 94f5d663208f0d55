"""A footprint: the ends of the flights about their mean impact point, with the regions that hold them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from reports.drawing.marks import OWN_SCALES, Axis, Drawing, Line, Plot, Points, joined, to_scale
from reports.drawing.palette import BLUE, INK, MUTED
from reports.text.numbers import count

PlacedMark = TypeVar("PlacedMark", bound=Line | Points)
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

    def turned(self, mark: PlacedMark) -> PlacedMark:
        """A mark, in km east and north, in these axes."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        return replace(mark, x=c * mark.x + s * mark.y, y=c * mark.y - s * mark.x)


MAP = View(("east of the mean [km]", "north of the mean [km]"))


def footprint_views(long_axis: float | None) -> list[View]:
    """The map; for a long cloud also the same along and across it, each with a scale of its own.

    long_axis : direction of a cloud much longer than wide [rad, from east to north].
    """
    along = View(("along the long axis [km]", "across it, to the left [km]"), long_axis or 0.0, False)
    return [MAP] if long_axis is None else [MAP, along]


def footprint_plot(
    view: View,
    cloud: Points,
    counts: tuple[int, int],
    others: Sequence[Line | Points] = (),
    coasts: Sequence[np.ndarray] = (),
) -> Plot:
    """cloud : the cases shown, km east and north, with their places in words and their numbers.

    counts : cases that came down, and all.  others : regions that hold them, and the place that distances count from.
    coasts : float64[k, 2] in km.
    """
    shown = "all shown" if cloud.x.size == counts[0] else f"{count(cloud.x.size)} shown"
    key = f"{count(counts[0])} of {count(counts[1])} cases, {shown}"
    marks = (
        *coast_lines(coasts if view.equal else ()),
        replace(view.turned(cloud), colour=BLUE, opacity=0.5, columns=view.columns, key=key),
        *map(view.turned, (*others, MEAN)),
    )
    title = "" if view.equal else OWN_SCALES
    plot = Plot(marks, Axis(view.labels[0]), Axis(view.labels[1]), title, 380.0)
    return to_scale(plot, np.inf) if view.equal else plot


def surroundings(coasts: Sequence[np.ndarray], reach: float) -> Plot:
    """Where the footprint lies, when its own map shows no coast: a map that reaches so many km to the north."""
    x, y = Axis(MAP.labels[0], (-WIDE * reach, WIDE * reach)), Axis(MAP.labels[1], (-reach, reach))
    return Plot((*coast_lines(coasts), MEAN), x, y, "The surroundings", 300.0, True)


def coast_lines(coasts: Sequence[np.ndarray]) -> Iterator[Line]:
    """The coasts in one line, which does not make a map larger."""
    if coasts:
        x, y = joined(coasts).T
        yield Line(x, y, MUTED, COAST, width=1.2, text=COAST, near=False, key=COAST)


def footprint_drawing(plots: Sequence[Plot], views: Sequence[View], every: Points, cases: np.ndarray) -> Drawing:
    """The maps in one figure.  every : km east and north of all cases that came down;  cases : their numbers."""
    places = {}
    for view in views:
        turned = view.turned(every)
        for column, label, values in zip(view.columns, view.labels, (turned.x, turned.y), strict=True):
            places[column] = label, cases, values
    return Drawing("Impact points about the mean impact point", tuple(plots), 1, places=places)
