"""Coastlines of the Earth in the plane of a footprint, from packaged data of Natural Earth (1:50m, public domain).

Their points are about 1 km from where the data have them, and the data leave out what is smaller than some kilometres:
they show where a footprint lies, and decide nothing.
"""

from functools import cache
from importlib.resources import files

import numpy as np

from mc_engine.statistics.geodesy import LocalPlane

HUNDREDTHS = 100.0  # of a degree, the unit of the data
DEGREE = 111_000.0  # metres of a degree of latitude, about


@cache
def _lines() -> tuple[np.ndarray, np.ndarray]:
    """All points float64[n, 2], longitude and latitude [deg], and the first row of each line."""
    with files("reports").joinpath("natural_earth", "coastline.npz").open("rb") as file, np.load(file) as data:
        steps, lengths = data["steps"].astype(np.float64), data["lengths"].astype(np.int64)
    first = np.cumsum(lengths) - lengths
    run = np.cumsum(steps, axis=0)
    return (run - np.repeat(run[first] - steps[first], lengths, axis=0)) / HUNDREDTHS, first


def coastlines(plane: LocalPlane, reach: float) -> list[np.ndarray]:
    """The coasts within about `reach` [m] of the plane's origin: float64[k, 2], km to the east and to the north."""
    places, first = _lines()
    rows = np.flatnonzero(np.abs(places[:, 1] - plane.latitude) < reach / DEGREE + 1.0)
    points = plane.points(places[rows, 1], places[rows, 0])
    near = np.hypot(points[:, 0], points[:, 1]) < reach
    rows, points = rows[near], points[near]
    if not rows.size:
        return []
    line = np.searchsorted(first, rows, side="right")
    cuts = np.flatnonzero((np.diff(rows) > 1) | (np.diff(line) > 0)) + 1
    return [piece / 1000.0 for piece in np.split(points, cuts) if len(piece) > 1]


def nearest_coast(plane: LocalPlane) -> float:
    """Metres from the plane's origin to the nearest point of a coast."""
    places, _ = _lines()
    return float(np.hypot(*plane.points(places[:, 1], places[:, 0]).T).min())
