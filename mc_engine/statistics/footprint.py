"""The footprint of a campaign: impact points in a local plane, and the regions that contain them."""

from dataclasses import dataclass

import numpy as np

from mc_engine.statistics.geodesy import WGS84, LocalPlane, middle_plane
from mc_engine.statistics.regions import DensityRegion, Ellipse, covariance_ellipses, density_regions

NARROWEST = 0.01  # m, standard deviation: what is thinner is a line, or one place
FARTHEST = 5.0e6  # m from the middle; a plane shows no more of a planet in a useful way


@dataclass(frozen=True)
class Footprint:
    """points float64[n, 2]: n impact points, metres east and north of their middle;  reach : the largest distance [m].

    ellipses and regions are in the same plane; empty if the points have no width or are not a random sample.
    """

    plane: LocalPlane
    points: np.ndarray
    reach: float
    ellipses: tuple[Ellipse, ...]
    regions: tuple[DensityRegion, ...]

    @property
    def all_regions(self) -> list[Ellipse | DensityRegion]:
        """Ellipses, then distribution-free regions."""
        return [*self.ellipses, *self.regions]


def footprint(
    latitude: np.ndarray,
    longitude: np.ndarray,
    ellipsoid: tuple[float, float] = WGS84,
    random: bool = True,
    confidence: float = 0.90,
) -> Footprint | None:
    """The footprint of impact points float64[n], finite, geodetic degrees.

    random : the cases are a random sample, so that regions are meaningful.  confidence : of the content of the regions.
    None without a point, and for points too far apart for a plane.
    """
    plane = middle_plane(latitude, longitude, ellipsoid)
    if plane is None:
        return None
    points = plane.points(latitude, longitude)
    reach = float(np.hypot(points[:, 0], points[:, 1]).max())
    if reach > FARTHEST:
        return None
    ellipses = covariance_ellipses(points, thinnest=NARROWEST) if random else ()
    regions = density_regions(points, confidence=confidence, thinnest=NARROWEST) if random else ()
    return Footprint(plane, points, reach, ellipses, regions)
