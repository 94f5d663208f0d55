"""Quantities along the flight: percentile bands, the nominal and the worst of the retained cases, a panel each."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from reports.drawing.marks import Axis, Drawing, Limit, Line, Mark, Plot, between
from reports.drawing.palette import BLUE, DASHES, INK, LINES, MUTED, SKY, VERMILION
from reports.text.numbers import count, number, percent

SAMPLES = 400  # on the screen and on paper; extremes between them are kept
OUTER, INNER = 0.25, 0.45  # opacity of the wider and of the narrower band
MEDIAN = "median"
FAR = 3.0  # times the range of a panel: a limit farther away is told, not drawn


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


def back_to_front(lines: Sequence[HistoryLine]) -> list[HistoryLine]:
    """Grey lines, coloured ones, the nominal on top."""
    return sorted(lines, key=lambda line: -1e9 if line.rank is None else -line.rank)


def band_name(low: float, high: float, n_cases: int) -> str:
    reach = "smallest to largest" if low == 0.0 else f"{percent(low, 3)} to {percent(high, 3)}"
    return f"{reach} of {count(n_cases)} saved cases"


def case_lines(
    lines: Sequence[HistoryLine], curve: Callable[[HistoryLine], tuple[np.ndarray, np.ndarray]]
) -> list[Line]:
    """The curves of cases in their styles, from back to front."""
    others = f"{sum(line.rank is None for line in lines)} other saved cases"
    found = []
    for line in back_to_front(lines):
        colour, dash, width = line_style(line.rank)
        grey = line.rank is None
        found.append(
            Line(*curve(line), colour, line.name, dash, width, 0.6 if grey else 1.0, key=others if grey else line.name)
        )
    return found


@dataclass(frozen=True)
class Histories(Drawing):
    """Lines of retained cases; labels : axis label per quantity, in the order of the panels; bands by quantity.

    limits : of a quantity by its name: required limits with their words.
    """

    lines: tuple[HistoryLine, ...]
    labels: dict[str, str]
    bands: dict[str, HistoryBand] = field(default_factory=dict)
    limits: dict[str, tuple[tuple[float, str], ...]] = field(default_factory=dict)
    time: str = "time [s]"
    across = 3
    form = "Curves against time, the nominal case among them"

    @property
    def plots(self) -> tuple[Plot, ...]:
        return tuple(self._plot(name, label) for name, label in self.labels.items())

    def _plot(self, name: str, label: str) -> Plot:
        marks: list[Mark] = []
        band = self.bands.get(name)
        if band is not None:
            for low, high, opacity in band.pairs:
                said = band_name(low, high, band.n_cases)
                marks.append(between(band.t, band.curves[low], band.curves[high], SKY, opacity, said, said))
            said = f"{MEDIAN} of them"
            marks.append(Line(band.t, band.curves[0.5], BLUE, said, "dash", 1.6, key=said))
        marks += case_lines(self.lines, lambda line: thinned(line.t, line.quantities[name]))
        ends = Plot(tuple(marks), Axis(), Axis()).ends[1]
        room = FAR * (ends[1] - ends[0])
        far = []
        for at, said in self.limits.get(name, ()):
            near = ends[0] - room <= at <= ends[1] + room
            marks.append(Limit(at, "y", VERMILION, said, "solid", 2.0, near, key="required limit" if near else ""))
            far += [] if near else [f"limit {number(at)} beyond the axis"]
        return Plot(
            tuple(marks), Axis(self.time, margin=0.0), Axis(name=label, most=5), "\n".join([label, *far]), 260.0
        )
