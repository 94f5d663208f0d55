"""Figures with a row for each requirement, metric, level or input: margins, changes, levels, contributors."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mc_engine.numbers_in_text import digits_within
from reports.drawing.marks import Axis, Bar, Drawing, Limit, Line, Mark, Plot, Points, finite, intervals, names_axis
from reports.drawing.palette import BLUE, GREEN, INK, MUTED, ORANGE, PAPER, SKY, VERMILION
from reports.drawing.ticks import MOST_TICKS
from reports.text.numbers import SPACE, count, number

MOST_MARGIN = 1.0  # of the reach of the limits, either way; margins beyond are drawn at the edge
ROWS_TOGETHER = 16  # of a panel of margins: with names of four lines it fits on a page
TONES = {"good": GREEN, "bad": VERMILION, "open": MUTED}
SPREAD = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)  # probabilities of what is drawn of a level
SPANS = ((0, 6, MUTED, 1.2, "all cases", 1), (1, 5, SKY, 7.0, "5 % to 95 %", 20),
         (2, 4, BLUE, 11.0, "middle half of the cases", 4))  # of SPREAD, with the fewest cases last  # fmt: skip
FAR_SIGMA = 10.0  # a larger shift would squeeze those of some σ to nothing on a linear axis
FAR_APART = 30.0  # levels whose medians differ by such a ratio are drawn on a logarithmic axis


def margin_figure(names: Sequence[str], margins: np.ndarray, tones: Sequence[str]) -> Drawing:
    """Margins of requirements over the reach of their limits, negative outside.

    margins : float64[n, 2], the demonstrated one, NaN if there is none, and that of the worst case.
    tones : of the verdicts, "good", "bad" or "open".
    """
    bound, worst = 100.0 * np.clip(margins.T, -MOST_MARGIN, MOST_MARGIN)
    words = [
        ["none" if margin != margin else f"{number(100.0 * margin, 3, up=False)}{SPACE}%" for margin in row]
        for row in margins.tolist()
    ]
    labels = [f"{name}, {row[0]}".removesuffix(", none") for name, row in zip(names, words, strict=True)]
    texts = [
        f"{name}: demonstrated {demonstrated}, worst case {worst_case}"
        for name, (demonstrated, worst_case) in zip(names, words, strict=True)
    ]
    ends = finite([bound, worst, 0.0])
    across = Axis("margin relative to the limits [%]", reach=(float(ends.min()) - 5.0, float(ends.max()) + 5.0))
    plots = []
    for rows in np.array_split(np.arange(len(names)), -(-len(names) // ROWS_TOGETHER)):
        place, known = np.arange(rows.size, dtype=np.float64), np.isfinite(bound[rows])
        x, y, told = bound[rows][known], place[known], [texts[k] for k in rows[known].tolist()]
        colours = [TONES[tones[k]] for k in rows[known].tolist()]
        key = "demonstrated bound (tolerance limit)"
        marks = (
            Bar(np.fmin(x, 0.0), np.fmax(x, 0.0), y - 0.3, y + 0.3, colours, 0.35, told),
            Points(x, y, BLUE, key, "diamond", 9.0, texts=told, key=key * bool(told)),
            Points(worst[rows], place, INK, "worst case", "x", 8.0, texts=[texts[k] for k in rows], key="worst case"),
            Limit(0.0, "x", VERMILION, "limit", key="limit"),
        )
        up = names_axis([labels[k] for k in rows], down=True)
        plots.append(Plot(marks, across, up, height=70.0 + 26.0 * rows.size))
    return Drawing("Margins relative to the limits", tuple(plots), 1, "; ".join(texts))


@dataclass(frozen=True)
class ChangeScale:
    """An axis of changes.  unchanged : 0 of a difference, 1 of a ratio.  places : of changes on the axis."""

    unchanged: float
    axis: Axis
    places: Callable[[np.ndarray], np.ndarray]

    @property
    def words(self) -> str:
        return "logarithmic beyond 1 σ" if self.places is np.arcsinh else ""


def difference_scale(estimates: np.ndarray) -> ChangeScale:
    """For differences float64[n, 3] in σ: where some are far larger, places are sinh⁻¹, so that all are seen."""
    if not (np.abs(finite([estimates[:, 0]])) > FAR_SIGMA).any():
        return ChangeScale(0.0, Axis(reach=_reach(estimates)), np.asarray)
    reach = _reach(np.arcsinh(estimates))
    ticks = tuple((float(np.arcsinh(at)), number(at)) for at in _decades(*np.sinh(reach).tolist()))
    return ChangeScale(0.0, Axis(reach=reach, ticks=ticks), np.arcsinh)


def ratio_scale(estimates: np.ndarray) -> ChangeScale:
    """For ratios float64[n, 3]: logarithmic."""
    with np.errstate(divide="ignore"):  # an interval without a lower end
        low, high = np.exp(_reach(np.log(estimates))).tolist()
    return ChangeScale(1.0, Axis(reach=(low, high), log=True), np.asarray)


def _reach(estimates: np.ndarray) -> tuple[float, float]:
    """Ends of an axis that has every value, 0 and, unless they reach far beyond, every interval."""
    values = finite([estimates[:, 0], 0.0])
    room = max(float(np.ptp(values)), 0.1)
    seen = finite([estimates, 0.0]).clip(values.min() - room, values.max() + room)
    return float(seen.min()) - 0.05 * room, float(seen.max()) + 0.05 * room


def _decades(low: float, high: float) -> list[float]:
    """0 and powers of ten of both signs from 1 on between low and high, every one or, if that is many, some of them."""
    powers = range(int(np.log10(max(-low, high))) + 1)
    for every in range(1, len(powers) + 1):
        tens = [10.0**power for power in powers[::every]]
        places = [at for at in (*(-ten for ten in tens[::-1]), 0.0, *tens) if low <= at <= high]
        if len(places) <= MOST_TICKS:
            break
    return places


def change_panel(
    title: str, metrics: Sequence[str], estimates: np.ndarray, significant: np.ndarray, scale: ChangeScale,
    interval: str,
) -> Plot:  # fmt: skip
    """One kind of change from a run to another, of each metric.

    estimates : float64[n, 3], value and ends of its interval, NaN where not defined.  significant : bool[n].
    """
    at, low, high = scale.places(estimates).T
    low, high = np.clip((low, high), *(scale.axis.reach or (-np.inf, np.inf)))  # ends may be infinite
    marks: list[Mark] = [Limit(scale.unchanged, "x", INK, "no change", "dash", 1.0, key="no change")]
    for sure, colour, sign, key in (
        (False, BLUE, "circle", "not significant"),
        (True, VERMILION, "diamond", f"significant, with its {interval} interval"),
    ):
        rows = np.flatnonzero(np.isfinite(at) & (significant == sure)).tolist()
        told = [[number(end, 3) for end in estimates[k].tolist()] for k in rows]
        texts = [
            f"{metrics[k]}: {value}, {lower} to {upper}" for k, (value, lower, upper) in zip(rows, told, strict=True)
        ]
        marks.append(intervals(low[rows], high[rows], np.array(rows), colour))
        marks.append(Points(at[rows], np.array(rows), colour, key, sign, 8.0, texts=texts, key=key))
    up = names_axis(metrics, down=True)
    title = "\n".join(filter(None, (title, scale.words)))
    return Plot(tuple(marks), scale.axis, up, title, 70.0 + 24.0 * len(metrics))


def level_panel(label: str, levels: Sequence[str], quantiles: np.ndarray, used: Sequence[int]) -> Plot:
    """A metric by level: quantiles float64[n_levels, 7] at SPREAD, NaN for a level without a number, and counts."""
    marks: list[Mark] = []
    ends = quantiles[np.isfinite(quantiles)]
    digits = digits_within(float(ends.min()), float(ends.max()), least=4) if ends.size else 4
    # Places are numbers, not words: plotly would read a level such as "2" as a number or a date.
    for place, (level, row, cases) in enumerate(zip(levels, quantiles, used, strict=True)):
        for low, high, colour, width, key, fewest in SPANS:
            if 0 < cases < fewest:
                continue
            reach = " to ".join(number(float(row[end]), digits) for end in (low, high))
            text = f"{level}, {count(cases)} cases: {reach}"
            marks.append(Line(row[[low, high]], np.full(2, place), colour, width=width, text=text, key=key))
    median = quantiles[:, 3]
    texts = [f"{level}: median {number(float(value), digits)}" for level, value in zip(levels, median, strict=True)]
    marks.append(Points(median, np.arange(median.size), ORANGE, size=8.0, edge=PAPER, texts=texts, key="median"))
    known = median[np.isfinite(median)]
    log = bool(known.size and np.nanmin(quantiles) > 0.0 and known.max() > FAR_APART * known.min())
    title = f"{label}{', logarithmic' if log else ''}"
    return Plot(tuple(marks), Axis(log=log), names_axis(levels, down=True), title, 40.0 + 26.0 * len(levels))


def single_change_panel(label: str, names: Sequence[str], changes: Sequence[tuple[Sequence[str], np.ndarray]]) -> Plot:
    """Bars from the lowest to the highest change of a metric by each input, with a sign for each level.

    label : of the change.  changes : by input, its levels in words and the change at each, float64[n_levels].
    """
    place = np.arange(len(names), dtype=np.float64)
    low, high = np.array([(np.nanmin([0.0, *row]), np.nanmax([0.0, *row])) for _, row in changes]).T
    marks: list[Mark] = [Bar(low, high, place - 0.3, place + 0.3, SKY, 0.9)]
    texts = [
        f"{name} {level}: {number(float(change), 4)}"
        for name, (levels, row) in zip(names, changes, strict=True)
        for level, change in zip(levels, row, strict=True)
    ]
    at, every = np.concatenate([row for _, row in changes]), np.repeat(place, [row.size for _, row in changes])
    known = np.flatnonzero(np.isfinite(at)).tolist()
    key = "one level of the input"
    marks.append(Points(at[known], every[known], BLUE, key, size=6.0, texts=[texts[k] for k in known], key=key))
    marks.append(Limit(0.0, "x", INK, "all inputs nominal", "dash", 1.0, key="all inputs nominal"))
    return Plot(tuple(marks), Axis(label), names_axis(names, down=True), "", 44.0 + 22.0 * len(names))


def tornado(metric: str, names: Sequence[str], total: np.ndarray, first: np.ndarray, interval: str) -> Plot:
    """Bars of total effects, those of first effects beside them; float64[n, 3]: value and both ends of its interval."""
    marks: list[Mark] = []
    for values, colour, offset, key in ((total, BLUE, -0.18, "total effect"), (first, SKY, 0.2, "first-order effect")):
        rows = np.flatnonzero(np.isfinite(values[:, 0]))
        texts = [f"{names[row]}: {key} {number(values[row, 0], 2)}" for row in rows.tolist()]
        (size, low, high), place = np.maximum(values[rows], 0.0).T, rows + offset
        marks.append(Bar(np.zeros(rows.size), size, place - 0.17, place + 0.17, colour, 0.9, texts, key=key))
        marks.append(intervals(low, high, place, INK, f"{interval} interval" * bool(np.isfinite(low).any())))
    ends = np.stack([total, first])
    x = Axis("fraction of the variance", reach=(0.0, 1.04 * max(ends[np.isfinite(ends)].tolist(), default=0.01)))
    return Plot(tuple(marks), x, names_axis(names, down=True), metric, 34.0 + 20.0 * len(names))
