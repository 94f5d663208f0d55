"""Statistical figures of inputs and metrics: success along an input, correlations, normal probability plots."""

from collections.abc import Sequence

import numpy as np
import scipy  # loads its packages when they are used

from mc_engine.statistics.drivers import SuccessCurve
from reports.drawing.marks import Axis, Bar, Limit, Line, Mark, Plot, Points, between, intervals, names_axis
from reports.drawing.palette import BLUE, INK, MUTED, SKY, VERMILION, blended
from reports.text.numbers import count, given_percent, limit_number, number, percent

WEAK = "#f7f7f7"  # the colour of no correlation
LIGHT = 0.6  # a cell of a weaker correlation is light, and takes black numbers
MOST_POINTS = 160  # of a probability plot: the outermost ones whole, the others evenly along the axis
OUTERMOST = 20  # on either side
TICKS = (1e-6, 1e-5, 1e-4, 0.00135, 0.0228, 0.1587, 0.5, 0.8413, 0.9772, 0.99865, 0.9999, 0.99999, 0.999999)


def success_panel(requirement: str, label: str, curve: SuccessCurve, overall: float, confidence: float) -> Plot:
    """Success probability in bins of an input, with exact two-sided limits; overall : that of all cases."""
    fraction = 100.0 * curve.passed / curve.tried
    names = [curve.levels[int(k)] for k in curve.middle] if curve.levels else []
    place = np.arange(len(names), dtype=np.float64) if names else curve.middle
    where = names or [number(float(at), 3) for at in place]
    texts = [
        f"{label}: {count(int(passed))} of {count(int(tried))} cases pass, {number(float(share), 4)} %"
        for label, passed, tried, share in zip(where, curve.passed, curve.tried, fraction, strict=True)
    ]
    extents = [] if names else [intervals(curve.low, curve.high, fraction, MUTED, "extent of the bin")]
    key = (
        f"fraction of a bin's cases that pass, at its median, with {given_percent(confidence)} Clopper–Pearson interval"
    )
    marks: tuple[Mark, ...] = (
        *extents,
        intervals(100.0 * curve.lower, 100.0 * curve.upper, place, BLUE, upright=True),
        Limit(100.0 * overall, "y", VERMILION, "all cases", "dash", 1.4, key="all cases"),
        Points(place, fraction, BLUE, size=6.0, texts=texts, key=key),
    )
    x = names_axis(names, label) if names else Axis(label)
    return Plot(marks, x, Axis("pass [%]"), requirement, 260.0)


def correlation_matrix(names: Sequence[str], rho: np.ndarray) -> Plot:
    """rho : float64[n, n], symmetric, NaN where there is none; blue cells are positive, red ones negative."""
    rows, columns = np.tril_indices(len(names), -1)
    known = np.isfinite(rho[rows, columns])
    order = np.argsort(rho[rows, columns][known])  # so that the sample in the key runs from negative to positive
    rows, columns = rows[known][order], columns[known][order]
    values = rho[rows, columns]
    labels = [f"{value:.2f}".replace("-0.00", "0.00").replace("-", "−") for value in values]
    cells = Bar(
        columns - 0.48,
        columns + 0.48,
        rows - 1.46,
        rows - 0.54,
        [blended(abs(value), WEAK, VERMILION if value < 0.0 else BLUE) for value in values],
        1.0,
        [f"{names[i]}, {names[k]}: {label}" for i, k, label in zip(rows, columns, labels, strict=True)],
        [label.replace("0.", ".") for label in labels],  # as correlations are printed: the cells are narrow
        ["#000000" if abs(value) < LIGHT else "#ffffff" for value in values],
        "rank correlation: blue positive, red negative",
    )
    x, y = names_axis(names[:-1]), names_axis(names[1:], down=True)
    return Plot((cells,), x, y, height=60.0 + 28.0 * len(names))


def probability_plot(
    values: np.ndarray, cases: np.ndarray, label: str, title: str, confidence: float,
    limits: Sequence[float] = (), column: str = "",
) -> Plot:  # fmt: skip
    """The sorted cases over the normal distribution with their mean and σ.

    values, cases : float64[n], sorted, and the case of each.  column : their name in the table of cases.
    confidence : of the band, at every point by itself
    """
    n, z = values.size, plotting_positions(values.size)
    mean, deviation = float(values.mean()), float(values.std(ddof=1))
    ranks = shown_ranks(n)
    tails = (0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence)
    low, high = (scipy.special.ndtri(scipy.special.betaincinv(ranks + 1, n - ranks, p)) for p in tails)
    normal = f"normal distribution with the same mean and σ, with {given_percent(confidence)} band of every rank"
    ends = z[[0, -1]]
    marks: list[Mark] = [
        between(mean + deviation * z[ranks], low, high, SKY, 0.35),
        Line(mean + deviation * ends, ends, INK, normal, "dash", 1.2, key=normal),
        Points(values[ranks], z[ranks], BLUE, "cases", cases=cases[ranks], columns=(column,), key="cases by rank"),
    ]
    reach = Axis().ends([values])
    near = [at for at in limits if reach[0] <= at <= reach[1]]
    marks += [Limit(at, "x", VERMILION, f"required limit {limit_number(at)}", key="required limit") for at in near]
    most = 1.04 * max(abs(float(ends[0])), 2.2)
    ticks = tuple((float(scipy.special.ndtri(p)), percent(p, 4)) for p in TICKS if abs(scipy.special.ndtri(p)) <= most)
    y = Axis("cumulative probability", reach=(-most, most), ticks=ticks)
    return Plot(tuple(marks), Axis(label), y, title, 250.0)


def plotting_positions(n: int) -> np.ndarray:
    """Normal quantiles of the ranks 1 ... n, by Blom's positions (i - 3/8) / (n + 1/4)."""
    return np.asarray(scipy.special.ndtri((np.arange(1, n + 1) - 0.375) / (n + 0.25)))


def shown_ranks(n: int) -> np.ndarray:
    """The ranks, from 0, of the points that are drawn."""
    if n <= MOST_POINTS:
        return np.arange(n)
    end = -float(scipy.special.ndtri(OUTERMOST / n))
    z = np.linspace(-end, end, MOST_POINTS - 2 * OUTERMOST)
    middle = np.searchsorted(plotting_positions(n), z).clip(0, n - 1)
    return np.unique(np.r_[np.arange(OUTERMOST), middle, np.arange(n - OUTERMOST, n)])
