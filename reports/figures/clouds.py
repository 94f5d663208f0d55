"""Cases over two columns, one point per case: clouds by class, regions that contain them, and lines of limits."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from reports.drawing.marks import Axis, Drawing, Line, Mark, Plot, Points, joined, to_scale
from reports.drawing.palette import BLUE, DASHES, GREEN, INK, MUTED, ORANGE, PURPLE, SKY, VERMILION
from reports.text.numbers import count

# Colour and shape by class: apart in grey and for the colour-blind, too.
OUTCOMES = ((BLUE, "circle"), (VERMILION, "diamond"), (INK, "triangle-up"))  # inside, outside, failed
LIMIT_SETS = ((BLUE, "circle"), (VERMILION, "x"), (ORANGE, "diamond"), (PURPLE, "square"), (GREEN, "triangle-up"),
              (SKY, "cross"), (MUTED, "star"))  # fmt: skip
MOST, FEWER = (4.0, 0.5), (7.0, 0.9)  # size and opacity of the largest class and of the others, above it
FEW = 50  # cases of a class, which are drawn large
OUTLINE_COLOURS = {"ellipse": PURPLE, "region": GREEN, "CEP": VERMILION, "target": ORANGE, "limit": INK}


def outline(kind: str, text: str, curves: Sequence[np.ndarray], nth: int = 0) -> Line:
    """The edge of a region, or where a limit runs: curves float64[k, 2] in the units of the axes, and its words.

    kind : one of OUTLINE_COLOURS, the name of the line.  nth : of its kind, each of which has a dash of its own.
    """
    x, y = joined(curves).T
    return Line(x, y, OUTLINE_COLOURS[kind], kind, DASHES[nth % len(DASHES)], text=text, key=text)


def outcome_cloud(k: int, words: str, x: np.ndarray, y: np.ndarray, cases: np.ndarray) -> Points:
    """The cases of one outcome, in its colour and shape."""
    colour, sign = OUTCOMES[k]
    size, opacity = FEWER if k else MOST
    return Points(x, y, colour, words, sign, size, opacity, cases=cases)


def case_scatter(
    cloud: Points,
    member: np.ndarray,
    classes: Sequence[tuple[str, int]],
    axes: tuple[Axis, Axis],
    n_tried: int,
    *,
    lengths: bool = False,
    styles: Sequence[tuple[str, str]] = OUTCOMES,
    rings: Sequence[Points] = (),
    outlines: Sequence[Line] = (),
    fewer: tuple[float, float] = FEWER,
    form: str = "Scatter of cases",
) -> Drawing:
    """The cases shown, of n_tried, and the class of each: int[n], an index into `classes`.

    cloud : all of them, with their numbers and columns.
    classes : words of each, and how many cases belong to it, those not shown among them.
    rings : around single points, as the nominal case.  lengths : whether both axes are lengths in one unit.
    fewer : size and opacity of the points of all classes but the largest, which has them if it has few cases.
    """
    clouds: list[Mark] = []
    for k in sorted((k for k, (_, cases) in enumerate(classes) if cases), key=lambda k: -classes[k][1]):
        (words, cases), rows, (colour, sign) = classes[k], member == k, styles[k]
        size, opacity = fewer if clouds or cases <= FEW else MOST
        shown = int(rows.sum())
        thinned = "" if shown == cases else f" ({count(shown)} shown)"
        numbers = None if cloud.cases is None else cloud.cases[rows]
        clouds.append(
            replace(cloud, x=cloud.x[rows], y=cloud.y[rows], cases=numbers, name=words, colour=colour, sign=sign,
                    size=size, opacity=opacity, key=f"{words}: {count(cases)} of {count(n_tried)} cases{thinned}")
        )  # fmt: skip
    marks = (*clouds, *outlines, *rings)
    plot = Plot(marks, *axes, height=420.0)
    return Drawing(form, (to_scale(plot) if lengths else plot,))
