"""One quantity of the flight against another, as altitude against speed, with percentile bands."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from reports.document import Drawing, Key
from reports.figures import paper, screen
from reports.figures.histories import OUTER, HistoryLine, band_pairs, line_style
from reports.figures.palette import MUTED, SKY, on_paper
from reports.numbers import count, number, percent

SAMPLES = 400
_PRINT_DASH = {"solid": "-", "dash": "--", "dot": ":"}
_MARKS = {"solid": "line", "dash": "dash", "dot": "dot"}


@dataclass(frozen=True)
class ProfileBand:
    """Quantiles of x over n_cases at levels of y: float64[n] by probability at levels float64[n]."""

    levels: np.ndarray
    curves: dict[float, np.ndarray]
    n_cases: int

    @property
    def pairs(self) -> list[tuple[float, float, float]]:
        """(lower, upper, opacity) of each band, the widest first."""
        return band_pairs(self.curves)

    def curve(self, probability: float) -> np.ndarray:
        """The quantile's curve; 1 - 0.05 is found although it is not 0.95 to the last bit."""
        return next(values for p, values in self.curves.items() if abs(p - probability) < 1e-9)


@dataclass(frozen=True)
class ProfileDrawing(Drawing):
    """Lines of retained cases, their x and y by these names, and the band over the fair ones."""

    lines: tuple[HistoryLine, ...]
    x: str
    y: str
    x_label: str
    y_label: str
    band: ProfileBand | None

    @property
    def named(self) -> list[HistoryLine]:
        """Nominal first, then the coloured ones in the order of their rank."""
        return sorted((line for line in self.lines if line.rank is not None), key=lambda line: line.rank or 0)

    @property
    def drawn(self) -> list[HistoryLine]:
        """From back to front."""
        return [*(line for line in self.lines if line.rank is None), *reversed(self.named)]

    @property
    def key(self) -> tuple[Key, ...]:
        entries = [Key(_MARKS[line_style(line.rank)[1]], line_style(line.rank)[0], line.name) for line in self.named]
        if self.band is not None:
            for low, high, opacity in self.band.pairs:
                text = f"{percent(low)} to {percent(high)} of {count(self.band.n_cases)} cases"
                entries.append(Key("band" if opacity == OUTER else "bar", SKY, text))
        others = len(self.lines) - len(self.named)
        return (*entries, Key("line", MUTED, f"{others} other retained cases")) if others else tuple(entries)

    @property
    def alternative(self) -> str:
        spans = []
        for name, label in ((self.x, self.x_label), (self.y, self.y_label)):
            values = np.concatenate([line.quantities[name] for line in self.lines])
            values = values[np.isfinite(values)]
            spans.append(f"{label} from {number(float(values.min()), 3)} to {number(float(values.max()), 3)}")
        band = f" Band over {count(self.band.n_cases)} cases." if self.band else ""
        return f"{spans[1]} against {spans[0]} along {len(self.lines)} flights.{band}"

    def interactive(self) -> list[dict[str, Any]]:
        data = self._screen_band()
        for line in self.drawn:
            x, y = thinned_curve(line.quantities[self.x], line.quantities[self.y])
            colour, dash, width = line_style(line.rank)
            trace = {
                "type": "scatter",
                "mode": "lines",
                "x": screen.rounded(x),
                "y": screen.rounded(y),
                "name": screen.plain(line.name),
                "line": {"color": colour, "dash": dash, "width": width},
                "opacity": 0.6 if line.rank is None else 1.0,
                "hovertemplate": "(%{x:.5g}, %{y:.5g})<extra>%{fullData.name}</extra>",
            }
            data.append(trace)
        x_axis, y_axis = screen.axis(self.x_label, zeroline=False), screen.axis(self.y_label, zeroline=False)
        return [{"data": data, "layout": screen.layout(x_axis, y_axis, 460, hovermode="closest")}]

    def _screen_band(self) -> list[dict[str, Any]]:
        """Each band as one closed curve: up along the lower quantile, down along the upper one."""
        traces = []
        for low, high, opacity in self.band.pairs if self.band else []:
            band = self.band
            assert band is not None
            trace = {
                "type": "scatter",
                "mode": "lines",
                "x": screen.rounded(np.r_[band.curve(low), band.curve(high)[::-1]]),
                "y": screen.rounded(np.r_[band.levels, band.levels[::-1]]),
                "line": {"width": 0, "color": SKY},
                "fill": "toself",
                "fillcolor": f"rgba(86,180,233,{opacity})",
                "hoverinfo": "skip",
            }
            traces.append(trace)
        return traces

    def printed(self) -> Figure:
        figure, (axis,) = paper.new_figure(3.9)
        for low, high, opacity in self.band.pairs if self.band else []:
            assert self.band is not None
            curves = self.band.curve(low), self.band.curve(high)
            axis.fill_betweenx(self.band.levels, *curves, color=SKY, alpha=opacity, linewidth=0)
        for line in self.drawn:
            colour, dash, width = line_style(line.rank)
            x, y = thinned_curve(line.quantities[self.x], line.quantities[self.y])
            axis.plot(x, y, color=on_paper(colour), linestyle=_PRINT_DASH[dash], linewidth=0.6 * width)
        axis.set(xlabel=paper.literal(self.x_label), ylabel=paper.literal(self.y_label))
        paper.add_key(figure, self.key)
        return figure


def thinned_curve(x: np.ndarray, y: np.ndarray, samples: int = SAMPLES) -> tuple[np.ndarray, np.ndarray]:
    """The curve with about `samples` points, evenly along its length in the units of its two ranges.

    Even in time, most points would lie at the end, where the flight is slow.
    """
    if x.size <= samples:
        return x, y
    steps = [np.diff(values) / (np.nanmax(values) - np.nanmin(values) or 1.0) for values in (x, y)]
    length = np.r_[0.0, np.cumsum(np.nan_to_num(np.hypot(*steps)))]
    rows = np.unique(np.searchsorted(length, np.linspace(0.0, length[-1], samples)).clip(0, x.size - 1))
    return x[rows], y[rows]
