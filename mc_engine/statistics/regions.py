"""Regions of a plane that contain a stated fraction of points: covariance ellipses, and distribution-free regions.

A covariance ellipse contains its stated fraction of a normal distribution with known covariance.  Real scatter is
seldom normal, so the cases inside are counted.  `density_regions` assumes only independent draws.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy  # loads its packages when they are used

from mc_engine.statistics.order_statistics import quantile_ranks
from mc_engine.statistics.picked_cases import picked_rows

CONTENTS = (0.5, 0.9, 0.99)
FEWEST = 3  # points of an ellipse
THINNEST = 1e-9  # of the length of the scatter; what is thinner is a line
CELLS = 256  # of the density's grid, each way
WIDENED = (1, 2, 4)  # widths of the kernel, times Scott's, from the dense to the sparse parts of the scatter
FEWEST_SMOOTHED = 20  # points that a density is made of
_CORNERS = 180  # of the outline of an ellipse


@dataclass(frozen=True)
class Ellipse:
    """x with (x - centre) S^-1 (x - centre) <= scale^2, for the covariance S of n points, of which `inside` lie in it.

    semi_axes : the larger first;  direction : of the larger one [rad], from the first axis to the second.
    """

    content: float
    scale: float
    centre: tuple[float, float]
    semi_axes: tuple[float, float]
    direction: float
    inside: int
    n: int

    def outline(self) -> np.ndarray:
        """float64[n, 2]: once around, anticlockwise, the last point the first one."""
        angle = np.linspace(0.0, 2.0 * np.pi, _CORNERS + 1)
        along, across = self.semi_axes[0] * np.cos(angle), self.semi_axes[1] * np.sin(angle)
        c, s = np.cos(self.direction), np.sin(self.direction)
        points = np.column_stack([self.centre[0] + c * along - s * across, self.centre[1] + s * along + c * across])
        points[-1] = points[0]
        return points


def chi_square_scale(content: float) -> float:
    """k with P(chi^2 with 2 degrees of freedom <= k^2) = content: the square root of -2 ln(1 - content).

    k = 3 contains 98.89 % of a normal distribution in two dimensions, not 99.73 %, for which k = 3.439.
    """
    return float(np.sqrt(-2.0 * np.log1p(-content)))


def next_case_scale(content: float, n: int) -> float:
    """k of the ellipse of n normal points that contains the *next* one with probability `content`; n > 2.

    It is larger than `chi_square_scale`, as mean and covariance are estimates, and approaches it for large n.
    Hotelling's T^2: k^2 = 2 (n^2 - 1) / (n (n - 2)) times the quantile of F with 2 and n - 2 degrees of freedom
    (Chew, J. Am. Stat. Assoc. 61 (1966), 605-617), which for 2 degrees of freedom is a power.
    """
    return float(np.sqrt((n * n - 1.0) / n * np.expm1(-2.0 / (n - 2.0) * np.log1p(-content))))


def covariance_ellipses(
    points: np.ndarray, contents: tuple[float, ...] = CONTENTS, thinnest: float = 0.0
) -> tuple[Ellipse, ...]:
    """Ellipses of the stated contents about the mean of points float64[n, 2], all finite.

    Empty for fewer than three points, and for points on a line: a standard deviation across it of at most `thinnest`
    (in the unit of the points), or of at most a billionth of that along it.
    """
    frame = _principal_axes(points, thinnest)
    if frame is None:
        return ()
    centre, spread, axes = frame
    squares = np.sum(((points - centre) @ axes / spread) ** 2, axis=1)
    ellipses = []
    for content in contents:
        k = chi_square_scale(content)
        ellipses.append(
            Ellipse(
                content=content,
                scale=k,
                centre=(float(centre[0]), float(centre[1])),
                semi_axes=(float(k * spread[0]), float(k * spread[1])),
                direction=float(np.arctan2(axes[1, 0], axes[0, 0])),
                inside=int(np.count_nonzero(squares <= k * k)),
                n=len(points),
            )
        )
    return tuple(ellipses)


def _principal_axes(points: np.ndarray, thinnest: float) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Centre, standard deviations (larger first) and directions (columns); None for points that have no width."""
    if len(points) < FEWEST:
        return None
    centre = points.mean(axis=0)
    # Singular values of the offsets, not eigenvalues of their squares: those lose half the digits of a thin scatter.
    _, singular, directions = np.linalg.svd(points - centre, full_matrices=False)
    spread = singular / np.sqrt(len(points) - 1.0)
    if not spread[1] > max(thinnest, THINNEST * float(spread[0])):
        return None
    axes = directions.T
    return centre, spread, axes if axes[0, 0] >= 0.0 else -axes


@dataclass(frozen=True)
class Density:
    """A density on a grid in the frame of the points' principal axes, in which its standard deviations are 1."""

    centre: np.ndarray
    spread: np.ndarray
    axes: np.ndarray
    low: np.ndarray
    cell: np.ndarray
    counts: np.ndarray
    width: float

    @classmethod
    def of(cls, points: np.ndarray, thinnest: float) -> "Density | None":
        frame = _principal_axes(points, thinnest)
        if frame is None or len(points) < FEWEST_SMOOTHED:
            return None
        centre, spread, axes = frame
        scaled = (points - centre) @ axes / spread
        width = len(points) ** (-1.0 / 6.0)  # Scott's rule in two dimensions
        room = 4.0 * width * WIDENED[-1]
        low, high = scaled.min(axis=0) - room, scaled.max(axis=0) + room
        edges = [np.linspace(a, b, CELLS + 1) for a, b in zip(low, high, strict=True)]
        counts, _, _ = np.histogram2d(scaled[:, 0], scaled[:, 1], edges)
        return cls(centre, spread, axes, low, (high - low) / CELLS, counts, width)

    @cached_property
    def field(self) -> np.ndarray:
        """The density at the middles of the cells, up to a factor; 0 beyond four widths of the kernel.

        The kernel's width grows with the inverse square root of the density (Abramson, Ann. Stat. 10 (1982),
        1217-1223): with one width for all, the outline would run around single points at the sparse ends.
        """
        taken = self.counts > 0.0
        pilot = np.log2(self._smoothed(self.counts, 1.0)[taken])
        usual = np.average(pilot, weights=self.counts[taken])
        widening = np.zeros(self.counts.shape, dtype=np.int64)
        widening[taken] = np.rint(0.5 * (usual - pilot)).clip(0, len(WIDENED) - 1)
        parts = [self._smoothed(np.where(widening == k, self.counts, 0.0), times) for k, times in enumerate(WIDENED)]
        return np.sum(parts, axis=0)

    def _smoothed(self, counts: np.ndarray, times: float) -> np.ndarray:
        """The counts, each spread by the kernel of so many times the usual width."""
        return scipy.ndimage.gaussian_filter(counts, times * self.width / self.cell, mode="constant", truncate=4.0)

    def at(self, points: np.ndarray) -> np.ndarray:
        """The density at points float64[n, 2]; 0 outside the grid."""
        scaled = (points - self.centre) @ self.axes / self.spread
        places = (scaled - self.low) / self.cell - 0.5
        return scipy.ndimage.map_coordinates(self.field, places.T, order=1, mode="constant", cval=0.0)

    def outlines(self, level: float) -> tuple[np.ndarray, ...]:
        """The closed curves on which the density is at the level."""
        import contourpy

        x, y = (low + cell * (np.arange(CELLS) + 0.5) for low, cell in zip(self.low, self.cell, strict=True))
        lines = contourpy.contour_generator(x, y, self.field.T).lines(level)
        return tuple(self.centre + (np.asarray(line) * self.spread) @ self.axes.T for line in lines)


@dataclass(frozen=True)
class DensityRegion:
    """The region with a density at or above a level: contains at least `content` of the population with `confidence`.

    inside : of the n points.
    """

    content: float
    confidence: float
    density: Density
    level: float
    inside: int
    n: int

    @cached_property
    def outlines(self) -> tuple[np.ndarray, ...]:
        """Closed curves float64[k, 2], those of holes among them."""
        return self.density.outlines(self.level)


def density_regions(
    points: np.ndarray, contents: tuple[float, ...] = CONTENTS, confidence: float = 0.90, thinnest: float = 0.0
) -> tuple[DensityRegion, ...]:
    """Regions of any shape for points float64[n, 2], without contents for which the points are too few.

    A kernel density is made from half of the points, one of each two.  The other points are ranked by this density, and
    the level is the order statistic below which at most 1 - content of the population lies, with the confidence
    (Wilks).  This holds for any distribution, also if the density is poor: Lei, Robins & Wasserman, J. Am. Stat. Assoc.
    108 (2013), 278-287.
    """
    smoothing = np.zeros(len(points), dtype=bool)
    smoothing[picked_rows(len(points), (len(points) + 1) // 2)] = True
    smoothed = Density.of(points[smoothing], thinnest)
    if smoothed is None:
        return ()
    values = smoothed.at(points)
    ranked = np.sort(values[~smoothing])
    regions = []
    for content in contents:
        rank = quantile_ranks(ranked.size, 1.0 - content, 2.0 * confidence - 1.0)[0]
        if rank is None or ranked[rank - 1] <= 0.0:
            continue
        level = float(ranked[rank - 1])
        inside = int(np.count_nonzero(values >= level))
        regions.append(DensityRegion(content, confidence, smoothed, level, inside, len(points)))
    return tuple(regions)
