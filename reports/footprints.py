"""Where the flights end: the footprint's figure, its tables, and the files for maps."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from mc_engine.figures import FootprintFigure
from mc_engine.statistics import clopper_pearson, summarize
from mc_engine.statistics.footprint import Footprint, footprint
from mc_engine.statistics.geodesy import ELLIPSOIDS, WGS84, LocalPlane
from mc_engine.statistics.regions import DensityRegion, Ellipse, next_case_scale
from reports.document import Attachment, Cell, Column, FigureBlock, Table
from reports.drawings import thinned_rows
from reports.figures import FootprintCurve, FootprintDrawing
from reports.flown import CONFIDENCE, Flown
from reports.map_files import Mark, Outline, Places, geojson, kml
from reports.numbers import count, counted, interval, number, percent, with_unit

DRAWN_REGION = 0.9  # content of the one region in the figure; more would hide the ellipses
DISTANCES = (0.5, 0.9, 0.99)
CONFIDENCE_INSIDE = 0.95
LONG = 4.0
PLACES_IN_A_FILE = 20_000


@dataclass(frozen=True)
class _Landing:
    """What is known of one footprint.  rows : of the cases that came down;  above : that ended above the limit.

    latitude, longitude : float64[n_tried], degrees.
    """

    figure: FootprintFigure
    latitude: np.ndarray
    longitude: np.ndarray
    rows: np.ndarray
    above: int
    found: Footprint
    aim: Mark | None

    @property
    def distances(self) -> np.ndarray:
        """Kilometres of all cases from the aim; NaN for those that did not come down."""
        distances = np.full(self.latitude.size, np.nan)
        if self.aim is not None:
            plane = LocalPlane(self.aim.latitude, self.aim.longitude, self.found.plane.ellipsoid)
            points = plane.points(self.latitude[self.rows], self.longitude[self.rows])
            distances[self.rows] = np.hypot(points[:, 0], points[:, 1]) / 1000.0
        return distances


@dataclass(frozen=True)
class FootprintContents:
    """Blocks of the report, sentences among them, and the files beside it."""

    blocks: list[FigureBlock | Table | str] = field(default_factory=list)
    files: list[Attachment] = field(default_factory=list)


def footprint_contents(flown: Flown) -> FootprintContents:
    """All footprints that the model asks for; a sentence in place of one that cannot be drawn."""
    contents = FootprintContents()
    for place, figure in enumerate(one for one in flown.figures if isinstance(one, FootprintFigure)):
        landing = _landing(flown, figure)
        if isinstance(landing, str):
            contents.blocks.append(landing)
            continue
        stem = "footprint" if place == 0 else f"footprint-{place + 1}"
        contents.blocks.extend(_blocks(flown, landing, stem))
        if _on_earth(flown, figure):
            places = _places(flown, landing)
            contents.files.append(Attachment(f"{stem}.kml", kml(places)))
            contents.files.append(Attachment(f"{stem}.geojson", geojson(places)))
    return contents


# ---- the data


def _landing(flown: Flown, figure: FootprintFigure) -> _Landing | str:
    """The footprint, or the sentence that says why there is none."""
    above_of = () if figure.ends_below is None else figure.ends_below[:1]
    absent = flown.absence(figure.latitude, figure.longitude, *above_of)
    if absent:
        return f"{figure.title}: not drawn; {absent}."
    latitude, longitude = flown.values(figure.latitude), flown.values(figure.longitude)
    placed = _placed(flown, figure)
    rows = np.flatnonzero(placed & _down(flown, figure))
    above = int(placed.sum() - rows.size)
    if not rows.size:
        high = f"; {count(above)} ended above {_limit(flown, figure)}" if above else ""
        return f"{figure.title}: not drawn; none of {count(flown.n_tried)} cases has an impact point{high}."
    ellipsoid = ELLIPSOIDS.get(planet_of(flown, figure), WGS84)
    found = footprint(latitude[rows], longitude[rows], ellipsoid, flown.random)
    if found is None:
        return f"{figure.title}: not drawn; the {count(rows.size)} impact points lie too far apart for one figure."
    if found.reach < 1.0 and rows.size > 1:
        return f"{figure.title}: not drawn; all {count(rows.size)} impact points lie within one metre."
    return _Landing(figure, latitude, longitude, rows, above, found, _aim(flown, figure))


def landed(flown: Flown, figure: FootprintFigure) -> tuple[np.ndarray, np.ndarray]:
    """Latitude and longitude, float64[k] degrees, of the cases that came down."""
    rows = _placed(flown, figure) & _down(flown, figure)
    return flown.values(figure.latitude)[rows], flown.values(figure.longitude)[rows]


def _placed(flown: Flown, figure: FootprintFigure) -> np.ndarray:
    latitude, longitude = flown.values(figure.latitude), flown.values(figure.longitude)
    return np.isfinite(latitude) & np.isfinite(longitude) & (np.abs(latitude) <= 90.0)


def _down(flown: Flown, figure: FootprintFigure) -> np.ndarray:
    if figure.ends_below is None:
        return np.ones(flown.n_tried, dtype=bool)
    column, limit = figure.ends_below
    with np.errstate(invalid="ignore"):
        return np.asarray(flown.values(column) <= limit)


def _limit(flown: Flown, figure: FootprintFigure) -> str:
    column, limit = figure.ends_below or ("", 0.0)
    return with_unit(number(limit), flown.unit(column))


def planet_of(flown: Flown, figure: FootprintFigure) -> str:
    settings = {record["name"]: record.get("value") for record in flown.manifest.get("settings", [])}
    return str(settings.get(figure.planet, "earth")).lower()


def _on_earth(flown: Flown, figure: FootprintFigure) -> bool:
    return planet_of(flown, figure) not in ELLIPSOIDS or planet_of(flown, figure) == "earth"


def _aim(flown: Flown, figure: FootprintFigure) -> Mark | None:
    """The target if there is one, else the end of the nominal case."""
    if figure.target is not None:
        latitude, longitude = (_shared_value(flown, name) for name in figure.target)
        if latitude is not None and longitude is not None:
            return Mark("target", latitude, longitude)
    latitude, longitude = flown.nominal_value(figure.latitude), flown.nominal_value(figure.longitude)
    return None if latitude is None or longitude is None else Mark("end of the nominal case", latitude, longitude)


def _shared_value(flown: Flown, name: str) -> float | None:
    """A parameter of the run, or the nominal case's number in a column."""
    values = {record["name"]: record.get("value") for record in flown.manifest.get("parameters", [])}
    value = values.get(name)
    return float(value) if isinstance(value, int | float) else flown.nominal_value(name)


# ---- figure and tables


def _blocks(flown: Flown, landing: _Landing, stem: str) -> Iterator[FigureBlock | Table | str]:
    yield FigureBlock(_caption(flown, landing), _drawing(flown, landing), "wide")
    if landing.found.ellipses:
        yield _region_table(flown, landing)
    else:
        yield _no_ellipses(flown, landing)
    distances = _distance_table(flown, landing)
    if distances is not None:
        yield distances
    if _on_earth(flown, landing.figure):
        shown = min(landing.rows.size, PLACES_IN_A_FILE)
        which = "all" if shown == landing.rows.size else f"{count(shown)} of"
        yield (
            f"{stem}.kml and {stem}.geojson beside this report hold {which} "
            f"{counted(landing.rows.size, 'impact point')} with case number and "
            "status, and the outlines of all regions, for a globe or a map."
        )


def _caption(flown: Flown, landing: _Landing) -> str:
    plane = landing.found.plane
    above = f" {count(landing.above)} cases ended above {_limit(flown, landing.figure)} and are left out." * bool(
        landing.above
    )
    return f"{landing.figure.title}. Mean impact point {_place_words(plane.latitude, plane.longitude)}.{above}"


def _place_words(latitude: float, longitude: float) -> str:
    north, east = ("N" if latitude >= 0.0 else "S"), ("E" if longitude >= 0.0 else "W")
    return f"{abs(latitude):.4f}° {north}, {abs(longitude):.4f}° {east}"


def _drawing(flown: Flown, landing: _Landing) -> FootprintDrawing:
    points = landing.found.points
    ends = [int(pick(points[:, k])) for k in (0, 1) for pick in (np.argmin, np.argmax)]
    shown = thinned_rows(np.arange(landing.rows.size), np.array(ends))
    rows = landing.rows[shown]
    names = tuple(
        f"case {case}: {_place_words(north, east)}"
        for case, north, east in zip(
            flown.case_ids[rows], landing.latitude[rows], _half_turn(landing.longitude[rows]), strict=True
        )
    )
    aim = landing.aim
    here = landing.found.plane.points(np.array([aim.latitude]), np.array([aim.longitude]))[0] / 1e3 if aim else None
    return FootprintDrawing(
        points=points[shown] / 1000.0,
        names=names,
        curves=tuple(_curves(landing.found)),
        n_used=int(landing.rows.size),
        n_tried=flown.n_tried,
        aim=(aim.name, (float(here[0]), float(here[1]))) if aim is not None and here is not None else None,
        long_axis=_long_axis(landing.found),
        case_ids=flown.case_ids[rows],
        everywhere=points / 1000.0,
        every_case=flown.case_ids[landing.rows],
    )


def _long_axis(found: Footprint) -> float | None:
    """Direction of a cloud at least LONG times as long as wide, else None."""
    if not found.ellipses or found.ellipses[0].semi_axes[0] < LONG * found.ellipses[0].semi_axes[1]:
        return None
    return found.ellipses[0].direction


def _half_turn(longitude: np.ndarray) -> np.ndarray:
    """The longitudes in [-180, 180) degrees."""
    return (longitude + 180.0) % 360.0 - 180.0


def _curves(found: Footprint) -> Iterator[FootprintCurve]:
    for ellipse in found.ellipses:
        text = f"{_name(ellipse)}, holds {percent(ellipse.inside / ellipse.n, 1)} of the cases"
        yield FootprintCurve("ellipse", text, (ellipse.outline() / 1000.0,))
    for region in found.regions:
        if region.content == DRAWN_REGION:
            yield FootprintCurve(
                "region", f"{_name(region)}, distribution-free", tuple(o / 1000.0 for o in region.outlines)
            )


def _name(region: Ellipse | DensityRegion) -> str:
    content = percent(region.content)
    return f"{content} ellipse" if isinstance(region, Ellipse) else f"at least {content} region"


def _region_table(flown: Flown, landing: _Landing) -> Table:
    """Contents stated and shares really inside."""
    found = landing.found
    columns = (
        Column("Region", "text", 2.0),
        Column("Stated content", "number", 1.7),
        Column("Cases inside", "number", 1.4),
        Column("Fraction inside", "number", 1.7),
        Column("Semi-axes [km]", "number", 1.6),
        Column("Long axis [° from north]", "number", 1.2),
    )
    rows = tuple(_region_row(region) for region in found.all_regions)
    n = found.ellipses[0].n
    bigger = f"; the next case lies with 99 % in one of k = {next_case_scale(0.99, n):.3f}" if n > 3 else ""
    note = (
        "Ellipses: covariance of the cases in the plane about the mean impact point, scaled by k = √(−2 ln(1 − P)), "
        f"χ² with two degrees of freedom: P of a normal distribution of known covariance{bigger}. Fraction inside: "
        f"counted, with its {percent(CONFIDENCE_INSIDE)} Clopper–Pearson interval; where that interval excludes the "
        "stated content, the distribution is not normal. Distribution-free regions assume nothing but independent "
        "draws: a level of a smoothed density of every second case, set by the ranks of the others. Lengths are "
        f"geodesics through the mean impact point, the farthest case {number(found.reach / 1000.0, 3)} km from it; "
        f"across that direction the plane stretches them by at most {percent(found.plane.stretch(found.reach), 3)}."
    )
    return Table(
        f"Regions of the {count(landing.rows.size)} of {count(flown.n_tried)} cases that came down", columns, rows, note
    )


def _region_row(region: Ellipse | DensityRegion) -> tuple[Cell, ...]:
    share = region.inside / region.n
    low, high = clopper_pearson(region.inside, region.n, CONFIDENCE_INSIDE)
    inside = (
        Cell(f"{count(region.inside)} / {count(region.n)}", region.inside),
        Cell(percent(share), share, f"[{percent(low)}, {percent(high)}]"),
    )
    if isinstance(region, DensityRegion):
        stated = Cell(percent(region.content), region.content, f"with {percent(region.confidence)} confidence")
        return (
            Cell("distribution-free region", small=_parts(len(region.outlines))),
            stated,
            *inside,
            Cell("–"),
            Cell("–"),
        )
    a, b = (axis / 1000.0 for axis in region.semi_axes)
    north = float(np.degrees(0.5 * np.pi - region.direction)) % 180.0
    return (
        Cell("covariance ellipse"),
        Cell(percent(region.content), region.content, f"k = {region.scale:.3f}"),
        *inside,
        Cell(f"{number(a, 4)} × {number(b, 4)}", a),
        Cell(f"{north:.1f}", north),
    )


def _parts(outlines: int) -> str:
    return "one outline" if outlines == 1 else f"{outlines} outlines"


def _no_ellipses(flown: Flown, landing: _Landing) -> str:
    if not flown.random:
        return f"No regions: the cases of the design “{flown.design}” are chosen, not drawn."
    if landing.rows.size < 3:
        return f"No regions: they need three impact points, and there are {count(landing.rows.size)}."
    return f"No ellipses: the {count(landing.rows.size)} impact points lie on a line."


def _distance_table(flown: Flown, landing: _Landing) -> Table | None:
    """Distances from the target or the nominal place; the median is the circular error probable."""
    if landing.aim is None:
        return None
    summary = summarize(landing.distances, probabilities=DISTANCES, confidence=CONFIDENCE)
    titles = ("CEP, 50 %", *(percent(p) for p in DISTANCES[1:]))
    columns = (
        Column("Distance from", "text", 2.6),
        Column("Used / tried", "number", 1.5),
        *(Column(f"{title} [km]", "number", 1.8) for title in titles),
        Column("Largest [km]", "number", 1.2),
    )
    spread = summary.spread
    cells = [
        Cell(
            number(item.value, 4, spread), item.value, interval(item.lower, item.upper, spread) if flown.random else ""
        )
        for item in summary.quantiles
    ]
    used = Cell(f"{count(summary.n_used)} / {count(summary.n_tried)}", summary.n_used)
    where = Cell(landing.aim.name, small=_place_words(landing.aim.latitude, landing.aim.longitude))
    largest = Cell(number(summary.maximum, 4, spread), summary.maximum)
    each = percent(0.5 * (1.0 + CONFIDENCE))
    note = (
        f"CEP, circular error probable: half of the cases end within this distance. In brackets: distribution-free "
        f"limits, each holding with {each}."
        if flown.random
        else "Percentiles of the flown cases, not of a population."
    )
    return Table("Distances along the ground", columns, ((where, used, *cells, largest),), note)


# ---- the files


def _places(flown: Flown, landing: _Landing) -> Places:
    rows = landing.rows
    if rows.size > PLACES_IN_A_FILE:
        rows = rows[np.linspace(0, rows.size - 1, PLACES_IN_A_FILE).astype(np.int64)]
    title = str(flown.campaign.get("title") or flown.name)
    note = f"{landing.figure.title}; {count(rows.size)} of {count(flown.n_tried)} cases"
    status = [str(word) for word in flown.cases["status"].iloc[rows]]
    plane = landing.found.plane
    marks = [Mark("mean impact point", plane.latitude, plane.longitude)]
    marks += [landing.aim] if landing.aim else []
    return Places(
        title=title,
        note=note,
        case_ids=flown.case_ids[rows],
        status=status,
        latitude=landing.latitude[rows],
        longitude=_half_turn(landing.longitude[rows]),
        marks=tuple(marks),
        outlines=tuple(_outlines(landing.found)),
    )


def _outlines(found: Footprint) -> Iterator[Outline]:
    for region in found.all_regions:
        curves = (region.outline(),) if isinstance(region, Ellipse) else region.outlines
        kind = "ellipse" if isinstance(region, Ellipse) else "region"
        facts: dict[str, float | int] = {
            "content": region.content,
            "share_inside": round(region.inside / region.n, 6),
            "n": region.n,
        }
        if isinstance(region, DensityRegion):
            facts["confidence"] = region.confidence
        for curve in curves:
            latitude, longitude = found.plane.places(curve)
            yield Outline(kind, _name(region), facts, latitude, longitude)
