"""Quantities along the flight, against time or one another: envelopes, the nominal and the worst of the saved cases."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from reports.drawing.marks import Axis, Band, Drawing, Limit, Line, Mark, Plot, between, to_scale, values_of
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
class Envelope:
    """Quantiles of a quantity over n_cases: float64[n] by probability, at the times or levels `at` float64[n].

    rising : of one at the levels of another quantity, whether the flights come to them from below.
    """

    at: np.ndarray
    curves: dict[float, np.ndarray]
    n_cases: int
    rising: bool = False

    def bands(self, upright: bool = False, way: str = "") -> Iterator[Band]:
        """The widest first, without one that so few cases support nowhere.

        upright : the levels lie along y;  way : for the words, of flights up or down.
        """
        known = sorted(self.curves)
        for low, high, opacity in zip(known, known[::-1], OPACITIES, strict=False):
            if not np.isfinite(self.curves[low]).any():
                continue
            reach = "smallest to largest" if low == 0.0 else f"{percent(low, 3)} to {percent(high, 3)}"
            words = f"{reach} of {count(self.n_cases)} saved cases{way}"
            yield between(self.at, self.curves[low], self.curves[high], SKY, opacity, words, words, upright)


def required_limit(at: float, words: str, other: str = "") -> Limit:
    """A required limit at a value of a quantity; other : what it asks for where not along the whole flight."""
    words, dash = f"{other or 'required limit'}: {words}", "dash" if other else "solid"
    return Limit(at, "y", VERMILION, words, dash, 2.0, key=other or "required limit")


def phase_limits(begins: Sequence[tuple[str, float]], words: str) -> list[Limit]:
    """A dotted line where each phase after the first begins.  begins : names and first times; words : for the key."""
    return [Limit(time, "x", MUTED, f"{name} begins", "dot", 1.0, False, words) for name, time in begins[1:]]


def history_plot(
    name: str,
    label: str,
    time: str,
    lines: Sequence[HistoryLine],
    envelope: Envelope | None,
    limits: Sequence[Limit],
    phases: Sequence[Limit],
) -> Plot:
    """A quantity against the time.  phases : see `phase_limits`."""
    marks: list[Mark] = [*phases]
    if envelope is not None:
        marks += envelope.bands()
        words = f"{MEDIAN} of them"
        marks.append(Line(envelope.at, envelope.curves[0.5], INK, words, "dash", 1.6, key=words))
    marks += case_lines(lines, lambda line: thinned(line.t, line.quantities[name]))
    bottom, top = Axis().ends(values_of(marks, "y"))
    room = FAR * (top - bottom)
    far = [limit for limit in limits if not bottom - room <= limit.at <= top + room]
    marks += [replace(limit, near=False, key="") if limit in far else limit for limit in limits]
    told = [f"limit {limit_number(limit.at)} beyond the axis" for limit in far]
    return Plot(tuple(marks), Axis(time, margin=0.0), Axis(), "\n".join([label, *told]), 260.0, quantity=name)


def history_figure(plots: Sequence[Plot]) -> Drawing:
    """Quantities against the time, a panel each."""
    return Drawing("Curves against time, the nominal case among them", tuple(plots), 3)


def profile_figure(
    names: tuple[str, str],
    labels: tuple[str, str],
    lines: Sequence[HistoryLine],
    envelopes: Sequence[Envelope],
    lengths: bool,
) -> Drawing:
    """One quantity against another, as altitude against speed, with envelopes of the first at levels of the second.

    lengths : whether both are lengths in one unit.
    """
    across, up = names
    marks: list[Mark] = []
    for envelope in envelopes:
        way = f", {'up' if envelope.rising else 'down'}" if len(envelopes) > 1 else ""
        marks += envelope.bands(upright=True, way=way)
    marks += case_lines(lines, lambda line: thinned(line.quantities[across], line.quantities[up], by_length=True))
    plot = Plot(tuple(marks), Axis(labels[0]), Axis(labels[1]), height=440.0)
    return Drawing("Curves along flights, the nominal case among them", (to_scale(plot) if lengths else plot,))


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


def thinned(
    x: np.ndarray, y: np.ndarray, samples: int = SAMPLES, *, by_length: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """The curve with at most `samples` points: the lowest and the highest of every stretch, so that no pulse is lost.

    by_length : stretches of equal length in the units of the two ranges, not of equally many points, most of which may
    lie where the curve hardly moves.
    """
    if x.size <= samples:
        return x, y
    way = np.arange(x.size, dtype=np.float64)
    if by_length:
        steps = [np.diff(values) / (np.fmax.reduce(values) - np.fmin.reduce(values) or 1.0) for values in (x, y)]
        way[1:] = np.cumsum(np.nan_to_num(np.hypot(*steps)))
    bounds = np.unique(np.searchsorted(way, np.linspace(0.0, way[-1], samples // 2)))
    low, high = (np.where(np.isfinite(y), y, beyond) for beyond in (np.inf, -np.inf))
    extremes = [begin + pick for begin, end in pairwise(bounds)
                for pick in (low[begin:end].argmin(), high[begin:end].argmax())]  # fmt: skip
    rows = np.unique([0, *extremes, x.size - 1])
    return x[rows], y[rows]
