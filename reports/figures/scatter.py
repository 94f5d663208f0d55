"""One column against another, a point a case, marked by how the case came out."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from reports.document import Drawing, Key
from reports.figures import paper, screen
from reports.figures.footprints import DASHES, PRINT_DASH, joined
from reports.figures.footprints import MARKS as LINE_MARKS
from reports.figures.palette import BLUE, GREEN, INK, PURPLE, VERMILION, on_paper
from reports.numbers import count, number

# Colour, shape and size of what is inside, outside and failed: apart in grey and for the colour-blind, too.
MARKS = ((BLUE, "circle", 4.0, 0.5), (VERMILION, "diamond", 7.0, 0.9), (INK, "triangle-up", 8.0, 0.9))


@dataclass(frozen=True)
class CloudRegion:
    """A region of the cloud: closed curves, each float64[k, 2] in the units of the axes, and the words for the key.

    elliptic : a covariance ellipse, else a region of any shape.
    """

    elliptic: bool
    text: str
    outlines: tuple[np.ndarray, ...]


@dataclass(frozen=True)
class ScatterDrawing(Drawing):
    """x, y : float64[k] of the cases shown (finite), with case_ids int64[k]; n_used of n_tried have both numbers.

    outcome : int[k], an index into `outcomes`, pairs of words and of how many of the n_used cases came out so.
    """

    x: np.ndarray
    y: np.ndarray
    case_ids: np.ndarray
    x_label: str
    y_label: str
    n_used: int
    n_tried: int
    nominal: tuple[float, float] | None
    outcome: np.ndarray
    outcomes: tuple[tuple[str, int], ...]
    regions: tuple[CloudRegion, ...] = ()

    @property
    def styled(self) -> list[tuple[CloudRegion, str, str]]:
        """Regions with colour and dash: ellipses purple, a dash for each, regions of any shape green."""
        ellipses = [one for one in self.regions if one.elliptic]
        others = [one for one in self.regions if not one.elliptic]
        return [
            (one, colour, DASHES[k % len(DASHES)])
            for kind, colour in ((ellipses, PURPLE), (others, GREEN))
            for k, one in enumerate(kind)
        ]

    @property
    def key(self) -> tuple[Key, ...]:
        entries = []
        for k, (words, cases) in enumerate(self.outcomes):
            if cases:
                shown = int((self.outcome == k).sum())
                thinned = "" if shown == cases else f" ({count(shown)} shown)"
                text = f"{words}: {count(cases)} of {count(self.n_tried)} cases{thinned}"
                entries.append(Key("point", MARKS[k][0], text, MARKS[k][1]))
        if self.nominal:
            entries.append(Key("ring", VERMILION, "nominal"))
        return (*entries, *(Key(LINE_MARKS[dash], colour, one.text) for one, colour, dash in self.styled))

    @property
    def alternative(self) -> str:
        parts = ", ".join(f"{words}: {count(cases)}" for words, cases in self.outcomes if cases)
        regions = "; ".join(one.text for one in self.regions)
        return (
            f"Scatter of {self.y_label}, {number(float(self.y.min()), 4)} to {number(float(self.y.max()), 4)}, against "
            f"{self.x_label}, {number(float(self.x.min()), 4)} to {number(float(self.x.max()), 4)}; "
            f"{count(self.n_used)} of {count(self.n_tried)} cases; {parts}."
            f"{f' Regions: {regions}.' if regions else ''}"
        )

    def interactive(self) -> list[dict[str, Any]]:
        data = [self._screen_cloud(k) for k, (_, cases) in enumerate(self.outcomes) if cases]
        for region, colour, dash in self.styled:
            data.append(screen.outline(joined(region.outlines), colour, dash, region.text))
        if self.nominal:
            nominal = {
                "type": "scatter",
                "mode": "markers",
                "x": [self.nominal[0]],
                "y": [self.nominal[1]],
                "marker": {"size": 11, "color": "#ffffff", "line": {"width": 3, "color": VERMILION}},
                "hovertemplate": "nominal (%{x}, %{y})<extra></extra>",
            }
            data.append(nominal)
        x, y = screen.axis(self.x_label, zeroline=False), screen.axis(self.y_label, zeroline=False)
        return [{"data": data, "layout": screen.layout(x, y, 420, hovermode="closest", dragmode="select")}]

    def _screen_cloud(self, k: int) -> dict[str, Any]:
        rows = self.outcome == k
        return {
            **screen_cloud(k, self.outcomes[k][0]),
            "x": screen.rounded(self.x[rows], 8),
            "y": screen.rounded(self.y[rows], 8),
            "customdata": [int(case) for case in self.case_ids[rows]],
        }

    def printed(self) -> Figure:
        figure, (axis,) = paper.new_figure(3.4)
        for k, (colour, sign, size, _) in enumerate(MARKS):
            rows = self.outcome == k
            area, opacity = ((size - 0.5) ** 2 / 4.0, 0.5) if k == 0 else (size * size / 4.0, 0.9)
            axis.scatter(
                self.x[rows],
                self.y[rows],
                s=area,
                color=on_paper(colour),
                marker=paper.SIGNS[sign],
                alpha=opacity,
                linewidths=0,
            )
        for region, colour, dash in self.styled:
            line = joined(region.outlines)
            axis.plot(line[:, 0], line[:, 1], color=colour, linestyle=PRINT_DASH[dash], linewidth=1.1)
        if self.nominal:
            axis.plot(*self.nominal, "o", markersize=6, markerfacecolor="white", color=VERMILION, markeredgewidth=1.6)
        axis.set(xlabel=paper.literal(self.x_label), ylabel=paper.literal(self.y_label))
        paper.add_key(figure, self.key, columns=1 if self.regions else 3)
        return figure


def screen_cloud(outcome: int, words: str) -> dict[str, Any]:
    """The cloud of one outcome for the screen, still without its points."""
    colour, sign, size, opacity = MARKS[outcome]
    return {
        "type": "scatter",
        "mode": "markers",
        "meta": screen.CASES,
        "name": screen.plain(words),
        "marker": {"size": size, "symbol": sign, "color": colour, "opacity": opacity},
        "hovertemplate": "case %{customdata}: (%{x}, %{y})<extra>%{fullData.name}</extra>",
    }
