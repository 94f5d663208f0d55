"""A footprint: the ends of the flights about their mean place, with the regions that hold them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from reports.document import Drawing, Key
from reports.figures import paper, screen
from reports.figures.palette import BLUE, GREEN, INK, VERMILION, on_paper
from reports.numbers import count, number

DASHES = ("solid", "dash", "dot")
MARKS = {"solid": "line", "dash": "dash", "dot": "dot"}
PRINT_DASH = {"solid": "-", "dash": "--", "dot": ":"}
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
    """

    points: np.ndarray
    names: tuple[str, ...]
    curves: tuple[FootprintCurve, ...]
    n_used: int
    n_tried: int
    aim: tuple[str, tuple[float, float]] | None
    long_axis: float | None = None

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
    def key(self) -> tuple[Key, ...]:
        shown = "all shown" if len(self.points) == self.n_used else f"{count(len(self.points))} shown"
        cases = Key("point", BLUE, f"{count(self.n_used)} of {count(self.n_tried)} cases, {shown}")
        curves = [Key(MARKS[dash], colour, curve.text) for curve, colour, dash in self.styled]
        aim = [Key("ring", INK, self.aim[0])] if self.aim else []
        return (cases, *curves, *aim)

    @property
    def alternative(self) -> str:
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        spans = (
            f"from {number(float(low[k]), 3)} to {number(float(high[k]), 3)} km {way}"
            for k, way in enumerate(("east", "north"))
        )
        regions = "; ".join(curve.text for curve in self.curves)
        return (
            f"Ends of {count(self.n_used)} of {count(self.n_tried)} flights about their mean place, {', '.join(spans)}."
            f"{f' Regions: {regions}.' if regions else ''}"
        )

    def interactive(self) -> list[dict[str, Any]]:
        return [self._screen_panel(view) for view in self.views]

    def _screen_panel(self, view: "View") -> dict[str, Any]:
        points = view.turned(self.points)
        cloud = {
            "type": "scatter",
            "mode": "markers",
            "x": screen.rounded(points[:, 0]),
            "y": screen.rounded(points[:, 1]),
            "customdata": [screen.plain(name) for name in self.names],
            "marker": {"size": 4, "color": BLUE, "opacity": 0.5},
            "hovertemplate": "%{customdata}<extra></extra>",
        }
        data: list[dict[str, Any]] = [cloud]
        for curve, colour, dash in self.styled:
            data.append(screen.outline(view.turned(joined(curve.outlines)), colour, dash, curve.text))
        if self.aim:
            x, y = view.turned(np.array([self.aim[1]]))[0].tolist()
            data.append(screen.ring((x, y), INK, self.aim[0]))
        equal = {"scaleanchor": "x", "scaleratio": 1} if view.equal else {}
        x_axis = screen.axis(view.x_label, zeroline=False)
        y_axis = screen.axis(view.y_label, zeroline=False, **equal)
        height = int(90 + 720 * self._flatness()) if view.equal else 380
        return {"data": data, "layout": screen.layout(x_axis, y_axis, height, hovermode="closest")}

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

    def printed(self) -> Figure:
        heights = [0.5 + 6.0 * self._flatness() if view.equal else 2.7 for view in self.views]
        figure, axes = paper.new_figure(0.5 + sum(heights), len(heights), heights=heights)
        for axis, view in zip(axes, self.views, strict=True):
            points = view.turned(self.points)
            axis.scatter(points[:, 0], points[:, 1], s=3.0, color=BLUE, alpha=0.5, linewidths=0)
            for curve, colour, dash in self.styled:
                line = view.turned(joined(curve.outlines))
                axis.plot(line[:, 0], line[:, 1], color=colour, linestyle=PRINT_DASH[dash], linewidth=1.1)
            if self.aim:
                x, y = view.turned(np.array([self.aim[1]]))[0]
                axis.plot(x, y, "o", ms=6, mfc="none", color=on_paper(INK), markeredgewidth=1.6)
            axis.set(xlabel=view.x_label, ylabel=view.y_label)
            if view.equal:
                axis.set_aspect("equal", adjustable="datalim")
        paper.add_key(figure, self.key, columns=2)
        return figure


@dataclass(frozen=True)
class View:
    """Axes turned anticlockwise by an angle [rad] against east and north; equal: one scale for both."""

    x_label: str
    y_label: str
    angle: float
    equal: bool

    def turned(self, points: np.ndarray) -> np.ndarray:
        """Points float64[k, 2] in these axes."""
        if self.angle == 0.0:
            return points
        c, s = np.cos(self.angle), np.sin(self.angle)
        return np.column_stack([c * points[:, 0] + s * points[:, 1], c * points[:, 1] - s * points[:, 0]])


def joined(outlines: tuple[np.ndarray, ...]) -> np.ndarray:
    """The curves behind each other, a not-a-number between two, at which the pen is lifted."""
    parts = [part for outline in outlines for part in (outline, np.full((1, 2), np.nan))]
    return np.concatenate(parts[:-1])
