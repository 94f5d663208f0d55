"""Figures that a model asks of every report, as data: what to draw, not how.

The run's manifest keeps them, so that a report can be made years later without the model.  Columns are those of the
table of cases: inputs, metrics, `end_` states; a figure over an input that a run does not disperse is left out of its
report.  Where `upstream` is True, x and y may be columns of the run that a campaign takes its inputs from.
"""

from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(frozen=True)
class MapFigure:
    """Filled contours of a metric over two inputs, with the flown cases on them.

    metric : str, column
    x : str, column
    y : str, column
    title : str
    upstream : bool, x and y may be columns of the run that a campaign takes its inputs from

    >>> MapFigure("propellant_kg", "ve_pct", "oe_pct", "Propellant over the two errors").metric
    'propellant_kg'
    """

    metric: str
    x: str
    y: str
    title: str
    upstream: bool = field(default=False, kw_only=True)


@dataclass(frozen=True)
class HistoryFigure:
    """Saved time histories: one panel for each quantity.

    quantities : tuple of str
    title : str

    >>> HistoryFigure(("altitude_km", "speed_m_s"), "Altitude and speed").quantities
    ('altitude_km', 'speed_m_s')
    """

    quantities: tuple[str, ...]
    title: str


@dataclass(frozen=True)
class ScatterFigure:
    """One column against another, a point for each case.

    x : str, column
    y : str, column
    title : str
    upstream : bool, x and y may be columns of the run that a campaign takes its inputs from

    >>> ScatterFigure("ve_pct", "propellant_kg", "Propellant against the speed error").x
    've_pct'
    """

    x: str
    y: str
    title: str
    upstream: bool = field(default=False, kw_only=True)


@dataclass(frozen=True)
class FootprintFigure:
    """Impact points on a planet, with the regions that hold them; the report also writes them as KML and GeoJSON.

    latitude : str, column, geodetic [deg]
    longitude : str, column [deg]
    title : str
    ends_below : tuple (column, value) or None; a case above the value has not come down
    planet : str, the setting that names the planet; empty for the Earth
    target : tuple of two columns or parameters, latitude and longitude aimed at; without it distances count from the
        nominal case

    >>> FootprintFigure("end_latitude_deg", "end_longitude_deg", "Impact points").planet
    ''
    """

    latitude: str
    longitude: str
    title: str
    ends_below: tuple[str, float] | None = None
    planet: str = ""
    target: tuple[str, str] | None = None


@dataclass(frozen=True)
class ProfileFigure:
    """One history quantity against another, as altitude against speed, with percentile bands of x at each y.

    x : str, quantity
    y : str, quantity
    title : str

    >>> ProfileFigure("speed_m_s", "altitude_km", "Speed along the descent").y
    'altitude_km'
    """

    x: str
    y: str
    title: str


@dataclass(frozen=True)
class CorridorFigure:
    """Cases over two columns, coloured by the requirements that they violate.

    x : str, column
    y : str, column
    metrics : tuple of str, those whose requirements count
    title : str
    upstream : bool, x and y may be columns of the run that a campaign takes its inputs from

    >>> CorridorFigure("ve_pct", "oe_pct", ("propellant_kg",), "Corridor").metrics
    ('propellant_kg',)
    """

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
