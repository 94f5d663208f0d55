"""Regions of the cloud of cases over two metrics: covariance ellipses, and one that assumes no shape.

Computed on the metrics in units of their standard deviations, so that the units of the axes do not matter.
"""

from collections.abc import Callable, Iterator

import numpy as np

from mc_engine.statistics.moments import in_units, near_one
from mc_engine.statistics.regions import covariance_ellipses, density_regions
from reports.figures.scatter import CloudRegion
from reports.flown import CONFIDENCE, Flown
from reports.numbers import count, percent

ELLIPSES = (0.9, 0.99)
REGION = 0.9
FEWEST = 20  # cases, and different numbers of each metric
THINNEST = 1e-6  # standard deviations


def cloud_regions(flown: Flown, names: tuple[str, str], x: np.ndarray, y: np.ndarray) -> tuple[CloudRegion, ...]:
    """Regions of finite values float64[n]; none unless both columns are metrics of cases that were drawn at random."""
    metrics = {fact.name for fact in flown.with_role("metric")}
    distinct = (np.unique(values).size for values in (x, y))
    if not flown.random or not metrics.issuperset(names) or min(distinct) < FEWEST:
        return ()
    points, exponent = near_one(np.column_stack([x, y]))
    centre, scale = points.mean(axis=0), points.std(axis=0)
    if not np.all(scale > 1e-12 * np.abs(points).max(axis=0)):
        return ()

    def placed(outline: np.ndarray) -> np.ndarray:
        return in_units(centre + outline * scale, exponent)

    return tuple(_regions((points - centre) / scale, placed))


def _regions(points: np.ndarray, placed: Callable[[np.ndarray], np.ndarray]) -> Iterator[CloudRegion]:
    n = count(len(points))
    for one in covariance_ellipses(points, ELLIPSES, THINNEST):
        held = f"really holds {count(one.inside)} of {n}, {percent(one.inside / one.n, 1)}"
        text = f"ellipse of a normal cloud's {percent(one.content)} (χ²): {held}"
        yield CloudRegion(True, text, (placed(one.outline()),))
    for region in density_regions(points, (REGION,), CONFIDENCE, THINNEST):
        text = (
            f"at least {percent(region.content)} of all flights, {percent(region.confidence)} confidence, any shape: "
            f"holds {count(region.inside)} of {n}"
        )
        yield CloudRegion(False, text, tuple(map(placed, region.outlines)))
