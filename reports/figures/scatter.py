"""One column against another, a point a case, marked by how the case came out."""

from dataclasses import dataclass, replace

import numpy as np

from reports.drawing.marks import Axis, Drawing, Line, Plot, Points, nominal_ring, region
from reports.drawing.palette import BLUE, DASHES, GREEN, INK, PAPER, PURPLE, VERMILION
from reports.text.numbers import count

# Colour and shape of what is inside, outside and failed: apart in grey and for the colour-blind, too.
MARKS = ((BLUE, "circle"), (VERMILION, "diamond"), (INK, "triangle-up"))
MOST, FEWER = (4.0, 0.5), (7.0, 0.9)  # size and opacity of the largest outcome, beneath, and of the others, above it


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
    columns : the names of x and y in the table of cases.
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
    columns: tuple[str, str] | None = None
    form = "Scatter of cases"

    @property
    def styled(self) -> list[tuple[CloudRegion, str, str]]:
        """Regions with colour and dash: ellipses purple, a dash for each, distribution-free regions green."""
        ellipses = [one for one in self.regions if one.elliptic]
        others = [one for one in self.regions if not one.elliptic]
        return [
            (one, colour, DASHES[k % len(DASHES)])
            for kind, colour in ((ellipses, PURPLE), (others, GREEN))
            for k, one in enumerate(kind)
        ]

    @property
    def drawn(self) -> list[tuple[int, float, float]]:
        """The outcomes that have cases, the largest first, as they are drawn one above the other: size and opacity."""
        order = sorted((k for k, (_, cases) in enumerate(self.outcomes) if cases), key=lambda k: -self.outcomes[k][1])
        return [(k, *(MOST if place == 0 else FEWER)) for place, k in enumerate(order)]

    @property
    def plots(self) -> tuple[Plot, ...]:
        marks: list[Points | Line] = [self._cloud(*one) for one in self.drawn]
        marks += [region(one.outlines, colour, dash, one.text) for one, colour, dash in self.styled]
        if self.nominal:
            marks.append(nominal_ring(self.nominal, VERMILION, edge=PAPER))
        return (Plot(tuple(marks), Axis(self.x_label), Axis(self.y_label), height=400.0),)

    def _cloud(self, k: int, size: float, opacity: float) -> Points:
        rows, (words, cases) = self.outcome == k, self.outcomes[k]
        shown = int(rows.sum())
        thinned = "" if shown == cases else f" ({count(shown)} shown)"
        key = f"{words}: {count(cases)} of {count(self.n_tried)} cases{thinned}"
        found = outcome_cloud(k, words, self.x[rows], self.y[rows], self.case_ids[rows])
        return replace(found, size=size, opacity=opacity, columns=self.columns, key=key)


def outcome_cloud(k: int, words: str, x: np.ndarray, y: np.ndarray, cases: np.ndarray) -> Points:
    """The cases of one outcome, in its colour and shape."""
    colour, sign = MARKS[k]
    size, opacity = FEWER if k else MOST
    return Points(x, y, colour, words, sign, size, opacity, cases=cases)
