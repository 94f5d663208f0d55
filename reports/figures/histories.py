"""Quantities along the flight: percentile bands, the nominal and the worst of the retained cases, a panel each."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from reports.document import Drawing, Key
from reports.figures import paper, screen
from reports.figures.palette import DASHES, INK, LINES, MUTED, SKY, on_paper
from reports.numbers import count, number, percent

SAMPLES = 400  # on the screen and on paper; extremes between them are kept
OUTER, INNER = 0.25, 0.45  # opacity of the wider and of the narrower band
_PRINT_DASH = {"solid": "-", "dash": "--", "dot": ":"}


@dataclass(frozen=True)
class HistoryLine:
    """One case: its name in the key, times float64[n] and the quantities float64[n] by name.

    rank : 0 for the nominal, 1 ... for the cases worth a colour, None for one drawn in grey.
    """

    name: str
    t: np.ndarray
    quantities: dict[str, np.ndarray]
    rank: int | None


@dataclass(frozen=True)
class HistoryBand:
    """Quantiles of one quantity over n_cases: float64[n] by probability at the times t; pairs of them are bands."""

    t: np.ndarray
    curves: dict[float, np.ndarray]
    n_cases: int

    @property
    def pairs(self) -> list[tuple[float, float, float]]:
        """(lower, upper, opacity) of each band, the widest first."""
        return band_pairs(self.curves)


def band_pairs(curves: Iterable[float]) -> list[tuple[float, float, float]]:
    """(lower, upper, opacity) of each band between curves of these probabilities, the widest first."""
    known = sorted(curves)
    low = [p for p in known if p < 0.5]
    # 1 - 0.05 is not 0.95 to the last bit
    return [(p, max(q for q in known if abs(p + q - 1.0) < 1e-9), o) for p, o in zip(low, (OUTER, INNER), strict=False)]


def thinned(t: np.ndarray, y: np.ndarray, samples: int = SAMPLES) -> tuple[np.ndarray, np.ndarray]:
    """The curve with about `samples` points; lowest and highest of every stretch stay, so that no pulse is lost."""
    if t.size <= samples:
        return t, y
    bounds = np.linspace(0, t.size, samples // 2 + 1).astype(int)[:-1]
    filled_low, filled_high = np.where(np.isfinite(y), y, np.inf), np.where(np.isfinite(y), y, -np.inf)
    keep = {0, t.size - 1}
    for begin, end in zip(bounds, [*bounds[1:], t.size], strict=True):
        keep.add(begin + int(np.argmin(filled_low[begin:end])))
        keep.add(begin + int(np.argmax(filled_high[begin:end])))
    rows = np.array(sorted(keep))
    return t[rows], y[rows]


def line_style(rank: int | None) -> tuple[str, str, float]:
    """Colour, dash and width of a line."""
    if rank is None:
        return MUTED, "solid", 1.0
    if rank == 0:
        return INK, "solid", 2.0
    return LINES[(rank - 1) % len(LINES)], DASHES[(rank - 1) // len(LINES) % len(DASHES)], 1.6


@dataclass(frozen=True)
class Histories(Drawing):
    """Lines of retained cases; labels : axis label per quantity, in the order of the panels; bands by quantity."""

    lines: tuple[HistoryLine, ...]
    labels: dict[str, str]
    bands: dict[str, HistoryBand] = field(default_factory=dict)

    @property
    def key(self) -> tuple[Key, ...]:
        marks = {"solid": "line", "dash": "dash", "dot": "dot"}
        entries = [Key(marks[line_style(line.rank)[1]], line_style(line.rank)[0], line.name) for line in self.named]
        for band in list(self.bands.values())[:1]:
            for low, high, opacity in band.pairs:
                text = f"{percent(low)} to {percent(high)} of {count(band.n_cases)} cases"
                entries.append(Key("band" if opacity == OUTER else "bar", SKY, text))
        others = len(self.lines) - len(self.named)
        return (*entries, Key("line", MUTED, f"{others} other retained cases")) if others else tuple(entries)

    @property
    def named(self) -> list[HistoryLine]:
        """Nominal first, then the coloured ones in the order of their rank."""
        return sorted((line for line in self.lines if line.rank is not None), key=lambda line: line.rank or 0)

    @property
    def drawn(self) -> list[HistoryLine]:
        """From back to front: grey lines, coloured ones, the nominal on top."""
        return [*(line for line in self.lines if line.rank is None), *reversed(self.named)]

    @property
    def alternative(self) -> str:
        parts = []
        for name, label in self.labels.items():
            values = np.concatenate([line.quantities[name] for line in self.lines])
            values = values[np.isfinite(values)]
            if values.size:
                parts.append(f"{label} between {number(float(values.min()), 3)} and {number(float(values.max()), 3)}")
        spread = "".join(f" Bands over {band.n_cases} cases." for band in list(self.bands.values())[:1])
        return f"Curves against time for {len(self.lines)} cases, nominal among them.{spread} {'; '.join(parts)}."

    def interactive(self) -> list[dict[str, Any]]:
        return [self._screen_panel(name, label) for name, label in self.labels.items()]

    def _screen_panel(self, name: str, label: str) -> dict[str, Any]:
        data = self._screen_bands(name)
        for line in self.drawn:
            t, y = thinned(line.t, line.quantities[name])
            colour, dash, width = line_style(line.rank)
            data.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": screen.rounded(t),
                    "y": screen.rounded(y),
                    "name": screen.plain(line.name),
                    "line": {"color": colour, "dash": dash, "width": width},
                    "opacity": 0.6 if line.rank is None else 1.0,
                    "hovertemplate": "%{x:.4g} s: %{y:.5g}<extra>%{fullData.name}</extra>",
                }
            )
        x, y_axis = screen.axis("time [s]", zeroline=False), screen.axis("", nticks=6)
        return {"data": data, "layout": screen.layout(x, y_axis, 270, label, hovermode="closest")}

    def _screen_bands(self, name: str) -> list[dict[str, Any]]:
        """Each band as two invisible curves, the second filled down to the first."""
        traces = []
        for band in [self.bands[name]] if name in self.bands else []:
            for low, high, opacity in band.pairs:
                for probability, fill in ((low, "none"), (high, "tonexty")):
                    trace = {
                        "type": "scatter",
                        "mode": "lines",
                        "x": screen.rounded(band.t),
                        "y": screen.rounded(band.curves[probability]),
                        "line": {"width": 0, "color": SKY},
                        "fill": fill,
                        "fillcolor": f"rgba(86,180,233,{opacity})",
                        "hovertemplate": f"%{{x:.4g}} s: %{{y:.5g}}<extra>{percent(probability)} of cases</extra>",
                    }
                    traces.append(trace)
        return traces

    def printed(self) -> Figure:
        columns = min(2, len(self.labels))
        rows = -(-len(self.labels) // columns)
        figure, axes = paper.new_figure(0.5 + 1.9 * rows, rows, columns)
        for axis, (name, label) in zip(axes, self.labels.items(), strict=False):
            for band in [self.bands[name]] if name in self.bands else []:
                for low, high, opacity in band.pairs:
                    axis.fill_between(
                        band.t, band.curves[low], band.curves[high], color=SKY, alpha=opacity, linewidth=0
                    )
            for line in self.drawn:
                colour, dash, width = line_style(line.rank)
                t, y = thinned(line.t, line.quantities[name])
                axis.plot(t, y, color=on_paper(colour), linestyle=_PRINT_DASH[dash], linewidth=0.6 * width)
            axis.set_title(paper.literal(label))
            axis.set_xlabel("time [s]")
            paper.few_ticks(axis, 6, 5)
        for axis in axes[len(self.labels) :]:
            axis.set_axis_off()
        paper.add_key(figure, self.key)
        return figure
