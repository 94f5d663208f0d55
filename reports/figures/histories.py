"""Quantities along the flight, against time or one another: envelopes, the nominal and the worst of the saved cases."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from reports.drawing.marks import Axis, Band, Drawing, Limit, Line, Mark, Plot, between
from reports.drawing.palette import DASHES, INK, LINES, MUTED, SKY, VERMILION
from reports.text.numbers import count, number, percent

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
class Phases:
    """Names and first times of the phases of one case, and all of them in words for the key; empty without phases."""

    begins: tuple[tuple[str, float], ...] = ()
    words: str = ""

    def marks(self) -> Iterator[Limit]:
        """A dotted line where each phase after the first begins."""
        for name, time in self.begins[1:]:
            yield Limit(time, "x", MUTED, f"{name} begins", "dot", 1.0, False, self.words)


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


def history_plot(
    name: str,
    label: str,
    time: str,
    lines: Sequence[HistoryLine],
    envelope: Envelope | None = None,
    limits: Sequence[tuple[float, str]] = (),
    phases: Phases | None = None,
) -> Plot:
    """A quantity against the time.  limits : required limits with their words.  phases : of the nominal case."""
    marks: list[Mark] = [*(phases.marks() if phases else ())]
    if envelope is not None:
        for low, high, opacity, words in envelope.bands():
            marks.append(between(envelope.at, low, high, SKY, opacity, words, words))
        words = f"{MEDIAN} of them"
        marks.append(Line(envelope.at, envelope.curves[0.5], INK, words, "dash", 1.6, key=words))
    marks += case_lines(lines, lambda line: thinned(line.t, line.quantities[name]))
    bottom, top = Plot(tuple(marks), Axis(), Axis()).ends[1]
    far = []
    for at, words in limits:
        near = bottom - FAR * (top - bottom) <= at <= top + FAR * (top - bottom)
        marks.append(Limit(at, "y", VERMILION, words, "solid", 2.0, near, "required limit" if near else ""))
        far += [] if near else [f"limit {number(at)} beyond the axis"]
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
    bounds = np.linspace(0, t.size, samples // 2 + 1).astype(int)[:-1]
    filled_low, filled_high = np.where(np.isfinite(y), y, np.inf), np.where(np.isfinite(y), y, -np.inf)
    keep = {0, t.size - 1}
    for begin, end in zip(bounds, [*bounds[1:], t.size], strict=True):
        keep.add(begin + int(np.argmin(filled_low[begin:end])))
        keep.add(begin + int(np.argmax(filled_high[begin:end])))
    rows = np.array(sorted(keep))
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
