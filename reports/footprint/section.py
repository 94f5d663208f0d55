"""The footprint of a run in a report: figure, tables, and files for maps."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from mc_engine.model.figures import FootprintFigure
from mc_engine.statistics import clopper_pearson, summarize
from mc_engine.statistics.footprint import Footprint
from mc_engine.statistics.picked_cases import picked_rows
from mc_engine.statistics.regions import DensityRegion, Ellipse, next_case_scale
from reports.document.blocks import Attachment, Cell, Column, FigureBlock, Table
from reports.drawing.marks import Drawing, Line, Points, nominal_ring
from reports.drawing.palette import INK
from reports.figures.clouds import outline
from reports.figures.footprints import (
    footprint_drawing,
    footprint_plot,
    footprint_views,
    surroundings,
)
from reports.footprint.coastlines import coastlines, nearest_coast
from reports.footprint.landings import KILOMETRES, Landing, height_limit, landing_of, on_earth
from reports.footprint.map_files import MapOutline, Mark, Places, geojson, kml
from reports.run.flown import Flown
from reports.sections.figure_blocks import thinned_rows
from reports.sections.tables import quantile_cell, used_cell
from reports.text.numbers import count, counted, given_percent, number, percent

DRAWN_REGION = 0.9  # content of the one region in the figure; more would hide the ellipses
DISTANCES = (0.5, 0.9, 0.99)
LONG = 12.0  # times its width, a cloud is also drawn with a scale of its own across
PLACES_IN_A_FILE = 20_000
CORNERS = 120  # of a circle
LEAST_STRETCH = 1e-5  # that is told
WIDER = 1.25  # of a map of the surroundings, beyond the nearest coast
LEAST_AROUND = 500e3  # m, of such a map
AROUND = 4.0  # times its reach to the north: as wide as the page


@dataclass(frozen=True)
class FootprintContents:
    """Blocks of the report, sentences among them, and the files beside it."""

    blocks: list[FigureBlock | Table | str] = field(default_factory=list)
    files: list[Attachment] = field(default_factory=list)


def footprint_contents(flown: Flown) -> FootprintContents:
    """All footprints that the model asks for; a sentence in place of one that cannot be drawn."""
    contents = FootprintContents()
    for place, figure in enumerate(kind for kind in flown.figures if isinstance(kind, FootprintFigure)):
        landing = landing_of(flown, figure)
        if isinstance(landing, str):
            contents.blocks.append(landing)
            continue
        stem = "footprint" if place == 0 else f"footprint-{place + 1}"
        contents.blocks.extend(_landing_blocks(flown, landing, stem))
        if on_earth(flown, figure):
            places = _map_places(flown, landing)
            contents.files.append(Attachment(f"{stem}.kml", kml(places)))
            contents.files.append(Attachment(f"{stem}.geojson", geojson(places)))
    return contents


# ---- figure and tables


def _landing_blocks(flown: Flown, landing: Landing, stem: str) -> Iterator[FigureBlock | Table | str]:
    yield FigureBlock(_caption(flown, landing), _footprint_drawing(flown, landing), "wide")
    if landing.footprint.ellipses:
        yield _region_table(flown, landing)
    else:
        yield _no_ellipses(flown, landing)
    distances = _distance_table(flown, landing)
    if distances is not None:
        yield distances
    if on_earth(flown, landing.figure):
        shown = min(landing.rows.size, PLACES_IN_A_FILE)
        which = "all" if shown == landing.rows.size else f"{count(shown)} of"
        yield (
            f"{stem}.kml and {stem}.geojson beside this report hold {which} "
            f"{counted(landing.rows.size, 'impact point')} with case number and status"
            f"{', and the outlines of all regions' * bool(landing.footprint.ellipses)}, for a globe or a map."
        )


def _caption(flown: Flown, landing: Landing) -> str:
    plane = landing.footprint.plane
    above = f" {count(landing.above)} cases ended above {height_limit(flown, landing.figure)} and are left out." * bool(
        landing.above
    )
    return f"{landing.figure.title}. Mean impact point {_place_words(plane.latitude, plane.longitude)}.{above}"


def _place_words(latitude: float, longitude: float) -> str:
    north, east = ("N" if latitude >= 0.0 else "S"), ("E" if longitude >= 0.0 else "W")
    return f"{abs(latitude):.4f}° {north}, {abs(longitude):.4f}° {east}"


def _footprint_drawing(flown: Flown, landing: Landing) -> Drawing:
    points = landing.footprint.points / 1000.0
    ends = [int(pick(points[:, k])) for k in (0, 1) for pick in (np.argmin, np.argmax)]
    shown = thinned_rows(np.arange(landing.rows.size), np.array(ends))
    rows = landing.rows[shown]
    places = zip(flown.case_ids[rows], landing.latitude[rows], _half_turn(landing.longitude[rows]), strict=True)
    names = [f"case {case}: {_place_words(north, east)}" for case, north, east in places]
    cloud = Points(points[shown, 0], points[shown, 1], "", texts=names, cases=flown.case_ids[rows])
    aim = [nominal_ring(landing.at(place), INK, place.name) for place in [landing.aim] if place]
    outlines = (*_outlines(landing.footprint), *_circles(flown, landing))
    coasts, around, reach = _coasts(landing, outlines) if on_earth(flown, landing.figure) else ([], [], 0.0)
    views, counts = footprint_views(_long_axis(landing.footprint)), (int(landing.rows.size), flown.n_held)
    plots = [footprint_plot(view, cloud, counts, (*outlines, *aim), coasts) for view in views]
    plots += [surroundings(around, reach)] if around else []
    every = Points(points[:, 0], points[:, 1], "")
    return footprint_drawing(plots, views, every, flown.case_ids[landing.rows])


def _circles(flown: Flown, landing: Landing) -> Iterator[Line]:
    """The circular error probable, and each limit that requirements set on the distance from the target."""
    centre = landing.centre
    if flown.random and landing.rows.size > 2:
        radius = float(np.nanmedian(landing.distances(flown, centre)))
        text = f"CEP {number(radius, 3)} km: the circle about the {centre.name} that holds 50 % of the cases"
        yield outline("CEP", text, (_circle(landing.at(centre), radius),))
    limits = dict.fromkeys(  # one circle for several shares of cases
        (verdict.metric, verdict.at_most)
        for verdict in flown.verdicts
        if verdict.metric in landing.misses and verdict.at_most is not None
    )
    for nth, (metric, at_most) in enumerate(limits):
        radius = KILOMETRES[flown.unit(metric)] * at_most
        text = f"required: {flown.words(metric)} at most {number(radius)} km"
        yield outline("target", text, (_circle(landing.at(centre), radius),), nth)


def _circle(middle: np.ndarray, radius: float) -> np.ndarray:
    angle = np.linspace(0.0, 2.0 * np.pi, CORNERS)
    return middle + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def _coasts(landing: Landing, outlines: Iterable[Line]) -> tuple[list[np.ndarray], list[np.ndarray], float]:
    """The coasts on the map, or else those of a wider one, and how many km it reaches to the north."""
    plane = landing.footprint.plane
    places = [landing.footprint.points / 1000.0, *(np.column_stack([line.x, line.y]) for line in outlines)]
    places += [landing.at(landing.aim)[None, :]] if landing.aim else []
    ends = np.nanmax(np.abs(np.concatenate(places)), axis=0)
    on_map = coastlines(plane, 3000.0 * float(ends.max()))
    if any((np.abs(line) < ends).all(axis=1).any() for line in on_map):
        return on_map, [], 0.0
    reach = max(WIDER * nearest_coast(plane), LEAST_AROUND)
    return [], coastlines(plane, AROUND * reach), reach / 1000.0


def _long_axis(footprint: Footprint) -> float | None:
    """Direction of a cloud at least LONG times as long as wide, else None."""
    if not footprint.ellipses or footprint.ellipses[0].semi_axes[0] < LONG * footprint.ellipses[0].semi_axes[1]:
        return None
    return footprint.ellipses[0].direction


def _half_turn(longitude: np.ndarray) -> np.ndarray:
    """The longitudes in [-180, 180) degrees."""
    return (longitude + 180.0) % 360.0 - 180.0


def _outlines(footprint: Footprint) -> Iterator[Line]:
    for nth, ellipse in enumerate(footprint.ellipses):
        text = f"{_name(ellipse)}, holds {percent(ellipse.inside / ellipse.n, 1)} of the cases"
        yield outline("ellipse", text, (ellipse.outline() / 1000.0,), nth)
    for region in footprint.regions:
        if region.content == DRAWN_REGION:
            curves = [curve / 1000.0 for curve in region.outlines]
            yield outline("region", f"{_name(region)}, distribution-free", curves)


def _name(region: Ellipse | DensityRegion) -> str:
    content = given_percent(region.content)
    return f"{content} ellipse" if isinstance(region, Ellipse) else f"at least {content} region"


def _region_table(flown: Flown, landing: Landing) -> Table:
    """The table of regions: stated contents, and fractions of cases inside."""
    regions = landing.footprint
    columns = (
        Column("Region", "text"),
        Column("Stated content", "number"),
        Column("Cases inside", "number"),
        Column("Fraction inside", "number"),
        Column("Semi-axes [km]", "number"),
        Column("Long axis [° from north]", "number"),
    )
    rows = tuple(_region_row(region, flown.stated.confidence) for region in regions.all_regions)
    n = regions.ellipses[0].n
    bigger = f"; the next case lies with 99 % in one of k = {next_case_scale(0.99, n):.3f}" if n > 3 else ""
    note = (
        "Ellipses: covariance of the cases in the plane about the mean impact point, scaled by k = √(−2 ln(1 − P)) for "
        f"the content P of a normal distribution of known covariance{bigger}. Fraction inside: counted, with its "
        f"{given_percent(flown.stated.confidence)} Clopper–Pearson interval; where that excludes the stated content, "
        "the distribution is not normal. Lengths are geodesics through the mean impact point, the farthest case "
        f"{number(regions.reach / 1000.0, 3)} km from it; across them the plane stretches by at most "
        f"{percent(max(regions.plane.stretch(regions.reach), LEAST_STRETCH), 3, up=True)}."
    )
    return Table(
        f"Regions of the {count(landing.rows.size)} of {count(flown.n_held)} cases that came down{flown.sample_words}",
        columns,
        rows,
        note,
    )


def _region_row(region: Ellipse | DensityRegion, confidence: float) -> tuple[Cell, ...]:
    share = region.inside / region.n
    low, high = clopper_pearson(region.inside, region.n, confidence)
    inside = (
        Cell(f"{count(region.inside)} / {count(region.n)}", region.inside),
        Cell(percent(share), share, f"[{percent(low)}, {percent(high, up=True)}]"),
    )
    if isinstance(region, DensityRegion):
        return (
            Cell(
                "distribution-free region",
                small=f"{_parts(len(region.outlines))}, {given_percent(region.confidence)} confidence",
            ),
            Cell(given_percent(region.content), region.content),
            *inside,
            Cell("–"),
            Cell("–"),
        )
    a, b = (axis / 1000.0 for axis in region.semi_axes)
    north = float(np.degrees(0.5 * np.pi - region.direction)) % 180.0
    return (
        Cell("covariance ellipse"),
        Cell(given_percent(region.content), region.content, f"k = {region.scale:.3f}"),
        *inside,
        Cell(f"{number(a, 4)} × {number(b, 4)}", a),
        Cell(f"{north:.1f}", north),
    )


def _parts(outlines: int) -> str:
    return "one outline" if outlines == 1 else f"{outlines} outlines"


def _no_ellipses(flown: Flown, landing: Landing) -> str:
    if not flown.random:
        return f"No regions: the cases of the design “{flown.design}” are chosen, not drawn."
    if landing.rows.size < 3:
        return f"No regions: they need three impact points, and there are {count(landing.rows.size)}."
    return f"No ellipses: the {count(landing.rows.size)} impact points lie on a line."


def _distance_table(flown: Flown, landing: Landing) -> Table | None:
    """Distances from the target or the mean impact point, and from the end of the nominal case."""
    if landing.rows.size < 2:
        return None
    places = [landing.centre, *([landing.aim] if landing.aim is not None and landing.aim != landing.centre else [])]
    titles = [given_percent(p) for p in _distances(flown)]
    columns = (
        Column("Distance from", "text"),
        Column("Used / tried", "number"),
        *(Column(f"{title} [km]", "number") for title in titles),
        Column("Largest [km]", "number"),
    )
    rows = tuple(_distance_row(flown, landing, place) for place in places)
    each = given_percent(flown.stated.confidence)
    metric = f"From the target: the metric {flown.words(landing.miss)}, as the model computes it. "
    note = metric * bool(landing.miss) + (
        f"50 % of the cases end within the first distance; from the {landing.centre.name} it is the circular error "
        f"probable (CEP). In brackets: distribution-free limits, each holding with {each}."
        if flown.random
        else "Percentiles of the flown cases, not of a population." * bool(titles)
    )
    return Table(f"Distances along the ground{flown.sample_words}", columns, rows, note)


def _distances(flown: Flown) -> tuple[float, ...]:
    """The percentiles of distances in the table; none for a design without random sampling."""
    return () if flown.chosen else DISTANCES


def _distance_row(flown: Flown, landing: Landing, place: Mark) -> tuple[Cell, ...]:
    summary = summarize(
        landing.distances(flown, place), probabilities=_distances(flown), confidence=flown.stated.two_sided
    )
    spread = summary.spread
    cells = [quantile_cell(flown, item, spread, 4) for item in summary.quantiles]
    largest = Cell(number(summary.maximum, 4, spread), summary.maximum)
    return (Cell(place.name, small=_place_words(place.latitude, place.longitude)), used_cell(summary), *cells, largest)


# ---- the files


def _map_places(flown: Flown, landing: Landing) -> Places:
    rows = landing.rows
    if rows.size > PLACES_IN_A_FILE:
        rows = rows[picked_rows(rows.size, PLACES_IN_A_FILE)]
    title = str(flown.campaign.get("title") or flown.name)
    note = f"{landing.figure.title}; {count(rows.size)} of {count(flown.n_held)} cases"
    status = [str(word) for word in flown.cases["status"].iloc[rows]]
    marks = [landing.mean]
    marks += [landing.aim] if landing.aim else []
    return Places(
        title=title,
        note=note,
        case_ids=flown.case_ids[rows],
        status=status,
        latitude=landing.latitude[rows],
        longitude=_half_turn(landing.longitude[rows]),
        marks=tuple(marks),
        outlines=tuple(_map_outlines(landing.footprint)),
    )


def _map_outlines(footprint: Footprint) -> Iterator[MapOutline]:
    for region in footprint.all_regions:
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
            latitude, longitude = footprint.plane.places(curve)
            yield MapOutline(kind, _name(region), facts, latitude, longitude)
