"""A metric over two inputs: exact from a full grid, smoothed from scattered cases.

Scattered cases: at each point of a picture grid, a quadratic surface through the nearest cases, weighted by
distance (local regression, Cleveland & Devlin, J. Am. Stat. Assoc. 83 (1988), 596-610), with the standard
error of the fitted value.  That error holds the scatter of the cases about the surface, among it all that the
other inputs do; it does not hold the bias where the surface bends sharply within one neighbourhood.
Points outside the hull of the cases, or where the error is large, are NaN: a map is no extrapolation.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, cKDTree

NEIGHBOURS = 60
FEWEST = 12
MOST_ERROR = 0.05  # of the range of the metric; above it a point is left blank
TERMS = 6  # of a quadratic in two variables


@dataclass(frozen=True)
class SurfaceMap:
    """value[iy, ix] over x and y (both ascending); NaN outside the support.  error : standard error, or None.

    exact : the nodes are cases themselves.  cases_per_node : 1 for an exact grid; more when other inputs vary
    between cases of one node, and value is then their mean; 0 for scattered cases.
    """

    x: np.ndarray
    y: np.ndarray
    value: np.ndarray
    error: np.ndarray | None
    exact: bool
    cases_per_node: int
    neighbours: int
    n_used: int
    n_tried: int


def map_metric(x: np.ndarray, y: np.ndarray, z: np.ndarray, points: int = 101) -> SurfaceMap | None:
    """Map of z over x and y (float64[n_tried] each, NaN for a case without a number).

    None when there are too few cases, or when they lie on a line, for a map to mean anything.
    """
    x, y, z = (np.asarray(values, dtype=np.float64) for values in (x, y, z))
    grid = _full_grid(x, y, z)
    if grid is not None:
        return grid
    used = np.isfinite(x) & np.isfinite(y) & np.isfinite(z)
    if used.sum() < FEWEST or not _spread(x[used]) or not _spread(y[used]):
        return None
    return _smoothed(x[used], y[used], z[used], points, x.size)


def _spread(values: np.ndarray) -> bool:
    return float(np.ptp(values)) > 1e-12 * float(np.abs(values).max())


def _full_grid(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> SurfaceMap | None:
    """The map when every pair of levels was flown equally often, else None."""
    if x.size < 4 or not (np.isfinite(x).all() and np.isfinite(y).all()):
        return None
    x_levels, column = np.unique(x, return_inverse=True)
    y_levels, row = np.unique(y, return_inverse=True)
    nodes = x_levels.size * y_levels.size
    if min(x_levels.size, y_levels.size) < 2 or nodes > x.size:
        return None
    node = row * x_levels.size + column
    tried = np.bincount(node, minlength=nodes)
    if tried.min() != tried.max():
        return None
    used = np.isfinite(z)
    value, error = _node_means(node[used], z[used], nodes)
    shape = (y_levels.size, x_levels.size)
    each = int(tried[0])
    return SurfaceMap(
        x=x_levels,
        y=y_levels,
        value=value.reshape(shape),
        error=error.reshape(shape) if each > 1 else None,
        exact=each == 1,
        cases_per_node=each,
        neighbours=0,
        n_used=int(used.sum()),
        n_tried=int(x.size),
    )


def _node_means(node: np.ndarray, z: np.ndarray, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean of the cases at each node and its standard error; NaN without a case, or without a second one."""
    count = np.bincount(node, minlength=nodes).astype(np.float64)
    mean = np.full(nodes, np.nan)
    np.divide(np.bincount(node, z, minlength=nodes), count, out=mean, where=count > 0)
    square = np.bincount(node, (z - mean[node]) ** 2, minlength=nodes)
    variance = np.full(nodes, np.nan)
    np.divide(square, count * (count - 1.0), out=variance, where=count > 1)
    return mean, np.sqrt(variance)


def _smoothed(x: np.ndarray, y: np.ndarray, z: np.ndarray, points: int, tried: int) -> SurfaceMap | None:
    centre, scale = np.array([x.mean(), y.mean()]), np.array([np.ptp(x), np.ptp(y)])
    cloud = (np.column_stack([x, y]) - centre) / scale
    hull = _hull(cloud)
    if hull is None:
        return None
    x_axis, y_axis = np.linspace(x.min(), x.max(), points), np.linspace(y.min(), y.max(), points)
    at = (np.stack(np.meshgrid(x_axis, y_axis), axis=-1).reshape(-1, 2) - centre) / scale
    inside = (at @ hull[:, :2].T + hull[:, 2] <= 1e-9).all(axis=1)
    neighbours = min(NEIGHBOURS, x.size)
    value, error = (np.full(at.shape[0], np.nan) for _ in range(2))
    middle, spread = float(z.mean()), float(np.ptp(z)) or 1.0
    fit, deviation = _local_quadratic(cloud, (z - middle) / spread, at[inside], neighbours)
    blank = ~(deviation <= MOST_ERROR)
    fit[blank] = deviation[blank] = np.nan
    value[inside], error[inside] = middle + spread * fit, spread * deviation
    if not np.isfinite(value).any():
        return None
    shape = (points, points)
    return SurfaceMap(
        x_axis, y_axis, value.reshape(shape), error.reshape(shape), False, 0, neighbours, int(x.size), tried
    )


def _hull(cloud: np.ndarray) -> np.ndarray | None:
    """Half planes (a, b, c), a x + b y + c <= 0 inside; None for cases on a line."""
    centred = cloud - cloud.mean(axis=0)
    widths = np.sqrt(np.linalg.eigvalsh(centred.T @ centred))
    return ConvexHull(cloud).equations if widths[0] > 1e-6 * widths[1] else None


def _local_quadratic(
    cloud: np.ndarray, z: np.ndarray, at: np.ndarray, neighbours: int
) -> tuple[np.ndarray, np.ndarray]:
    """Fitted value and its standard error at each point of `at`; NaN where the neighbours fix no quadratic."""
    distance, near = cKDTree(cloud).query(at, k=neighbours)
    reach = 1.0001 * distance[:, -1:] + 1e-12
    weight = (1.0 - (distance / reach) ** 3) ** 3
    u, v = np.moveaxis((cloud[near] - at[:, None, :]) / reach[:, :, None], -1, 0)
    design = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=-1)
    weighted = design * weight[:, :, None]
    normal = np.einsum("mki,mkj->mij", weighted, design)
    fixed = np.linalg.cond(normal) < 1e10
    inverse = np.linalg.inv(np.where(fixed[:, None, None], normal, np.eye(TERMS)))
    # The first row of `smoother` turns the neighbours' values into the fitted value at the point itself.
    smoother = np.einsum("mij,mkj->mik", inverse, weighted)
    coefficients = np.einsum("mik,mk->mi", smoother, z[near])
    residual = z[near] - np.einsum("mki,mi->mk", design, coefficients)
    freedom = weight.sum(axis=1) - np.einsum("mik,mki->m", smoother, weighted)
    fixed &= freedom > 0.5
    variance = (weight * residual**2).sum(axis=1) / np.where(fixed, freedom, 1.0)
    error = np.sqrt(variance * (smoother[:, 0, :] ** 2).sum(axis=1))
    return np.where(fixed, coefficients[:, 0], np.nan), np.where(fixed, error, np.nan)
