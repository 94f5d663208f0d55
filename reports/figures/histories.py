"""Quantities along the flight, against time or one another: envelopes, the nominal and the worst of the saved cases."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from reports.drawing.marks import Axis, Band, Drawing, Limit, Line, Mark, Plot, between
from reports.drawing.palette import DASHES, INK, LINES, MUTED, SKY, VERMILION
from reports.text.numbers import count, limit_number, percent

SAMPLES = 400  # on the screen and on paper; extremes between them are kept
OPACITIES = (0.25, 0.45)  # of the wider and of the narrower band
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
class HistoryLimit:
    """A required limit at a value of a quantity, with its words.

    other : what it asks for where it need not hold along the whole flight.
    """

    at: float
    words: str
    other: str = ""


@dataclass(frozen=True)
class Envelope:
    """Quantiles of a quantity over n_cases: float64[n] by probability, at the times or levels `at` float64[n].

    rising : of one at the levels of another quantity, whether the flights come to them from below.
    """

    at: np.ndarray
    curves: dict[float, np.ndarray]
    n_cases: int
    rising: bool = False

    def bands(self) -> Iterator[tuple[np.ndarray, np.ndarray, float, str]]:
        """Lower and upper curve, opacity and words of each band, the widest first."""
        known = sorted(self.curves)
        for low, high, opacity in zip(known, known[::-1], OPACITIES, strict=False):
            reach = "smallest to largest" if low == 0.0 else f"{percent(low, 3)} to {percent(high, 3)}"
            words = f"{reach} of {count(self.n_cases)} saved cases"
            yield self.curves[low], self.curves[high], opacity, words


def phase_limits(begins: Sequence[tuple[str, float]], words: str) -> list[Limit]:
    """A dotted line where each phase after the first begins.  begins : names and first times; words : for the key."""
    return [Limit(time, "x", MUTED, f"{name} begins", "dot", 1.0, False, words) for name, time in begins[1:]]


def history_plot(
    name: str,
    label: str,
    time: str,
    lines: Sequence[HistoryLine],
    envelope: Envelope | None = None,
    limits: Sequence[HistoryLimit] = (),
    phases: Sequence[Limit] = (),
) -> Plot:
    """A quantity against the time.  phases : see `phase_limits`."""
    marks: list[Mark] = [*phases]
    if envelope is not None:
        for low, high, opacity, words in envelope.bands():
            marks.append(between(envelope.at, low, high, SKY, opacity, words, words))
        words = f"{MEDIAN} of them"
        marks.append(Line(envelope.at, envelope.curves[0.5], INK, words, "dash", 1.6, key=words))
    marks += case_lines(lines, lambda line: thinned(line.t, line.quantities[name]))
    bottom, top = Plot(tuple(marks), Axis(), Axis()).ends[1]
    far = []
    for limit in limits:
        near = bottom - FAR * (top - bottom) <= limit.at <= top + FAR * (top - bottom)
        style, key = ("dash", limit.other) if limit.other else ("solid", "required limit")
        marks.append(Limit(limit.at, "y", VERMILION, limit.words, style, 2.0, near, key if near else ""))
        far += [] if near else [f"limit {limit_number(limit.at)} beyond the axis"]
    axes = Axis(time, margin=0.0), Axis(name=label, most=5)
    return Plot(tuple(marks), *axes, "\n".join([label, *far]), 260.0, quantity=name)


def history_figure(plots: Sequence[Plot]) -> Drawing:
    """Quantities against the time, a panel each."""
    return Drawing("Curves against time, the nominal case among them", tuple(plots), 3)


def profile_figure(
    names: tuple[str, str], labels: tuple[str, str], lines: Sequence[HistoryLine], envelopes: Sequence[Envelope]
) -> Drawing:
    """One quantity against another, as altitude against speed, with envelopes of the first at levels of the second."""
    marks: list[Mark] = []
    for envelope in envelopes:
        way = f", {'up' if envelope.rising else 'down'}" if len(envelopes) > 1 else ""
        for low, high, opacity, words in envelope.bands():
            x, y = np.r_[low, high[::-1]], np.r_[envelope.at, envelope.at[::-1]]
            marks.append(Band(x, y, SKY, opacity, words + way, key=words + way))
    marks += case_lines(lines, lambda line: thinned_curve(line.quantities[names[0]], line.quantities[names[1]]))
    plot = Plot(tuple(marks), Axis(labels[0]), Axis(labels[1]), height=440.0)
    return Drawing("Curves along flights, the nominal case among them", (plot,))


def case_lines(
    lines: Sequence[HistoryLine], curve: Callable[[HistoryLine], tuple[np.ndarray, np.ndarray]]
) -> Iterator[Line]:
    """The curves of cases from back to front: grey ones, coloured ones, the nominal."""
    others = f"{sum(line.rank is None for line in lines)} other saved cases"
    for line in sorted(lines, key=lambda line: -1e9 if line.rank is None else -line.rank):
        if line.rank is None:
            yield Line(*curve(line), MUTED, line.name, width=1.0, opacity=0.6, key=others)
        elif line.rank == 0:
            yield Line(*curve(line), INK, line.name, width=2.0, key=line.name)
        else:
            turn, place = divmod(line.rank - 1, len(LINES))
            yield Line(*curve(line), LINES[place], line.name, DASHES[turn % len(DASHES)], 1.6, key=line.name)


def thinned(t: np.ndarray, y: np.ndarray, samples: int = SAMPLES) -> tuple[np.ndarray, np.ndarray]:
    """The curve with about `samples` points; lowest and highest of every stretch stay, so that no pulse is lost."""
    if t.size <= samples:
        return t, y
    bounds = np.linspace(0, t.size, samples // 2 + 1).astype(int)
    low, high = (np.where(np.isfinite(y), y, beyond) for beyond in (np.inf, -np.inf))
    extremes = [begin + pick for begin, end in pairwise(bounds)
                for pick in (low[begin:end].argmin(), high[begin:end].argmax())]  # fmt: skip
    rows = np.unique([0, *extremes, t.size - 1])
    return t[rows], y[rows]


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
