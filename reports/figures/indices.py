"""Shares of the metrics' variance by input: a field of inputs by metrics with the numbers in it."""

from dataclasses import dataclass
from textwrap import wrap
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

from reports.document import Drawing, Key
from reports.figures import paper, screen
from reports.figures.palette import FIELD, field_scale
from reports.numbers import count

LINE = 15  # characters of a metric's name beside the next one
DARK = 0.55  # a field below this share is dark, and takes white numbers


@dataclass(frozen=True)
class IndexMap(Drawing):
    """share : float64[n_inputs, n_metrics], NaN where there is none; n_used of n_tried cases, the fewest and most.

    index : its name; none, all : what 0 and 1 mean; counted : what n_used counts.
    """

    inputs: tuple[str, ...]
    metrics: tuple[str, ...]
    share: np.ndarray
    n_used: tuple[int, int]
    n_tried: int
    index: str = "first-order index"
    none: str = "knowing the input says nothing of the metric"
    all: str = "it says all"
    counted: str = "cases"

    @property
    def key(self) -> tuple[Key, ...]:
        few, most = self.n_used
        used = count(most) if few == most else f"{count(few)} to {count(most)}"
        meaning = f"from 0, dark: {self.none}, to 1, bright: {self.all}"
        colour = _hex(colormaps[FIELD](0.5))
        return (Key("field", colour, f"{self.index} {meaning}; {used} of {count(self.n_tried)} {self.counted}"),)

    @property
    def alternative(self) -> str:
        parts = []
        for k, metric in enumerate(self.metrics):
            column = self.share[:, k]
            order = [int(row) for row in np.argsort(-np.nan_to_num(column, nan=-1.0)) if np.isfinite(column[row])][:3]
            parts.append(f"{metric}: " + ", ".join(f"{self.inputs[row]} {_digits(column[row])}" for row in order))
        return f"Share of the variance of each metric by input, {self.index}. {'; '.join(parts)}."

    def interactive(self) -> list[dict[str, Any]]:
        trace = {
            "type": "heatmap",
            # Places are numbers, not words: plotly would read a name such as "2" as a number or a date.
            "x": list(range(len(self.metrics))),
            "y": list(range(len(self.inputs))),
            "z": screen.rounded(np.clip(self.share, 0.0, 1.0), 4),
            "text": [[_digits(value) for value in row] for row in self.share],
            "texttemplate": "%{text}",
            "customdata": [[screen.plain(f"{metric}, {one}") for metric in self.metrics] for one in self.inputs],
            "hovertemplate": "%{customdata}: %{text}<extra></extra>",
            "zmin": 0.0,
            "zmax": 1.0,
            "colorscale": field_scale(),
            "showscale": False,
            "xgap": 2,
            "ygap": 2,
            "hoverongaps": False,
        }
        titles = ["<br>".join(screen.plain(line) for line in wrap(metric, LINE)) for metric in self.metrics]
        x = screen.axis("", tickvals=trace["x"], ticktext=titles, side="top", showgrid=False, zeroline=False)
        labels = [screen.plain(one) for one in self.inputs]
        span = [len(self.inputs) - 0.5, -0.5]
        y = screen.axis("", tickvals=trace["y"], ticktext=labels, range=span, showgrid=False, zeroline=False)
        return [{"data": [trace], "layout": screen.layout(x, y, 110 + 30 * len(self.inputs), hovermode="closest")}]

    def printed(self) -> Figure:
        figure, (axis,) = paper.new_figure(1.1 + 0.24 * len(self.inputs))
        axis.pcolormesh(
            np.arange(len(self.metrics) + 1) - 0.5,
            np.arange(len(self.inputs) + 1) - 0.5,
            np.ma.masked_invalid(np.clip(self.share, 0.0, 1.0)),
            cmap=FIELD,
            vmin=0.0,
            vmax=1.0,
            edgecolors="white",
            linewidth=1.5,
        )
        for (row, column), value in np.ndenumerate(self.share):
            colour = "white" if value < DARK else "black"
            axis.text(column, row, _digits(value), ha="center", va="center", fontsize=7, color=colour)
        titles = ["\n".join(paper.literal(line) for line in wrap(metric, LINE)) for metric in self.metrics]
        axis.set_xticks(range(len(self.metrics)), titles)
        axis.set_yticks(range(len(self.inputs)), [paper.literal(one) for one in self.inputs])
        axis.xaxis.tick_top()
        axis.tick_params(length=0)
        axis.set_ylim(len(self.inputs) - 0.5, -0.5)
        axis.grid(visible=False)
        axis.spines[:].set_visible(False)
        paper.add_key(figure, self.key, columns=2)
        return figure


def _digits(value: float) -> str:
    """Two decimals, as far as the errors allow; an estimate below 0 is one of 0."""
    return f"{max(value, 0.0):.2f}" if np.isfinite(value) else ""


def _hex(colour: Any) -> str:
    return "#" + "".join(f"{round(255 * part):02x}" for part in colour[:3])
