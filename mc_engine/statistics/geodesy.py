"""Impact points in a plane about their centre, in metres east and north.

The plane is the azimuthal equidistant projection: every point is at its true geodesic distance and direction from the
centre, so the date line and the poles need no special treatment.  Lengths perpendicular to the direction to the centre
are too large by the factor (s/R) / sin(s/R) at the distance s: 0.1 % at 500 km, 1.7 % at 2000 km.

Geodesics on the ellipsoid: C. F. F. Karney, Journal of Geodesy 87 (2013), 43-55, by the library PROJ.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from pyproj import Geod

WGS84 = (6378137.0, 1.0 / 298.257223563)  # equatorial radius [m], flattening; NGA.STND.0036, table 3.1
# Equatorial radius [m] and flattening by the name of a planet; Mars, Moon and Venus as spheres, B. A. Archinal et al.,
# Celestial Mechanics and Dynamical Astronomy 130:22 (2018).
ELLIPSOIDS = {"earth": WGS84, "mars": (3396190.0, 0.0), "moon": (1737400.0, 0.0), "venus": (6051800.0, 0.0)}
MOST_ROUNDS = 20
CLOSE_ENOUGH = 1e-3  # m, of the middle


@dataclass(frozen=True)
class LocalPlane:
    """The plane about an origin: its latitude and longitude [deg], on an ellipsoid (radius [m], flattening)."""

    latitude: float
    longitude: float
    ellipsoid: tuple[float, float] = WGS84

    @property
    def _geod(self) -> "Geod":
        from pyproj import Geod

        return Geod(a=self.ellipsoid[0], f=self.ellipsoid[1])

    def points(self, latitude: np.ndarray, longitude: np.ndarray) -> np.ndarray:
        """float64[n, 2], metres to the east and to the north, of geodetic latitudes and longitudes [deg]."""
        latitude, longitude = (np.asarray(values, dtype=np.float64) for values in (latitude, longitude))
        here = np.full(latitude.shape, self.longitude), np.full(latitude.shape, self.latitude)
        azimuth, _, distance = self._geod.inv(*here, longitude, latitude)
        azimuth = np.radians(azimuth)
        return np.column_stack([distance * np.sin(azimuth), distance * np.cos(azimuth)])

    def places(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Latitudes and longitudes [deg, -180 to 180] of points float64[n, 2] of the plane."""
        azimuth = np.degrees(np.arctan2(points[:, 0], points[:, 1]))
        here = np.full(len(points), self.longitude), np.full(len(points), self.latitude)
        longitude, latitude, _ = self._geod.fwd(*here, azimuth, np.hypot(points[:, 0], points[:, 1]))
        return np.asarray(latitude), np.asarray(longitude)

    def stretch(self, distance: float) -> float:
        """Fraction by which lengths perpendicular to the direction to the origin are too large at a distance [m]."""
        angle = distance / self.ellipsoid[0]
        return float(1.0 / np.sinc(angle / np.pi) - 1.0)


def middle_plane(
    latitude: np.ndarray, longitude: np.ndarray, ellipsoid: tuple[float, float] = WGS84
) -> LocalPlane | None:
    """The plane about the mean of positions float64[n] [deg], the point whose offsets to them sum to zero.

    None without a position, or if they lie all around the planet, so that they have no mean.
    Starts at the mean of the normal vectors (K. Gade, Journal of Navigation 63 (2010), 395-417).
    """
    phi, theta = np.radians(latitude), np.radians(longitude)
    normals = np.column_stack([np.cos(phi) * np.cos(theta), np.cos(phi) * np.sin(theta), np.sin(phi)])
    if not len(normals):
        return None
    x, y, z = normals.mean(axis=0)
    if np.hypot(np.hypot(x, y), z) < 0.5:
        return None
    plane = LocalPlane(float(np.degrees(np.arctan2(z, np.hypot(x, y)))), float(np.degrees(np.arctan2(y, x))), ellipsoid)
    for _ in range(MOST_ROUNDS):
        offset = plane.points(latitude, longitude).mean(axis=0)
        (new_latitude,), (new_longitude,) = plane.places(offset[None, :])
        plane = LocalPlane(float(new_latitude), float(new_longitude), ellipsoid)
        if np.hypot(*offset) < CLOSE_ENOUGH:
            break
    return plane
