"""Histograms with quantiles, their distribution-free intervals, the nominal, limits and printed distributions."""

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import pairwise

import numpy as np

from mc_engine.numbers_in_text import digits_within
from mc_engine.statistics import Quantile, Summary
from mc_engine.statistics.summary import nearly_equal
from reports.drawing.marks import Axis, Bar, Drawing, Limit, Line, Mark, Plot
from reports.drawing.palette import BLUE, GREEN, INK, ORANGE, SKY, VERMILION
from reports.text.numbers import count, counted, given_percent, interval, limit_number, number

FEWEST_BINS, MOST_BINS = 8, 48
CENTRAL = (0.005, 0.995)  # what a histogram must show well
SPOILT = 3.0  # times the width of the central part: a wider range is cut
FAR = 10.0  # times the width of all bins: a nominal or limit farther away is told, not drawn
NORMAL_REACH, NORMAL_POINTS = 4.0, 81  # standard deviations on either side, places of a printed distribution


def histogram(
    values: np.ndarray,
    label: str,
    summary: Summary,
    outer: Sequence[float],
    *,
    title: str = "",
    nominal: float | None = None,
    limits: Sequence[float] = (),
    normal: tuple[float, float] | None = None,
    column: str = "",
    with_intervals: bool = False,
    height: float = 240.0,
) -> Plot:
    """Finite values float64[n] of a metric, with the median and the quantiles of the probabilities `outer`.

    normal : mean and standard deviation of the normal distribution that the source prints for such cases.
    column : the metric's name in the table of cases.
    """
    low, high = shown_range(values)
    edges = bin_edges(values[(values >= low) & (values <= high)])
    counts = np.histogram(values, edges)[0]
    curve = _normal_curve(normal, values.size * (edges[1] - edges[0])) if normal else np.empty((2, 0))
    top = 1.06 * max([float(counts.max()), *curve[1]])
    quantiles = [quantile for p in (0.5, *outer) if (quantile := summary.at(p)) is not None]
    drawn = [quantile for quantile in quantiles if edges[0] <= quantile.value <= edges[-1]]
    plain = partial(number, digits=digits_within(edges[0], edges[-1]))
    texts = [
        f"{plain(a)} to {plain(b)}: {count(int(n))} cases" for (a, b), n in zip(pairwise(edges), counts, strict=True)
    ]
    marks: list[Mark] = [_bounds(drawn, summary.confidence, top, edges)] * with_intervals
    bottom = np.zeros(counts.size)
    marks.append(Bar(edges[:-1], edges[1:], bottom, counts, SKY, texts=texts, column=column, key="cases"))
    marks += _percentile_lines(drawn, outer, with_intervals, digits_within(edges[0], edges[-1]))
    beyond = [counted(values.size - int(counts.sum()), "case")] if counts.sum() < values.size else []
    beyond += [
        f"{given_percent(quantile.probability)} percentile {plain(quantile.value)}"
        for quantile in quantiles
        if quantile not in drawn
    ]
    known = [] if nominal is None else [nominal]
    for places, words, key, colour, dash in (
        (known, "nominal", "nominal", INK, "dot"), (limits, "limit", "required limit", VERMILION, "solid"),
    ):  # fmt: skip
        shown = plain if key == "nominal" else limit_number
        near = [at for at in places if _near(at, edges)]
        far = [shown(at) for at in places if at not in near]
        marks += [Limit(at, "x", colour, f"{key} {shown(at)}", dash, key=key) for at in near]
        beyond += [f"{words}{'s' * (len(far) > 1)} {' and '.join(far)}"] if far else []
    if normal:
        words = f"printed normal distribution, {number(normal[0])} ± {number(normal[1])} (1 σ)"
        key = "normal distribution that the source prints"
        marks.append(Line(curve[0], curve[1], GREEN, width=2.0, text=words, key=key))
    told = f"{', '.join(beyond)} beyond the axis" if beyond else ""
    x = Axis(label, whole=bool(edges[1] - edges[0] == 1.0), margin=0.03)
    y = Axis("cases", reach=(0.0, top), whole=True)
    return Plot(tuple(marks), x, y, "\n".join(filter(None, (title, told))), height)


def _near(place: float, edges: np.ndarray) -> bool:
    """Whether a place is so near to the bins that an axis with both still shows their shape."""
    reach = FAR * (edges[-1] - edges[0])
    return bool(edges[0] - reach <= place <= edges[-1] + reach)


def _normal_curve(normal: tuple[float, float], cases_times_width: float) -> np.ndarray:
    """float64[2, n]: places, and cases in a bin there if as many cases had the normal distribution."""
    z = np.linspace(-NORMAL_REACH, NORMAL_REACH, NORMAL_POINTS)
    density = np.exp(-0.5 * z * z) / (normal[1] * np.sqrt(2.0 * np.pi))
    return np.array([normal[0] + normal[1] * z, cases_times_width * density])


def _bounds(quantiles: Sequence[Quantile], confidence: float, top: float, edges: np.ndarray) -> Bar:
    """Intervals of the quantiles, as high as the panel, as far as the bins go."""
    ends = [(q.lower, q.upper) for q in quantiles if q.lower is not None and q.upper is not None]
    left, right = np.array(ends).reshape(-1, 2).clip(edges[0], edges[-1]).T
    key = (
        f"{given_percent(0.5 * (1.0 + confidence))} confidence bounds of a percentile, distribution-free"
        if ends
        else ""
    )
    return Bar(left, right, np.zeros(left.size), np.full(left.size, top), BLUE, 0.3, key=key)


def _percentile_lines(
    quantiles: Sequence[Quantile], outer: Sequence[float], with_intervals: bool, digits: int
) -> Iterator[Limit]:
    both = f"{' and '.join(given_percent(p) for p in outer)} percentiles"
    for q in quantiles:
        bounds = f" {interval(q.lower, q.upper, digits=digits)}" if with_intervals else ""
        words = f"{given_percent(q.probability)} percentile {number(q.value, digits)}{bounds}"
        colour, dash, key = (ORANGE, "solid", "median") if q.probability == 0.5 else (BLUE, "dash", both)
        yield Limit(q.value, "x", colour, words, dash, key=key)


def histograms(plots: Sequence[Plot]) -> Drawing:
    """Histograms as small multiples."""
    return Drawing("Histograms", tuple(plots), 4)


def shown_range(values: np.ndarray) -> tuple[float, float]:
    """The range of a histogram of finite values (float64[n], n > 0): all of them, unless a few would squeeze the rest.

    If the central 99 % take less than a third of the whole range, it ends half of their width outside them.
    """
    low, high = float(values.min()), float(values.max())
    inner_low, inner_high = (float(end) for end in np.quantile(values, CENTRAL))
    width = inner_high - inner_low
    if width <= 0.0 or high - low <= SPOILT * width:
        return low, high
    return max(low, inner_low - 0.5 * width), min(high, inner_high + 0.5 * width)


def bin_edges(values: np.ndarray) -> np.ndarray:
    """Edges by Freedman & Diaconis's rule, between 8 and 48 bins, over the whole range of the values.

    Counts (whole numbers over a short range) get a bin each.
    """
    low, high = float(values.min()), float(values.max())
    if 0.0 < high - low < MOST_BINS and bool((values == np.round(values)).all()):
        return np.arange(low - 0.5, high + 1.0)
    if nearly_equal(low, high):
        half = max(abs(low), 1.0) * 1e-3
        return np.linspace(low - half, high + half, FEWEST_BINS + 1)
    spread = float(np.subtract(*np.percentile(values, [75, 25])))
    width = max(2.0 * spread / values.size ** (1.0 / 3.0), (high - low) / MOST_BINS)
    return np.linspace(low, high, int(np.clip(np.ceil((high - low) / width), FEWEST_BINS, MOST_BINS)) + 1)
