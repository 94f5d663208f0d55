"""How estimates came to their values with the number of cases: one curve with its interval a panel."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from mc_engine.statistics.convergence import RunningEstimate
from reports.document import Drawing, Key
from reports.figures import paper, screen
from reports.figures.palette import BLUE, SKY
from reports.numbers import count, number, percent

X_LABEL = "cases"
COLUMNS = 2
TICKS = 8  # that a narrow panel has room for


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

    @property
    def key(self) -> tuple[Key, ...]:
        return (
            Key("line", BLUE, "from the first so many cases, in the order of their numbers"),
            Key("band", SKY, f"{percent(self.confidence)} interval, where the cases are enough for both ends"),
        )

    @property
    def alternative(self) -> str:
        parts = []
        for panel in self.panels:
            run = panel.run
            ends = [f"{number(float(run.estimate[k]), 4)} after {count(int(run.cases[k]))} cases" for k in (0, -1)]
            parts.append(f"{panel.title}, {panel.label}: {' and '.join(ends)}")
        return f"Running estimates. {'; '.join(parts)}."

    def interactive(self) -> list[dict[str, Any]]:
        return [self._screen_panel(panel) for panel in self.panels]

    def _screen_panel(self, panel: RunningPanel) -> dict[str, Any]:
        run, known = panel.run, _known(panel.run)
        around = np.concatenate([run.cases[known], run.cases[known][::-1]])
        edge = np.concatenate([run.lower[known], run.upper[known][::-1]])
        band = {
            "type": "scatter",
            "mode": "lines",
            "x": around.tolist(),
            "y": screen.rounded(edge, 9),
            "fill": "toself",
            "fillcolor": SKY,
            "opacity": 0.35,
            "line": {"width": 0},
            "hoverinfo": "skip",
        }
        curve = {
            "type": "scatter",
            "mode": "lines",
            "x": run.cases.tolist(),
            "y": screen.rounded(run.estimate, 9),
            "line": {"color": BLUE, "width": 2},
            "customdata": [[number(low), number(high)] for low, high in zip(run.lower, run.upper, strict=True)],
            "hovertemplate": "%{x} cases: %{y:.6g}, %{customdata[0]} to %{customdata[1]}<extra></extra>",
        }
        ticks = _round_counts(run.cases)
        x = screen.axis(X_LABEL, type="log", zeroline=False, tickvals=ticks, ticktext=[count(one) for one in ticks])
        y = screen.axis(panel.label, nticks=6, zeroline=False)
        return {"data": [band, curve] if known.any() else [curve], "layout": screen.layout(x, y, 250, panel.title)}

    def printed(self) -> Figure:
        rows = -(-len(self.panels) // COLUMNS)
        figure, axes = paper.new_figure(0.4 + 1.75 * rows, rows, COLUMNS)
        for axis, panel in zip(axes, self.panels, strict=False):
            _print_panel(axis, panel)
        for axis in axes[len(self.panels) :]:
            axis.set_axis_off()
        paper.add_key(figure, self.key, columns=1)
        return figure


def _round_counts(cases: np.ndarray) -> list[int]:
    """1, 2 and 5 times powers of ten within the numbers of cases; of more than TICKS of them, the powers alone."""
    found = [step * 10**power for power in range(10) for step in (1, 2, 5)]
    found = [one for one in found if cases[0] <= one <= cases[-1]]
    return found if len(found) <= TICKS else [one for one in found if str(one).startswith("1")]


def _known(run: RunningEstimate) -> np.ndarray:
    return np.isfinite(run.lower) & np.isfinite(run.upper)


def _print_panel(axis: Axes, panel: RunningPanel) -> None:
    run, known = panel.run, _known(panel.run)
    axis.fill_between(run.cases[known], run.lower[known], run.upper[known], color=SKY, alpha=0.35, linewidth=0)
    axis.plot(run.cases, run.estimate, color=BLUE, linewidth=1.2)
    axis.set_xscale("log")
    axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.xaxis.set_major_formatter(lambda cases, _: count(round(cases)))
    axis.xaxis.set_minor_formatter(NullFormatter())  # their numbers would run into each other
    axis.set_title(paper.literal(panel.title), fontsize=7.5)
    axis.set_xlabel(X_LABEL, fontsize=7.0)
    axis.set_ylabel(paper.literal(panel.label), fontsize=7.0)
