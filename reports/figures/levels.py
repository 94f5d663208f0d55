"""Metrics by the level of a choice: where half and nine tenths of the cases lie, a row a level, a panel a metric."""

from dataclasses import dataclass

import numpy as np

from reports.drawing.marks import Axis, Drawing, Line, Plot, Points
from reports.drawing.palette import BLUE, MUTED, ORANGE, PAPER, SKY
from reports.text.numbers import count, number

SPREAD = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)  # probabilities of what is drawn
LOGARITHMIC = 30.0  # medians this far apart are drawn on a logarithmic axis
SPANS = (  # of SPREAD, with colour, width and words
    (0, 6, MUTED, 1.2, "all cases"),
    (1, 5, SKY, 7.0, "5 % to 95 %"),
    (2, 4, BLUE, 11.0, "middle half of the cases"),
)


@dataclass(frozen=True)
class LevelPanel:
    """One metric: quantiles float64[n_levels, 7] at SPREAD (NaN for a level without a number) and counts of numbers."""

    label: str
    quantiles: np.ndarray
    used: tuple[int, ...]

    @property
    def logarithmic(self) -> bool:
        """Whether the levels lie too far apart for one linear axis."""
        middle = self.quantiles[:, 3][np.isfinite(self.quantiles[:, 3])]
        return bool(middle.size and np.nanmin(self.quantiles) > 0.0 and middle.max() > LOGARITHMIC * middle.min())

    @property
    def title(self) -> str:
        return f"{self.label}{', logarithmic' if self.logarithmic else ''}"


@dataclass(frozen=True)
class LevelsDrawing(Drawing):
    """Panels over the same levels, of which the first stands on top.  what : the choice, in words."""

    what: str
    levels: tuple[str, ...]
    panels: tuple[LevelPanel, ...]

    @property
    def alternative(self) -> str:
        parts = []
        for panel in self.panels:
            medians = ", ".join(
                f"{level} {number(float(row[3]), 3) if used else 'no number'}"
                for level, row, used in zip(self.levels, panel.quantiles, panel.used, strict=True)
            )
            parts.append(f"{panel.label}: {medians}")
        return f"Medians by {self.form}. {'; '.join(parts)}."

    @property
    def plots(self) -> tuple[Plot, ...]:
        return tuple(self._plot(panel) for panel in self.panels)

    def _plot(self, panel: LevelPanel) -> Plot:
        marks: list[Line | Points] = []
        # Places are numbers, not words: plotly would read a level such as "2" as a number or a date.
        for place, (level, row, used) in enumerate(zip(self.levels, panel.quantiles, panel.used, strict=True)):
            for low, high, colour, width, key in SPANS:
                text = f"{level}, {count(used)} cases: {number(float(row[low]), 4)} to {number(float(row[high]), 4)}"
                marks.append(Line(row[[low, high]], np.full(2, place), colour, width=width, text=text, key=key))
        median = panel.quantiles[:, 3]
        texts = tuple(
            f"{level}: median {number(float(one), 4)}" for level, one in zip(self.levels, median, strict=True)
        )
        marks.append(Points(median, np.arange(median.size), ORANGE, size=8.0, edge=PAPER, texts=texts, key="median"))
        ticks = tuple(enumerate(self.levels))
        y = Axis(reach=(len(self.levels) - 0.5, -0.5), ticks=ticks, grid=False)
        return Plot(tuple(marks), Axis(log=panel.logarithmic), y, panel.title, 40.0 + 26.0 * len(self.levels))
