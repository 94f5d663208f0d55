"""How estimates came to their values with the number of cases: one curve with its interval a panel."""

from dataclasses import dataclass
from typing import ClassVar

from mc_engine.statistics.convergence import RunningEstimate
from reports.figures.marks import Axis, Drawing, Line, Plot, between
from reports.figures.palette import BLUE, SKY
from reports.numbers import count, number, percent

X_LABEL = "cases"


@dataclass(frozen=True)
class RunningPanel:
    """title : which estimate of what;  label : the metric with its unit."""

    title: str
    label: str
    run: RunningEstimate


@dataclass(frozen=True)
class RunningDrawing(Drawing):
    """Panels of running estimates.  confidence : of the two-sided intervals."""

    panels: tuple[RunningPanel, ...]
    confidence: float
    across: ClassVar[int] = 4

    @property
    def alternative(self) -> str:
        parts = []
        for panel in self.panels:
            run = panel.run
            ends = [f"{number(float(run.estimate[k]), 4)} after {count(int(run.cases[k]))} cases" for k in (0, -1)]
            parts.append(f"{panel.title}, {panel.label}: {' and '.join(ends)}")
        return f"Running estimates. {'; '.join(parts)}."

    @property
    def plots(self) -> tuple[Plot, ...]:
        return tuple(self._plot(panel) for panel in self.panels)

    def _plot(self, panel: RunningPanel) -> Plot:
        run, interval = panel.run, f"{percent(self.confidence)} interval"
        band_key = f"{interval}, where the cases are enough for both ends"
        key = "from the first so many cases, in the order of their numbers"
        marks = (
            between(run.cases, run.lower, run.upper, SKY, 0.35, interval, band_key),
            Line(run.cases, run.estimate, BLUE, panel.title, width=2.0, key=key),
        )
        return Plot(marks, Axis(X_LABEL, log=True, margin=0.0), Axis(panel.label, most=5), panel.title, 230.0)
