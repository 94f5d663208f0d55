"""Figures that a model requests for every report, as data: what to draw, not how.

The manifest of a run stores them, so that a report can be made later without the model.  Columns are those of the case
table: inputs, metrics, `end_` states.  A figure over an input that a run does not disperse is left out of its report.
With `upstream` True, x and y may also be columns of the run that the campaign takes its inputs from.
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from mc_engine.errors import ModelError
from mc_engine.model.fields import inputs_of, refuse_other_types
from mc_engine.suggestions import hint, nearest

if TYPE_CHECKING:
    from mc_engine.model.simulator import System


@dataclass(frozen=True)
class MapFigure:
    """Filled contours of a metric over two inputs, with the flown cases as points.

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
    """Saved time histories: one panel for each output.

    quantities : tuple of str, outputs
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
    ends_below : tuple (column, value) or None; a case whose column is above the value has not landed
    planet : str, the setting that names the planet, one of earth, mars, moon, venus; empty for the Earth; no footprint
        on another one, or for cases that differ in it
    target : tuple of two columns or parameters, latitude and longitude of the target; without it distances are
        measured from the end of the nominal case

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
    """One output of time histories over another, such as altitude over speed, with percentile bands of x at each y.

    x : str, output or "t_s"
    y : str, output or "t_s"
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
    metrics : tuple of str, the metrics whose requirements are shown
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


# ---- what they must keep

_OF_EVERY_CASE = ("case_id", "end_time_s")


def refuse_false_figures(model: "System") -> None:
    """ModelError if a figure of the model has a field of another type, or names what the model does not have."""
    for figure in model.figures:
        figure_name = f'the {type(figure).__name__} "{figure.title}"'
        refuse_kinds(figure, figure_name)
        for word, name, known in _names_in_figure(figure, model):
            if name not in known:
                raise ModelError(f'{figure_name}: there is no {word} "{name}"{_other_table(name, word, model)}'
                                 f"{_hint(name, known)}")  # fmt: skip


def refuse_kinds(figure: Figure, figure_name: str) -> None:
    """ModelError about the figure of this name if a field of it is of another type, or names nothing to draw."""
    refuse_other_types(figure, figure_name)
    for name, value in vars(figure).items():
        if value == ():
            raise ModelError(f"{figure_name} has () as its `{name}`; it must name one at least")


def _names_in_figure(figure: Figure, model: "System") -> Iterator[tuple[str, str, list[str]]]:
    """Every name in the figure that the model must have: what it is, the name, all that there are."""
    inputs = inputs_of(model)
    metrics = [metric.name for metric in model.metrics]
    columns = [*inputs, *metrics, *(f"end_{state.name}" for state in model.states), *_OF_EVERY_CASE]
    outputs = [output.name for output in model.quantities]
    if isinstance(figure, MapFigure):
        yield "column", figure.metric, columns
    if isinstance(figure, CorridorFigure):
        yield from (("metric", name, metrics) for name in figure.metrics)
    if isinstance(figure, MapFigure | ScatterFigure | CorridorFigure) and not figure.upstream:
        yield from (("column", name, columns) for name in (figure.x, figure.y))
    if isinstance(figure, HistoryFigure):
        yield from (("output", name, outputs) for name in figure.quantities)
    if isinstance(figure, ProfileFigure):
        yield from (("output", name, ["t_s", *outputs]) for name in (figure.x, figure.y))
    if isinstance(figure, FootprintFigure):
        above = () if figure.ends_below is None else figure.ends_below[:1]
        yield from (("column", str(name), columns) for name in (figure.latitude, figure.longitude, *above))
        yield from (("column", name, columns) for name in figure.target or ())
        if figure.planet:
            yield "setting", figure.planet, [item.name for item in model.settings]


def _hint(name: str, known: list[str]) -> str:
    """`hint`, where a name with the same end, which is its unit, comes first."""
    alike = [column for column in known if column.rpartition("_")[2] == name.rpartition("_")[2]]
    return hint(name, alike if nearest(name, alike) else known)


def _other_table(name: str, word: str, model: "System") -> str:
    """Why a name that the model has is not for this figure: histories and the table of cases are two tables."""
    if word == "output" and name in [*inputs_of(model), *(metric.name for metric in model.metrics)]:
        return " (it is a column of the table of cases, histories do not have it)"
    if word in ("column", "metric") and name in [output.name for output in model.quantities]:
        return " (it is an output of histories, the table of cases does not have it)"
    return ""
