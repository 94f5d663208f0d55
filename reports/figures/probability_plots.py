"""A normal probability plot: the sorted cases over the normal distribution with their mean and σ."""

import numpy as np
from scipy.special import betaincinv, ndtri

from reports.drawing.marks import Axis, Limit, Line, Mark, Plot, Points, between
from reports.drawing.palette import BLUE, INK, SKY, VERMILION
from reports.text.numbers import number, percent

MOST_POINTS = 160  # the outermost ones whole, the others evenly along the axis
OUTERMOST = 20  # on either side
CONTENT = 0.90  # of the band, at every point by itself
TICKS = (1e-6, 1e-5, 1e-4, 0.00135, 0.0228, 0.1587, 0.5, 0.8413, 0.9772, 0.99865, 0.9999, 0.99999, 0.999999)


def plotting_positions(n: int) -> np.ndarray:
    """Normal quantiles of the ranks 1 ... n, by Blom's positions (i - 3/8) / (n + 1/4)."""
    return np.asarray(ndtri((np.arange(1, n + 1) - 0.375) / (n + 0.25)))


def shown_ranks(n: int) -> np.ndarray:
    """The ranks, from 0, of the points that are drawn."""
    if n <= MOST_POINTS:
        return np.arange(n)
    end = -float(ndtri(OUTERMOST / n))
    z = np.linspace(-end, end, MOST_POINTS - 2 * OUTERMOST)
    middle = np.searchsorted(plotting_positions(n), z).clip(0, n - 1)
    return np.unique(np.r_[np.arange(OUTERMOST), middle, np.arange(n - OUTERMOST, n)])


def probability_plot(
    values: np.ndarray, cases: np.ndarray, label: str, title: str, limits: tuple[float, ...] = (), column: str = ""
) -> Plot:
    """values, cases : float64[n], sorted, and the case of each.  column : their name in the table of cases."""
    n, z = values.size, plotting_positions(values.size)
    mean, deviation = float(values.mean()), float(values.std(ddof=1))
    ranks = shown_ranks(n)
    low, high = (ndtri(betaincinv(ranks + 1, n - ranks, p)) for p in (0.5 - 0.5 * CONTENT, 0.5 + 0.5 * CONTENT))
    normal = f"normal distribution with the same mean and σ, with {percent(CONTENT)} band of every rank"
    ends = z[[0, -1]]
    marks: list[Mark] = [
        between(mean + deviation * z[ranks], low, high, SKY, 0.35),
        Line(mean + deviation * ends, ends, INK, normal, "dash", 1.2, key=normal),
        Points(values[ranks], z[ranks], BLUE, "cases", cases=cases[ranks], columns=(column,), key="cases by rank"),
    ]
    reach = Axis().ends([values])
    marks += [
        Limit(at, "x", VERMILION, f"required limit {number(at)}", key="required limit")
        for at in limits
        if reach[0] <= at <= reach[1]
    ]
    most = 1.04 * max(abs(float(ends[0])), 2.2)
    ticks = tuple((float(ndtri(p)), percent(p, 4)) for p in TICKS if abs(ndtri(p)) <= most)
    y = Axis(name="cumulative probability", reach=(-most, most), ticks=ticks)
    return Plot(tuple(marks), Axis(label, most=4), y, title, 250.0)
