"""The impact points of a run, and the reference points of distances."""

from dataclasses import dataclass, replace

import numpy as np

from mc_engine.model.figures import FootprintFigure
from mc_engine.statistics.footprint import Footprint, footprint
from mc_engine.statistics.geodesy import ELLIPSOIDS, LocalPlane
from reports.footprint.map_files import Mark
from reports.run.flown import Flown
from reports.text.numbers import count, limit_number, with_unit

TARGET = "target"
KILOMETRES = {"km": 1.0, "m": 1e-3}
SAME_DISTANCE = 0.005  # of the sum of a distance and the median one: how far a metric may be off that is this distance


@dataclass(frozen=True)
class Landing:
    """The data of one footprint.  rows : of the cases that landed;  above : number that ended above the limit.

    latitude, longitude : float64[n_held], degrees.  aim : the point from which distances are measured, if there is one.
    misses : the metrics that are the distance from the target, the one that deviates least from the geodesic first.  A
    model may compute this distance in another way; the report shows only the first of these metrics.
    """

    figure: FootprintFigure
    latitude: np.ndarray
    longitude: np.ndarray
    rows: np.ndarray
    above: int
    footprint: Footprint
    aim: Mark | None
    misses: tuple[str, ...] = ()

    @property
    def miss(self) -> str:
        """The metric that a report shows as the distance from the target; empty if there is none."""
        return self.misses[0] if self.misses else ""

    def geodesics(self, place: Mark) -> np.ndarray:
        """Kilometres of all cases from a point; NaN for those that did not land."""
        distances = np.full(self.latitude.size, np.nan)
        plane = LocalPlane(place.latitude, place.longitude, self.footprint.plane.ellipsoid)
        points = plane.points(self.latitude[self.rows], self.longitude[self.rows])
        distances[self.rows] = np.hypot(points[:, 0], points[:, 1]) / 1000.0
        return distances

    def distances(self, flown: Flown, place: Mark) -> np.ndarray:
        """As `geodesics`, but from the target by the metric that is this distance, if there is one."""
        if not self.miss or place.name != TARGET:
            return self.geodesics(place)
        distances = np.full(self.latitude.size, np.nan)
        distances[self.rows] = _kilometres(flown, self.miss)[self.rows]
        return distances

    @property
    def mean(self) -> Mark:
        return Mark("mean impact point", self.footprint.plane.latitude, self.footprint.plane.longitude)

    @property
    def centre(self) -> Mark:
        """The centre of the circular error probable: the target if there is one, else the mean impact point."""
        return self.aim if self.aim is not None and self.aim.name == TARGET else self.mean

    def at(self, place: Mark) -> np.ndarray:
        """float64[2], km to the east and to the north of the mean impact point."""
        point = self.footprint.plane.points(np.array([place.latitude]), np.array([place.longitude]))[0]
        return np.asarray(point / 1000.0)


def landing_of(flown: Flown, figure: FootprintFigure) -> Landing | str:
    """The footprint, or the sentence that says why there is none."""
    above_of = () if figure.ends_below is None else figure.ends_below[:1]
    absent = flown.absence(figure.latitude, figure.longitude, *above_of)
    if absent:
        return f"{figure.title}: not drawn; {absent}."
    planet = planet_of(flown, figure)
    if not planet:
        return f"{figure.title}: not drawn; the cases differ in the {flown.words(figure.planet)}."
    if planet not in ELLIPSOIDS:
        return f"{figure.title}: not drawn; the size of “{planet}” is not known, only that of {', '.join(ELLIPSOIDS)}."
    latitude, longitude = flown.values(figure.latitude), flown.values(figure.longitude)
    placed = _placed(flown, figure)
    rows = np.flatnonzero(placed & _down(flown, figure))
    above = int(placed.sum() - rows.size)
    if not rows.size:
        high = f"; {count(above)} ended above {height_limit(flown, figure)}" if above else ""
        return f"{figure.title}: not drawn; none of {count(flown.n_held)} cases has an impact point{high}."
    measured = footprint(latitude[rows], longitude[rows], ELLIPSOIDS[planet], flown.random, flown.stated.confidence)
    if measured is None:
        return f"{figure.title}: not drawn; the {count(rows.size)} impact points lie too far apart for one figure."
    if measured.reach < 1.0 and rows.size > 1:
        return f"{figure.title}: not drawn; all {count(rows.size)} impact points lie within one metre."
    landing = Landing(figure, latitude, longitude, rows, above, measured, _aim(flown, figure))
    return replace(landing, misses=_misses(flown, landing))


def _misses(flown: Flown, landing: Landing) -> tuple[str, ...]:
    """The metrics that agree with the geodesic from the target, that whose greatest deviation is smallest first.

    They agree in all cases that have a number, which at least half of those that landed must have.
    """
    if landing.centre.name != TARGET:
        return ()
    distances = landing.geodesics(landing.centre)[landing.rows]
    allowed = SAME_DISTANCE * (distances + np.median(distances))
    greatest = {}
    for fact in flown.with_role("metric"):
        if fact.unit in KILOMETRES:
            apart = np.abs(_kilometres(flown, fact.name)[landing.rows] - distances)
            known = ~np.isnan(apart)
            if 2 * known.sum() >= known.size and (apart <= allowed)[known].all():
                greatest[fact.name] = float(apart[known].max())
    return tuple(sorted(greatest, key=lambda name: greatest[name]))


def _kilometres(flown: Flown, metric: str) -> np.ndarray:
    return KILOMETRES[flown.unit(metric)] * flown.values(metric)


def landed(flown: Flown, figure: FootprintFigure) -> tuple[np.ndarray, np.ndarray]:
    """Latitude and longitude, float64[k] degrees, of the cases that landed."""
    rows = _placed(flown, figure) & _down(flown, figure)
    return flown.values(figure.latitude)[rows], flown.values(figure.longitude)[rows]


def _placed(flown: Flown, figure: FootprintFigure) -> np.ndarray:
    latitude, longitude = flown.values(figure.latitude), flown.values(figure.longitude)
    return np.isfinite(latitude) & np.isfinite(longitude) & (np.abs(latitude) <= 90.0)


def _down(flown: Flown, figure: FootprintFigure) -> np.ndarray:
    if figure.ends_below is None:
        return np.ones(flown.n_held, dtype=bool)
    column, limit = figure.ends_below
    with np.errstate(invalid="ignore"):
        return np.asarray(flown.values(column) <= limit)


def height_limit(flown: Flown, figure: FootprintFigure) -> str:
    column, limit = figure.ends_below or ("", 0.0)
    return with_unit(limit_number(limit), flown.unit(column))


def planet_of(flown: Flown, figure: FootprintFigure) -> str:
    """The planet on which the cases land, in small letters; empty if they land on several."""
    if figure.planet in flown.cases.columns:
        planets = {str(planet).lower() for planet in flown.cases[figure.planet]}
        return planets.pop() if len(planets) == 1 else ""
    settings = {record["name"]: record.get("value") for record in flown.manifest.get("settings", [])}
    return str(settings.get(figure.planet, "earth")).lower()


def on_earth(flown: Flown, figure: FootprintFigure) -> bool:
    return planet_of(flown, figure) == "earth"


def _aim(flown: Flown, figure: FootprintFigure) -> Mark | None:
    """The target if there is one, else the end of the nominal case."""
    if figure.target is not None:
        latitude, longitude = (_shared_value(flown, name) for name in figure.target)
        if latitude is not None and longitude is not None:
            return Mark(TARGET, latitude, longitude)
    latitude, longitude = flown.nominal_value(figure.latitude), flown.nominal_value(figure.longitude)
    return None if latitude is None or longitude is None else Mark("end of the nominal case", latitude, longitude)


def _shared_value(flown: Flown, name: str) -> float | None:
    """A parameter of the run, or the nominal case's number in a column."""
    values = {record["name"]: record.get("value") for record in flown.manifest.get("parameters", [])}
    value = values.get(name)
    return float(value) if isinstance(value, int | float) else flown.nominal_value(name)
