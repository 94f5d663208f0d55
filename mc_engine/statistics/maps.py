"""A metric over two inputs: exact from a full grid, smoothed from scattered cases.

Scattered cases: at each point of a plotting grid, a quadratic surface is fitted to the nearest cases, weighted by
distance (local regression, Cleveland & Devlin, J. Am. Stat. Assoc. 83 (1988), 596-610).  The number of neighbours is
the one with the smallest leave-one-out error: few where the metric follows the two inputs closely, many where other
inputs scatter it.

The error has two parts.  One is the standard error of the fitted value, from the scatter of the cases about the
surface, which includes the effect of all other inputs.  The other is the bias of a surface that bends within one
neighbourhood, estimated by the step to a cubic surface through the same cases (the correction of Calonico, Cattaneo &
Farrell, J. Am. Stat. Assoc. 113 (2018), 767-779, here added to the error and not to the value).  Points outside the
hull of the cases, in a hole between them, or with a large error are NaN: a map does not extrapolate.  Where the two
inputs explain less than `LEAST_EXPLAINED` of the metric's variance in cross-validation, no point has a value.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy  # loads its packages when they are used

from mc_engine.statistics.moments import in_units, near_one

FEWEST = 24
NEIGHBOURS = (24, 36, 54, 80, 120, 180, 270, 400, 600, 900)  # to choose from
MANY_NEIGHBOURS = 300  # from here on the surface is smooth at the scale of a coarser picture grid
COARSER = 2
LEFT_OUT = 400  # cases, one at a time, on which the number of neighbours is chosen
MOSTLY = 0.95  # of them must have a surface through their neighbours
WORSE_FOR_GOOD = 10.0  # times the smallest squared error: the surface bends too little, with more neighbours even less
AS_GOOD = 1.01  # of the smallest squared error: the fewest neighbours that reach it bend the surface least
WIDEST_HOLE = 0.6  # of the reach of the neighbourhood: where the nearest case is farther away, there is a hole
MOST_CASES = 50_000  # smoothed; of more, so many are picked evenly
LEAST_EXPLAINED = 0.2  # share of the variance of the metric
MOST_ERROR = 0.05  # of the range of the metric; above it a point is left blank
TERMS = 6  # of a quadratic in two variables; a cubic has four more
POINTS_AT_ONCE = 256


@dataclass(frozen=True)
class SurfaceMap:
    """A metric over two inputs, on a grid: what `map_metric` returns.

    x : float64[nx], ascending
    y : float64[ny], ascending
    value : float64[ny, nx], NaN where the cases support no value
    error : float64[ny, nx], standard error of the value, or None where each node is one case
    exact : bool, the nodes are cases themselves
    cases_per_node : int, 1 for an exact grid; more where other inputs vary between the cases of a node, and value is
        their mean; 0 for scattered cases
    neighbours : int, cases that each point of a smoothed surface is fitted to
    n_used : int, cases with numbers
    n_tried : int, all cases
    n_smoothed : int, of the n_used cases, those that the surface was made of
    explained : float, fraction of the metric's variance that the surface predicts in cross-validation; 1 for an exact
        grid

    >>> map_metric(np.tile([0.0, 1.0], 2), np.repeat([0.0, 1.0], 2), np.arange(4.0)).exact
    True
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
    n_smoothed: int = 0
    explained: float = 1.0


def map_metric(x: np.ndarray, y: np.ndarray, z: np.ndarray, points: int = 101) -> SurfaceMap | None:
    """Map of a metric over two inputs: exact from a full grid, smoothed by local regression from scattered cases.

    x : float64[n_tried], NaN for a case without a number
    y : float64[n_tried]
    z : float64[n_tried], the metric
    points : int, grid points of a smoothed map along each axis

    Returns a SurfaceMap, or None where the cases are too few, or lie on a line.

    Raises nothing for numbers of any size.

    >>> x, y = np.meshgrid([0.0, 1.0, 2.0], [0.0, 1.0])
    >>> map_metric(x.ravel(), y.ravel(), (x + 10.0 * y).ravel()).value.tolist()
    [[0.0, 1.0, 2.0], [10.0, 11.0, 12.0]]
    """
    pairs = [near_one(np.asarray(values, dtype=np.float64)) for values in (x, y, z)]
    surface = _surface_map(pairs[0][0], pairs[1][0], pairs[2][0], points)
    if surface is None:
        return None
    x, y, value = (
        in_units(*scaled) for scaled in zip((surface.x, surface.y, surface.value), (e for _, e in pairs), strict=True)
    )
    return replace(
        surface, x=x, y=y, value=value, error=None if surface.error is None else in_units(surface.error, pairs[2][1])
    )


def _surface_map(x: np.ndarray, y: np.ndarray, z: np.ndarray, points: int) -> SurfaceMap | None:
    grid = _full_grid(x, y, z)
    if grid is not None:
        return grid
    used = np.isfinite(x) & np.isfinite(y) & np.isfinite(z)
    if used.sum() < FEWEST or not _spread(x[used]) or not _spread(y[used]):
        return None
    return _smoothed(x[used], y[used], z[used], points, x.size)


def explained_share(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> float:
    """Fraction of the variance of z that a smooth surface over x and y predicts; NaN for too few cases.

    By cross-validation, with cases left out one at a time.
    """
    surface = map_metric(x, y, z, points=2)
    return np.nan if surface is None else surface.explained


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
    within = np.nansum((z[used] - value[node[used]]) ** 2) / max(int(used.sum()) - nodes, 1)
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
        explained=1.0 - within / variance if (variance := float(np.var(z[used]))) > 0.0 and each > 1 else 1.0,
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
    n_used, middle, spread = x.size, float(z.mean()), float(np.ptp(z)) or 1.0
    low, high = (x.min(), y.min()), (x.max(), y.max())
    rows = np.unique(np.linspace(0, n_used - 1, min(n_used, MOST_CASES)).astype(np.int64))
    x, y, z = x[rows], y[rows], (z[rows] - middle) / spread
    centre, scale = np.array([x.mean(), y.mean()]), np.array([x.std(), y.std()])
    cloud = (np.column_stack([x, y]) - centre) / scale
    hull = _hull(cloud)
    if hull is None:
        return None
    tree = scipy.spatial.cKDTree(cloud)
    neighbours, explained = _chosen_neighbours(tree, cloud, z)
    if explained < LEAST_EXPLAINED:
        x_axis, y_axis = (np.array(ends) for ends in zip(low, high, strict=True))
        blank = np.full((2, 2), np.nan)
        return SurfaceMap(x_axis, y_axis, blank, blank, False, 0, neighbours, n_used, tried, rows.size, explained)
    points = points if neighbours < MANY_NEIGHBOURS else points // COARSER + 1
    x_axis, y_axis = (np.linspace(*ends, points) for ends in zip(low, high, strict=True))
    at = (np.stack(np.meshgrid(x_axis, y_axis), axis=-1).reshape(-1, 2) - centre) / scale
    inside = (at @ hull[:, :2].T + hull[:, 2] <= 1e-9).all(axis=1)
    fit, deviation = _surface(tree, cloud, z, at[inside], neighbours)
    blank = ~(deviation <= MOST_ERROR)
    fit[blank] = deviation[blank] = np.nan
    value, error = np.full(at.shape[0], np.nan), np.full(at.shape[0], np.nan)
    value[inside], error[inside] = middle + spread * fit, spread * deviation
    shape = (points, points)
    value, error = value.reshape(shape), error.reshape(shape)
    return SurfaceMap(x_axis, y_axis, value, error, False, 0, neighbours, n_used, tried, rows.size, explained)


def _hull(cloud: np.ndarray) -> np.ndarray | None:
    """Half planes (a, b, c), a x + b y + c <= 0 inside; None for cases on a line."""
    centred = cloud - cloud.mean(axis=0)
    widths = np.sqrt(np.linalg.eigvalsh(centred.T @ centred))
    return scipy.spatial.ConvexHull(cloud).equations if widths[0] > 1e-6 * widths[1] else None


def _chosen_neighbours(tree: "scipy.spatial.cKDTree", cloud: np.ndarray, z: np.ndarray) -> tuple[int, float]:
    """(number of neighbours, fraction of the variance of z that it predicts), by leaving cases out one at a time.

    A smaller number is chosen where it predicts as well.
    """
    rows = np.unique(np.linspace(0, len(cloud) - 1, min(len(cloud), LEFT_OUT)).astype(np.int64))
    choices = [number for number in NEIGHBOURS if number < len(cloud)]
    if len(choices) < 2:
        return min(NEIGHBOURS[0], len(cloud)), 1.0  # too few cases to leave any out
    distance, near = tree.query(cloud[rows], k=choices[-1] + 1)
    distance, near = distance[:, 1:], near[:, 1:]  # without the case itself
    scores = []
    for number in choices:
        fit = _Fit.of(cloud, cloud[rows], distance[:, :number], near[:, :number], cubic=False)
        misses = (fit.value(z) - z[rows]) ** 2
        # Cases on a few levels of an input: near ones fix no surface before a second and third level are among them.
        scores.append(float(np.mean(misses[fit.fixed])) if fit.fixed.mean() >= MOSTLY else np.inf)
        if scores[-1] > WORSE_FOR_GOOD * min(scores):
            break
    least = min(scores)
    chosen = next(number for number, score in zip(choices, scores, strict=False) if score <= AS_GOOD * least)
    return chosen, 1.0 - least / max(float(np.var(z[rows])), 1e-300) if least < np.inf else 1.0


def _surface(
    tree: "scipy.spatial.cKDTree", cloud: np.ndarray, z: np.ndarray, at: np.ndarray, neighbours: int
) -> tuple[np.ndarray, np.ndarray]:
    """Fitted value and its error at each point of `at`; NaN where the neighbours do not support a surface."""
    value, error = np.full(len(at), np.nan), np.full(len(at), np.nan)
    for first in range(0, len(at), POINTS_AT_ONCE):
        some = slice(first, first + POINTS_AT_ONCE)
        distance, near = tree.query(at[some], k=neighbours)
        fit = _Fit.of(cloud, at[some], distance, near, cubic=True)
        usable = fit.fixed & (distance[:, 0] <= WIDEST_HOLE * distance[:, -1])
        value[some] = np.where(usable, fit.value(z), np.nan)
        error[some] = np.where(usable, np.hypot(fit.standard_error(z), fit.cubic_step(z)), np.nan)
    return value, error


@dataclass(frozen=True)
class _Fit:
    """Weighted quadratics, and cubics, about m points, each through k neighbours.  Last axis of `design`: the terms.

    rows : float64[m, t], the row of the inverse normal matrix that gives the value at the point itself.
    """

    near: np.ndarray
    weight: np.ndarray
    design: np.ndarray
    normal: np.ndarray
    row: np.ndarray
    cubic_row: np.ndarray | None
    fixed: np.ndarray

    @classmethod
    def of(cls, cloud: np.ndarray, at: np.ndarray, distance: np.ndarray, near: np.ndarray, cubic: bool) -> "_Fit":
        reach = 1.0001 * distance[:, -1:] + 1e-12
        away = distance / reach
        left = 1.0 - away * away * away
        weight = left * left * left
        u, v = ((cloud[:, axis][near] - at[:, axis, None]) / reach for axis in (0, 1))
        terms = [np.ones_like(u), u, v, u * u, u * v, v * v]
        terms += [u * u * u, u * u * v, u * v * v, v * v * v] if cubic else []
        design = np.stack(terms, axis=-1)
        normal = np.swapaxes(design * weight[:, :, None], 1, 2) @ design
        quadratic = normal[:, :TERMS, :TERMS]
        widths = np.linalg.eigvalsh(quadratic)
        fixed = widths[:, 0] > 1e-10 * widths[:, -1]
        safe = np.where(fixed[:, None, None], quadratic, np.eye(TERMS))
        return cls(near, weight, design, safe, _value_row(safe), _value_row(normal) if cubic else None, fixed)

    def value(self, z: np.ndarray) -> np.ndarray:
        """The quadratic at the points."""
        return np.einsum("mk,mk->m", self._smoother(self.row), z[self.near])

    def cubic_step(self, z: np.ndarray) -> np.ndarray:
        """From the quadratic to the cubic, at the points."""
        assert self.cubic_row is not None
        return np.einsum("mk,mk->m", self._smoother(self.cubic_row), z[self.near]) - self.value(z)

    def _smoother(self, row: np.ndarray) -> np.ndarray:
        """float64[m, k]: what turns the neighbours' values into the fitted one."""
        return self.weight * (self.design[:, :, : row.shape[1]] @ row[:, :, None])[:, :, 0]

    def standard_error(self, z: np.ndarray) -> np.ndarray:
        """Of the quadratic's value, from the scatter about it; NaN where the cases leave no freedom for a scatter."""
        design = self.design[:, :, :TERMS]
        weighted = design * self.weight[:, :, None]
        right = np.swapaxes(weighted, 1, 2) @ z[self.near][:, :, None]
        residual = z[self.near] - (design @ np.linalg.solve(self.normal, right))[:, :, 0]
        hat = np.linalg.solve(self.normal, np.swapaxes(weighted, 1, 2) @ weighted)
        freedom = self.weight.sum(axis=1) - np.trace(hat, axis1=1, axis2=2)
        enough = freedom > 0.5
        variance = (self.weight * residual**2).sum(axis=1) / np.where(enough, freedom, 1.0)
        error = np.sqrt(variance * (self._smoother(self.row) ** 2).sum(axis=1))
        return np.where(enough, error, np.nan)


def _value_row(normal: np.ndarray) -> np.ndarray:
    """First row of the inverses of normal matrices; terms that the cases do not tell apart are left out."""
    widths, vectors = np.linalg.eigh(normal)
    determined = widths > 1e-10 * widths[:, -1:]
    return np.einsum(
        "mij,mj->mi", vectors, np.where(determined, vectors[:, 0, :] / np.where(determined, widths, 1.0), 0.0)
    )
