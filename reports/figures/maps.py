"""A metric over two inputs: filled contours with the flown cases and the nominal on them."""

from collections.abc import Sequence

import numpy as np

from mc_engine.statistics import SurfaceMap
from reports.drawing.marks import Axis, Drawing, Field, Mark, Plot, Points
from reports.drawing.ticks import nice_ticks
from reports.text.numbers import count, number, with_unit

LEVELS = 12
DOT = "#1b1b1b"  # on the field, whose colours do not follow the page's


def metric_map(
    surface: SurfaceMap,
    points: np.ndarray,
    values: np.ndarray,
    case_ids: np.ndarray,
    labels: tuple[str, str, str],
    unit: str,
    *,
    n_points: int,
    rings: Sequence[Points] = (),
    columns: tuple[str, str, str] | None = None,
) -> Drawing:
    """points : float64[k, 2], the cases shown of n_points, with their metric float64[k] and numbers int64[k].

    labels : of both axes and of the metric;  unit : of the metric;  columns : their names in the table of cases.
    rings : around single points, as the nominal case.
    """
    key = f"surface: {surface_method(surface, unit)}"
    x, y = points.T
    shown = "all" if len(x) == n_points else f"{count(len(x))} of {count(n_points)}"
    texts = [f"{labels[2]}: {number(float(value))}" for value in values]
    marks: tuple[Mark, ...] = (
        Field(surface.x, surface.y, surface.value, contour_levels(surface.value), labels[2], key),
        Points(x, y, DOT, size=3.5, edge="#ffffff", texts=texts, cases=case_ids, columns=columns,
               key=f"cases, {shown} shown"),
        *rings,
    )  # fmt: skip
    across, up = (Axis(label, margin=0.0) for label in labels[:2])
    return Drawing("Filled contour map", (Plot(marks, across, up, height=500.0),))


def surface_method(surface: SurfaceMap, unit: str) -> str:
    """How the surface was made, with its standard error."""
    used = f"{count(surface.n_used)} of {count(surface.n_tried)} cases"
    if surface.exact:
        return f"exact, every grid node is a case ({used})"
    if surface.cases_per_node:
        most = "up to " if surface.n_used < surface.n_tried else ""  # a node may have lost some of its cases, or all
        return f"mean of {most}{count(surface.cases_per_node)} cases at each grid node ({used})"
    assert surface.error is not None  # a smoothed surface always has one
    errors = [number(float(pick(surface.error)), 2) for pick in (np.nanmedian, np.nanmax)]
    if surface.n_smoothed < surface.n_used:
        used = f"{count(surface.n_smoothed)} cases picked evenly out of {used}"
    return (
        f"local quadratic regression on the {surface.neighbours} nearest of {used}; error {errors[0]} (median) to "
        f"{with_unit(errors[1], unit)} (largest)"
    )


def contour_levels(values: np.ndarray) -> np.ndarray:
    """Round contour levels that cover the values."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    if high - low <= 1e-9 * max(abs(low), abs(high)):  # one value all over has a range, too
        high = low + 1e-6 * max(abs(low), 1.0)
    return np.array(nice_ticks(low, high, LEVELS, cover=True))
