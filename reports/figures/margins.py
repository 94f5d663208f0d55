"""Margins of requirements relative to the width of their limits, a row each: demonstrated bound and worst case."""

from dataclasses import dataclass

import numpy as np

from reports.drawing.marks import Axis, Bar, Drawing, Limit, Mark, Plot, Points
from reports.drawing.palette import BLUE, GREEN, INK, MUTED, VERMILION
from reports.text.numbers import SPACE, number

MOST = 1.0  # of the width of the limits, either way; margins beyond are drawn at the edge
THICK = 0.3  # half of a bar
_COLOURS = {"good": GREEN, "bad": VERMILION, "open": MUTED}


@dataclass(frozen=True)
class MarginRow:
    """One requirement: its margins over the width of its limits, negative outside; tone as of a verdict."""

    name: str
    demonstrated: float | None
    worst: float
    tone: str

    @property
    def text(self) -> str:
        bound = "none" if self.demonstrated is None else _percent(self.demonstrated)
        return f"{self.name}: demonstrated {bound}, worst case {_percent(self.worst)}"


@dataclass(frozen=True)
class MarginDrawing(Drawing):
    """Rows from the top."""

    rows: tuple[MarginRow, ...]
    across = 1

    @property
    def alternative(self) -> str:
        return f"Margins relative to the width of the limits. {'; '.join(row.text for row in self.rows)}."

    @property
    def plots(self) -> tuple[Plot, ...]:
        marks: list[Mark] = []
        for place, row in enumerate(self.rows):
            marks += _marks(row, place)
        marks.append(Limit(0.0, "x", VERMILION, "limit", key="limit"))
        ticks = tuple((float(place), _label(row)) for place, row in enumerate(self.rows))
        margins = [one for row in self.rows for one in (row.demonstrated, row.worst) if one is not None]
        low, high = (100.0 * end for end in (max(min(margins), -MOST), min(max(margins), MOST)))
        across = Axis("margin over width of the limits [%]", reach=(min(low, 0.0) - 5.0, max(high, 0.0) + 5.0))
        up = Axis(name="requirement", reach=(len(self.rows) - 0.5, -0.5), ticks=ticks, grid=False)
        return (Plot(tuple(marks), across, up, height=70.0 + 26.0 * len(self.rows)),)


def _marks(row: MarginRow, place: int) -> list[Mark]:
    y = np.array([float(place)])
    found: list[Mark] = []
    if row.demonstrated is not None:
        x = np.array([_edge(row.demonstrated)])
        ends = np.minimum(x, 0.0), np.maximum(x, 0.0)
        colour = _COLOURS[row.tone]
        found.append(Bar(*ends, y - THICK, y + THICK, colour, 0.35, (row.text,)))
        key = "demonstrated bound (tolerance limit)"
        found.append(Points(x, y, BLUE, key, "diamond", 9.0, texts=(row.text,), key=key))
    worst = np.array([_edge(row.worst)])
    found.append(Points(worst, y, INK, "worst case", "x", 8.0, texts=(row.text,), key="worst case"))
    return found


def _edge(margin: float) -> float:
    return 100.0 * min(max(margin, -MOST), MOST)


def _label(row: MarginRow) -> str:
    return row.name if row.demonstrated is None else f"{row.name}, {_percent(row.demonstrated)}"


def _percent(margin: float) -> str:
    return f"{number(100.0 * margin, 3)}{SPACE}%"
