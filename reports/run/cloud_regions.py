"""Regions of the cloud of cases over two metrics: covariance ellipses, and one that assumes no shape.

Computed on the metrics in units of their standard deviations, so that the units of the axes do not matter.
"""

from collections.abc import Callable, Iterator

import numpy as np

from mc_engine.section import ReportSection
from mc_engine.statistics.moments import in_units, near_one
from mc_engine.statistics.regions import covariance_ellipses, density_regions
from reports.drawing.marks import Line
from reports.figures.clouds import outline
from reports.run.flown import Flown
from reports.text.numbers import count, given_percent, percent

MIDDLE = 0.5  # the fraction in the inner ellipse
FEWEST = 20  # cases, and different numbers of each metric
THINNEST = 1e-6  # standard deviations


def cloud_regions(flown: Flown, names: tuple[str, str], x: np.ndarray, y: np.ndarray) -> tuple[Line, ...]:
    """Regions of finite values float64[n]; none unless both columns are metrics of cases that were drawn at random."""
    metrics = {fact.name for fact in flown.with_role("metric")}
    distinct = (np.unique(values).size for values in (x, y))
    if not flown.random or not metrics.issuperset(names) or min(distinct) < FEWEST:
        return ()
    points, exponent = near_one(np.column_stack([x, y]))
    centre, scale = points.mean(axis=0), points.std(axis=0)
    if not np.all(scale > 1e-12 * np.abs(points).max(axis=0)):
        return ()

    def placed(curve: np.ndarray) -> np.ndarray:
        return in_units(centre + curve * scale, exponent)

    ranges = np.transpose([flown.range(name) for name in names])
    return tuple(_regions((points - centre) / scale, placed, ranges, flown.stated))


def _regions(
    points: np.ndarray, placed: Callable[[np.ndarray], np.ndarray], ranges: np.ndarray, stated: ReportSection
) -> Iterator[Line]:
    """Regions of standardised points.  ranges : float64[2, 2], lowest and highest possible x and y.

    A normal distribution whose ellipse reaches what is impossible is not that of these metrics: no ellipse then.
    """
    n, contents = count(len(points)), (MIDDLE, stated.probability)
    ellipses = [(ellipse, placed(ellipse.outline())) for ellipse in covariance_ellipses(points, contents, THINNEST)]
    if all((ranges[0] <= curve).all() and (curve <= ranges[1]).all() for _, curve in ellipses):
        for nth, (ellipse, curve) in enumerate(ellipses):
            held = f"holds {count(ellipse.inside)} of {n} cases, {percent(ellipse.inside / ellipse.n, 1)}"
            text = f"{given_percent(ellipse.content)} ellipse of a normal distribution: {held}"
            yield outline("ellipse", text, (curve,), nth)
    for region in density_regions(points, contents[1:], stated.confidence, THINNEST):
        text = (
            f"distribution-free region, at least {given_percent(region.content)} with "
            f"{given_percent(region.confidence)} confidence: holds {count(region.inside)} of {n} cases"
        )
        yield outline("region", text, [np.clip(placed(curve), *ranges) for curve in region.outlines])
