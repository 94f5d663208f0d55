"""A metric over two inputs: exact from a full grid, smoothed from scattered cases.

Scattered cases: at each point of a plotting grid, a quadratic surface is fitted to the nearest cases, weighted by
distance (local regression, Cleveland & Devlin, J. Am. Stat. Assoc. 83 (1988), 596-610).  The number of neighbours is
the one with the smallest leave-one-out error: few where the metric follows the two inputs closely, many where other
inputs scatter it.

The error has two parts.  One is the standard error of the fitted value, from the scatter of the cases about the
surface, which includes the effect of all other inputs.  The other is the bias from curvature within the neighbourhood,
estimated by the difference to a cubic surface through the same cases (the correction of Calonico, Cattaneo & Farrell,
J. Am. Stat. Assoc. 113 (2018), 767-779, here added to the error and not to the value).  Points outside the hull of the
cases, in a gap between them, or with a large error are NaN, as a map does not extrapolate.  All points are NaN if the
two inputs explain less than `LEAST_EXPLAINED` of the metric's variance in cross-validation, or if one of them has fewer
than `FEWEST_LEVELS` levels.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby

import numpy as np
import scipy  # loads its packages when they are used

from mc_engine.statistics.moments import in_units, near_one
from mc_engine.statistics.picked_cases import picked_rows

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
FEWEST_LEVELS = 4  # of an input: a quadratic passes through any three values, whatever the metric is between them
TERMS = 6  # of a quadratic in two variables; a cubic has four more
POINTS_AT_ONCE = 256


@dataclass(frozen=True)
class SurfaceMap:
    """A metric over two inputs, on a grid: what `map_metric` returns.

    x : float64[nx], ascending
    y : float64[ny], ascending
    value : float64[ny, nx], NaN where the cases do not support a value
    error : float64[ny, nx], standard error of the value, or None if each node is one case
    exact : bool, the nodes are cases
    cases_per_node : int, 1 for an exact grid; larger if other inputs vary between the cases of a node, whose mean is
        the value; 0 for scattered cases
    neighbours : int, number of cases to which each point of a smoothed surface is fitted
    n_used : int, cases with numbers
    n_tried : int, all cases
    n_smoothed : int, number of the n_used cases from which the surface was made
    explained : float, fraction of the metric's variance that the surface predicts in cross-validation; 1 for an exact
        grid; NaN if the cases are too few for that, or have too few levels of an input

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

    Returns a SurfaceMap, or None if the cases are too few, or lie on a line.

    Raises nothing for numbers of any size.

    >>> x, y = np.meshgrid([0.0, 1.0, 2.0], [0.0, 1.0])
    >>> map_metric(x.ravel(), y.ravel(), (x + 10.0 * y).ravel()).value.tolist()
    [[0.0, 1.0, 2.0], [10.0, 11.0, 12.0]]
    """
    return map_metrics(x, y, [z], points)[0]


def map_metrics(
    x: np.ndarray, y: np.ndarray, metrics: Sequence[np.ndarray], points: int = 101
) -> list[SurfaceMap | None]:
    """The `map_metric` of each of several metrics over the same two inputs; common computations are made once."""
    (x, x_exponent), (y, y_exponent) = (near_one(np.asarray(values, dtype=np.float64)) for values in (x, y))
    scaled = [near_one(np.asarray(z, dtype=np.float64)) for z in metrics]
    surfaces = _surface_maps(x, y, [z for z, _ in scaled], points)
    return [
        surface
        and replace(
            surface,
            x=in_units(surface.x, x_exponent),
            y=in_units(surface.y, y_exponent),
            value=in_units(surface.value, exponent),
            error=None if surface.error is None else in_units(surface.error, exponent),
        )
        for surface, (_, exponent) in zip(surfaces, scaled, strict=True)
    ]


def _surface_maps(x: np.ndarray, y: np.ndarray, metrics: Sequence[np.ndarray], points: int) -> list[SurfaceMap | None]:
    surfaces = [_full_grid(x, y, z) for z in metrics]
    scattered = [k for k, surface in enumerate(surfaces) if surface is None]
    numbers = {k: np.isfinite(x) & np.isfinite(y) & np.isfinite(metrics[k]) for k in scattered}
    for _, same in groupby(sorted(scattered, key=lambda k: numbers[k].tobytes()), lambda k: numbers[k].tobytes()):
        together = list(same)
        used = numbers[together[0]]
        if used.sum() >= FEWEST and _spread(x[used]) and _spread(y[used]):
            smoothed = _smoothed(x[used], y[used], [metrics[k][used] for k in together], points, x.size)
            for k, surface in zip(together, smoothed, strict=True):
                surfaces[k] = surface
    return surfaces


def explained_share(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> float:
    """Fraction of the variance of z that a smooth surface over x and y predicts; NaN for too few cases or levels.

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


@dataclass(frozen=True)
class _Cloud:
    """Scattered cases in the plane of their two inputs, each centred and divided by its standard deviation.

    rows : int64[n], of all cases those that are smoothed.  places : float64[n, 2].  ends : float64[2, 2], the smallest
    and the largest number of each input.  hull : half planes (a, b, c), a x + b y + c <= 0 inside.
    """

    rows: np.ndarray
    places: np.ndarray
    ends: np.ndarray
    centre: np.ndarray
    scale: np.ndarray
    hull: np.ndarray
    tree: "scipy.spatial.cKDTree"

    @classmethod
    def of(cls, x: np.ndarray, y: np.ndarray) -> "_Cloud | None":
        """None for cases on a line."""
        ends = np.array([[x.min(), x.max()], [y.min(), y.max()]])
        rows = picked_rows(x.size, MOST_CASES)
        x, y = x[rows], y[rows]
        centre, scale = np.array([x.mean(), y.mean()]), np.array([x.std(), y.std()])
        places = (np.column_stack([x, y]) - centre) / scale
        hull = _hull(places)
        return None if hull is None else cls(rows, places, ends, centre, scale, hull, scipy.spatial.cKDTree(places))

    @property
    def has_levels(self) -> bool:
        """Whether both inputs have enough levels for a surface between them."""
        return all(np.unique(column.round(9)).size >= FEWEST_LEVELS for column in self.places.T)

    def axes(self, points: int) -> tuple[np.ndarray, np.ndarray]:
        """A grid over both inputs."""
        (left, right), (low, high) = self.ends
        return np.linspace(left, right, points), np.linspace(low, high, points)

    def nodes(self, points: int) -> tuple[np.ndarray, np.ndarray]:
        """Places float64[points^2, 2] of the nodes of the grid, and which of them lie inside the hull."""
        at = (np.stack(np.meshgrid(*self.axes(points)), axis=-1).reshape(-1, 2) - self.centre) / self.scale
        return at, (at @ self.hull[:, :2].T + self.hull[:, 2] <= 1e-9).all(axis=1)


def _hull(cloud: np.ndarray) -> np.ndarray | None:
    """Half planes (a, b, c), a x + b y + c <= 0 inside; None for cases on a line."""
    centred = cloud - cloud.mean(axis=0)
    widths = np.sqrt(np.linalg.eigvalsh(centred.T @ centred))
    return scipy.spatial.ConvexHull(cloud).equations if widths[0] > 1e-6 * widths[1] else None


def _smoothed(
    x: np.ndarray, y: np.ndarray, metrics: Sequence[np.ndarray], points: int, tried: int
) -> list[SurfaceMap | None]:
    """Maps of metrics that have a number in all of these cases."""
    cloud = _Cloud.of(x, y)
    if cloud is None:
        return [None for _ in metrics]
    middles, spreads = [float(z.mean()) for z in metrics], [float(np.ptp(z)) or 1.0 for z in metrics]
    shapes = [(z[cloud.rows] - middle) / spread for z, middle, spread in zip(metrics, middles, spreads, strict=True)]
    choices = _chosen_neighbours(cloud, shapes)
    drawn = [k for k, (_, share) in enumerate(choices) if not share < LEAST_EXPLAINED and cloud.has_levels]
    fitted: dict[int, tuple[np.ndarray, np.ndarray]] = {}
    for neighbours in {choices[k][0] for k in drawn}:
        together = [k for k in drawn if choices[k][0] == neighbours]
        surfaces = _surfaces(cloud, [shapes[k] for k in together], neighbours, points)
        fitted.update(zip(together, surfaces, strict=True))
    maps: list[SurfaceMap | None] = []
    for k, (neighbours, share) in enumerate(choices):
        fit, deviation = fitted.get(k, (np.full((2, 2), np.nan), np.full((2, 2), np.nan)))
        value, error, axes = middles[k] + spreads[k] * fit, spreads[k] * deviation, cloud.axes(len(fit))
        maps.append(SurfaceMap(*axes, value, error, False, 0, neighbours, x.size, tried, cloud.rows.size, share))
    return maps


def _chosen_neighbours(cloud: _Cloud, metrics: Sequence[np.ndarray]) -> list[tuple[int, float]]:
    """Of each metric (number of neighbours, fraction of its variance that it predicts), by leaving cases out one at a
    time.

    A smaller number is chosen where it predicts as well.
    """
    places, n = cloud.places, len(cloud.places)
    rows = picked_rows(n, LEFT_OUT)
    choices = [number for number in NEIGHBOURS if number < n]
    if len(choices) < 2:
        return [(min(NEIGHBOURS[0], n), np.nan) for _ in metrics]  # too few cases to leave any out
    distance, near = cloud.tree.query(places[rows], k=choices[-1] + 1)
    distance, near = distance[:, 1:], near[:, 1:]  # without the case itself
    scores: list[list[float]] = [[] for _ in metrics]
    for number in choices:
        open_ones = [k for k, so_far in enumerate(scores) if not (so_far and so_far[-1] > WORSE_FOR_GOOD * min(so_far))]
        if not open_ones:
            break
        fit = _Fit.of(places, places[rows], distance[:, :number], near[:, :number], cubic=False)
        for k in open_ones:
            misses = (fit.value(metrics[k]) - metrics[k][rows]) ** 2
            # Cases on a few levels of an input: near ones fix no surface before a second and third level are among them
            scores[k].append(float(np.mean(misses[fit.fixed])) if fit.fixed.mean() >= MOSTLY else np.inf)
    return [_choice(choices, scored, float(np.var(z[rows]))) for scored, z in zip(scores, metrics, strict=True)]


def _choice(choices: Sequence[int], scores: Sequence[float], variance: float) -> tuple[int, float]:
    """The fewest neighbours that are as good as any, and the fraction of the variance that the best predict."""
    least = min(scores)
    chosen = next(number for number, score in zip(choices, scores, strict=False) if score <= AS_GOOD * least)
    return chosen, 1.0 - least / max(variance, 1e-300) if least < np.inf else np.nan


def _surfaces(
    cloud: _Cloud, metrics: Sequence[np.ndarray], neighbours: int, points: int
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Fitted value and its error of each metric on the grid; NaN where the cases do not support a value."""
    points = points if neighbours < MANY_NEIGHBOURS else points // COARSER + 1
    at, inside = cloud.nodes(points)
    nodes = np.flatnonzero(inside)
    fitted = [(np.full(len(at), np.nan), np.full(len(at), np.nan)) for _ in metrics]
    for some in (nodes[first : first + POINTS_AT_ONCE] for first in range(0, nodes.size, POINTS_AT_ONCE)):
        distance, near = cloud.tree.query(at[some], k=neighbours)
        fit = _Fit.of(cloud.places, at[some], distance, near, cubic=True)
        usable = fit.fixed & (distance[:, 0] <= WIDEST_HOLE * distance[:, -1])
        for z, (value, error) in zip(metrics, fitted, strict=True):
            deviation = np.hypot(fit.standard_error(z), fit.cubic_step(z))
            sure = usable & (deviation <= MOST_ERROR)
            value[some] = np.where(sure, fit.value(z), np.nan)
            error[some] = np.where(sure, deviation, np.nan)
    return [(value.reshape(points, points), error.reshape(points, points)) for value, error in fitted]


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
        widths, vectors = np.linalg.eigh(quadratic)
        fixed = widths[:, 0] > 1e-10 * widths[:, -1]
        safe = np.where(fixed[:, None, None], quadratic, np.eye(TERMS))
        cubic_row = _value_row(*np.linalg.eigh(normal)) if cubic else None
        return cls(near, weight, design, safe, _value_row(widths, vectors), cubic_row, fixed)

    def value(self, z: np.ndarray) -> np.ndarray:
        """The quadratic at the points."""
        return np.einsum("mk,mk->m", self._smoother, z[self.near])

    def cubic_step(self, z: np.ndarray) -> np.ndarray:
        """From the quadratic to the cubic, at the points."""
        return np.einsum("mk,mk->m", self._cubic_smoother, z[self.near]) - self.value(z)

    @cached_property
    def _smoother(self) -> np.ndarray:
        """float64[m, k]: what turns the neighbours' values into the fitted one."""
        return self.weight * (self.design[:, :, :TERMS] @ self.row[:, :, None])[:, :, 0]

    @cached_property
    def _cubic_smoother(self) -> np.ndarray:
        assert self.cubic_row is not None
        return self.weight * (self.design @ self.cubic_row[:, :, None])[:, :, 0]

    @cached_property
    def _weighted(self) -> np.ndarray:
        """The transposed quadratic terms, weighted."""
        return np.swapaxes(self.design[:, :, :TERMS] * self.weight[:, :, None], 1, 2)

    @cached_property
    def _freedom(self) -> np.ndarray:
        """float64[m], degrees of freedom that the cases leave for a scatter about the quadratic."""
        hat = np.linalg.solve(self.normal, self._weighted @ np.swapaxes(self._weighted, 1, 2))
        return self.weight.sum(axis=1) - np.trace(hat, axis1=1, axis2=2)

    def standard_error(self, z: np.ndarray) -> np.ndarray:
        """Of the quadratic's value, from the scatter about it; NaN where the cases leave no freedom for a scatter."""
        right = self._weighted @ z[self.near][:, :, None]
        residual = z[self.near] - (self.design[:, :, :TERMS] @ np.linalg.solve(self.normal, right))[:, :, 0]
        enough = self._freedom > 0.5
        variance = (self.weight * residual**2).sum(axis=1) / np.where(enough, self._freedom, 1.0)
        error = np.sqrt(variance * (self._smoother**2).sum(axis=1))
        return np.where(enough, error, np.nan)


def _value_row(widths: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """First row of the inverses of normal matrices, from their eigenvalues and eigenvectors.

    Terms that the cases cannot distinguish are left out.
    """
    determined = widths > 1e-10 * widths[:, -1:]
    return np.einsum(
        "mij,mj->mi", vectors, np.where(determined, vectors[:, 0, :] / np.where(determined, widths, 1.0), 0.0)
    )
