"""Figures that a model requests of every report, as data: what to draw, not how.

The run's manifest stores them, so that a report can be made later without the model.  Columns are those of the case
table: inputs, metrics, `end_` states; a figure over an input that a run does not disperse is left out of its report.
With `upstream` True, x and y may be columns of the run that the campaign takes its inputs from.
"""

from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(frozen=True)
class MapFigure:
    """Filled contours of a metric over two inputs, with the flown cases on them."""

    metric: str
    x: str
    y: str
    title: str
    upstream: bool = field(default=False, kw_only=True)


@dataclass(frozen=True)
class HistoryFigure:
    """History quantities of the retained cases against time, one panel a quantity."""

    quantities: tuple[str, ...]
    title: str


@dataclass(frozen=True)
class ScatterFigure:
    """One column against another, a point a case."""

    x: str
    y: str
    title: str
    upstream: bool = field(default=False, kw_only=True)


@dataclass(frozen=True)
class FootprintFigure:
    """Where the flights end on a planet, with the regions that hold them; written as KML and GeoJSON besides.

    latitude, longitude : columns, geodetic, degrees.  ends_below : (column, value): a case above it has not come
    down.  planet : the setting that names the planet, if the model flies to others than the Earth.  target : columns
    or parameters with the latitude and longitude aimed at; without them distances count from the nominal case.
    """

    latitude: str
    longitude: str
    title: str
    ends_below: tuple[str, float] | None = None
    planet: str = ""
    target: tuple[str, str] | None = None


@dataclass(frozen=True)
class ProfileFigure:
    """One history quantity against another, as altitude against speed, with percentile bands of x at each y."""

    x: str
    y: str
    title: str


@dataclass(frozen=True)
class CorridorFigure:
    """Cases over two columns, coloured by the limits that they violate, of the requirements on these metrics."""

    x: str
    y: str
    metrics: tuple[str, ...]
    title: str
    upstream: bool = field(default=False, kw_only=True)


Figure = MapFigure | HistoryFigure | ScatterFigure | FootprintFigure | ProfileFigure | CorridorFigure
KINDS: dict[str, type[Figure]] = {
    "map": MapFigure,
    "history": HistoryFigure,
    "scatter": ScatterFigure,
    "footprint": FootprintFigure,
    "profile": ProfileFigure,
    "corridor": CorridorFigure,
}


def to_record(figure: Any) -> dict[str, Any]:
    """The figure as plain data for the manifest."""
    kind = next(name for name, cls in KINDS.items() if isinstance(figure, cls))
    return {"kind": kind, **asdict(figure)}


def from_record(record: dict[str, Any]) -> Any:
    """The figure that `to_record` wrote."""
    values = {key: tuple(value) if isinstance(value, list) else value for key, value in record.items() if key != "kind"}
    kind: Any = KINDS[record["kind"]]
    return kind(**values)
