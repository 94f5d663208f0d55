"""The declarations of a model: each names its numbers once, and gives the named tuple that physics uses.

The name of a number is its column; its ending tells the unit, and what is before it is the name inside physics:
`altitude_km` is `altitude`, in metres.  A number whose name ends in no unit, or in what may be read as two, says its
unit: Parameter(0.1, "eccentricity", unit="").
"""

from collections import namedtuple
from dataclasses import dataclass, replace
from types import ModuleType, SimpleNamespace
from typing import Any

from mc_engine.errors import ModelError
from mc_engine.lanes.physics_function import PhysicsFunction
from mc_engine.model.fields import OF_NAME, Extremum, Field, Named, Parameter, Setting
from mc_engine.units import UNITS, unit_hint, unit_of

_RECORDS = {"states": "State", "outputs": "Outputs", "metrics": "Metrics", "events": "EVENTS", "extrema": "EXTREMA"}
_PHYSICS = ("initial", "start", "rhs", "control", "switch", "observe", "evaluate")


@dataclass(frozen=True)
class Metric:
    """A metric that the engine computes: made by `maximum_of`, `at_end` and the like.

    source : str, "value" or "time" of an extremum, "end" or "event" for the output there
    field : Field, the metric's column, as yet without its name
    extremum : the output and the kind of its extreme value; None for the others
    output : str, the output at the end or at an event; of a time, "t_s" or ""
    event : str, the event
    """

    source: str
    field: Field
    extremum: Extremum | None = None
    output: str = ""
    event: str = ""

    def meaning(self, output: str) -> str:
        """The metric in words, of the description of its output: "largest speed", "time of the smallest altitude"."""
        if self.event:
            return f"{output} at the event {self.event}"
        if self.extremum is None:
            return f"{output} at the end"
        if self.extremum.kind == "last_above":
            return f"last time of the {output} above its level"
        extreme = f"{'largest' if self.extremum.kind == 'max' else 'smallest'} {output}"
        return extreme if self.source == "value" else f"time of the {extreme}"


def maximum_of(output: str, description: str = "", *, smooth: bool = True, **options: Any) -> Metric:
    """The largest value of an output along the flight: metrics(top_speed_m_s=maximum_of("speed_m_s", "top speed")).

    output : str, the name of an output
    description : str, one line; by default in the words of the output
    smooth : bool, the extremum may lie between steps, on a curve through them; else it is taken at steps and events
    options : low, high, sometimes, unit; see `Field`

    Returns the Metric, for `metrics`.
    Raises TypeError for another argument.

    >>> maximum_of("speed_m_s", "largest speed").extremum.kind
    'max'
    """
    return _extreme("max", "value", output, description, smooth, options)


def minimum_of(output: str, description: str = "", *, smooth: bool = True, **options: Any) -> Metric:
    """The smallest value of an output along the flight.

    output, description, smooth, options : as of `maximum_of`

    Returns the Metric.
    Raises TypeError for another argument.

    >>> minimum_of("altitude_km", "lowest altitude").extremum.kind
    'min'
    """
    return _extreme("min", "value", output, description, smooth, options)


def time_of_maximum(output: str, description: str = "", *, smooth: bool = True, **options: Any) -> Metric:
    """The time of the largest value of an output.

    output, description, smooth, options : as of `maximum_of`

    Returns the Metric.
    Raises TypeError for another argument.

    >>> time_of_maximum("altitude_km", "time of the apogee").source
    'time'
    """
    return _extreme("max", "time", output, description, smooth, options)


def time_of_minimum(output: str, description: str = "", *, smooth: bool = True, **options: Any) -> Metric:
    """The time of the smallest value of an output.

    output, description, smooth, options : as of `maximum_of`

    Returns the Metric.
    Raises TypeError for another argument.

    >>> time_of_minimum("altitude_km", "time of the perigee").source
    'time'
    """
    return _extreme("min", "time", output, description, smooth, options)


def _column(description: str, options: dict[str, Any]) -> Field:
    """The metric's column, whose name `metrics` gives."""
    if "name" in options:
        raise ModelError("a metric has the name under which `metrics` declares it; leave `name` out")
    return Field(description, **options)


def _extreme(kind: str, source: str, output: str, description: str, smooth: bool, options: dict[str, Any]) -> Metric:
    return Metric(source, _column(description, options), Extremum("", output, kind, smooth=smooth))


def last_above(output: str, level: float, description: str = "", **options: Any) -> Metric:
    """The last time at which an output was above `level`: 0 where it never was, and where it still is at the end, the
    time of the end, which a limit such as that of a settling time must lie below.

    output, description, options : as of `maximum_of`
    level : float, in SI

    Returns the Metric.
    Raises TypeError for another argument.

    >>> last_above("error_deg", 0.01, "settling time").extremum.level
    0.01
    """
    return Metric("time", _column(description, options), Extremum("", output, "last_above", level))


def at_end(output: str, description: str = "", **options: Any) -> Metric:
    """The value of an output, or of the time "t_s", at the end of the case.

    output, description, options : as of `maximum_of`

    Returns the Metric.
    Raises TypeError for another argument.

    >>> at_end("altitude_km", "altitude of the apogee").output
    'altitude_km'
    """
    return Metric("end", _column(description, options), output=output)


def value_at(event: str, output: str, description: str = "", **options: Any) -> Metric:
    """The value of an output where an event first crosses zero: value_at("apogee", "altitude_km", "altitude there").

    Of a delayed event, where it crosses, not where it acts.  In a case without the event it is not a number, which
    needs sometimes=True if it is so in all.

    event : str, the name of an event
    output : str, the name of an output; `time_of` is for the time
    description : str, one line; by default in the words of the output and the event
    options : low, high, sometimes, unit; see `Field`

    Returns the Metric, for `metrics`.

    Raises TypeError for another argument.

    >>> value_at("apogee", "altitude_km", "altitude of the apogee").event
    'apogee'
    """
    return Metric("event", _column(description, options), output=output, event=event)


def time_of(event: str, description: str = "", **options: Any) -> Metric:
    """The time at which an event first crosses zero; see `value_at`.

    event : str, the name of an event
    description : str, one line; by default in the words of the output and the event
    options : low, high, sometimes, unit; see `Field`

    Returns the Metric, for `metrics`.

    Raises TypeError for another argument.

    >>> time_of("apogee", "time of the apogee").output
    ''
    """
    return Metric("event", _column(description, options), event=event)


def inputs(**declared: Parameter | Setting) -> Any:
    """The inputs of a model by their columns: a named tuple of the parameters, by which physics reads them from `p`.

    declared : Parameter or Setting, by column

    Returns the named tuple of the parameters.

    Raises ModelError for a name without its unit.

    >>> inputs(altitude_km=Parameter(300.0, "altitude of the orbit"))._fields
    ('altitude',)
    """
    for name, item in declared.items():
        if not isinstance(item, Parameter | Setting):
            raise ModelError(
                f'the input "{name}" is {item!r}; it must be Parameter(default, "meaning") or Setting(...)'
            )
    named = [_with_unit(item, name) for name, item in declared.items()]
    return _record("Inputs", [item.symbol for item in named if isinstance(item, Parameter)], tuple(named))


def choices(inputs: Any) -> SimpleNamespace:
    """The numbers that physics has for the words of settings: CHOICES = choices(Inputs), o.law == CHOICES.law.a.

    inputs : made by the function of this name

    Returns the words of each setting with choices, by its name without unit.  One that is no name in Python is
    getattr(CHOICES.law, "two-body"), kept under a name of its own outside of physics.

    Raises AttributeError for what declares nothing.

    >>> Inputs = inputs(law=Setting("a", "control law", choices=("a", "b")))
    >>> choices(Inputs).law.b
    1.0
    """
    settings = [item for item in inputs.declared if isinstance(item, Setting) and item.choices]
    numbers = {item.symbol: {word: item.code(word) for word in item.choices} for item in settings}
    return SimpleNamespace(**{symbol: SimpleNamespace(**words) for symbol, words in numbers.items()})


def states(**declared: str | Field) -> Any:
    """The state of a model by its columns, each with its meaning: the named tuple that `initial` and `rhs` give.

    declared : str or Field, the meaning, by column

    Returns the named tuple of the state.

    Raises ModelError for a name without its unit.

    >>> State = states(x_m="distance", vx_m_s="speed")
    >>> State(x=1.0, vx=0.0)
    State(x=1.0, vx=0.0)
    """
    return _of_fields("State", "state", declared)


def outputs(**declared: str | Field) -> Any:
    """What is looked at along the flight, by its columns: the named tuple that `observe` gives.

    declared : str or Field, the meaning, by column

    Returns the named tuple of the outputs.

    Raises ModelError for a name without its unit.

    >>> outputs(altitude_km="altitude", speed_m_s="speed")._fields
    ('altitude', 'speed')
    """
    return _of_fields("Outputs", "output", declared)


def metrics(**declared: str | Field | Metric) -> Any:
    """The results of a case by their columns: the named tuple of those that `evaluate` gives, and those of the engine.

    declared : str, Field, or what `maximum_of` and its like give, by column

    Returns the named tuple of what `evaluate` gives.

    Raises ModelError for a name without its unit.

    >>> Metrics = metrics(top_speed_m_s=maximum_of("speed_m_s", "largest speed"), range_km="distance flown")
    >>> Metrics._fields
    ('range',)
    """
    fields = tuple(
        _field("metric", name, item.field if isinstance(item, Metric) else item) for name, item in declared.items()
    )
    computed = {name: item for name, item in declared.items() if isinstance(item, Metric)}
    rest = [item.symbol for item in fields if item.name not in computed]
    made: Any = _record("Metrics", rest, fields)
    made.computed = computed
    return made


def declared_in(*modules: ModuleType) -> dict[str, Any]:
    """What the modules of a model declare, for `model`: MODEL = model(name=..., **declared_in(dynamics, outcome)).

    modules : they may have State, Outputs, Metrics, EVENTS and EXTREMA, which become `states`, `outputs`, `metrics`,
        `events` and `extrema`; and physics called initial, start, rhs, control, switch, observe or evaluate

    Returns the dictionary of what is found, by argument.

    Raises ModelError where two modules have different things of one name.

    >>> from campaigns.deorbit import dynamics
    >>> declared_in(dynamics)["rhs"] is dynamics.rhs
    True
    """
    found: dict[str, Any] = {}
    for module in modules:
        parts = {argument: vars(module).get(name) for argument, name in _RECORDS.items()}
        parts |= {name: vars(module).get(name) for name in _PHYSICS}
        for argument, part in parts.items():
            # a function or a module of such a name, which is no physics, is something else
            if part is None or (argument in _PHYSICS and not isinstance(part, PhysicsFunction)):
                continue
            if found.setdefault(argument, part) is not part:
                raise ModelError(f"two modules have a `{_RECORDS.get(argument, argument)}`; rename one of them")
    return found


def _of_fields(title: str, what: str, declared: dict[str, Any]) -> Any:
    fields = tuple(_field(what, name, item) for name, item in declared.items())
    return _record(title, [item.symbol for item in fields], fields)


def _record(title: str, symbols: list[str], declared: tuple[Named, ...]) -> Any:
    """The named tuple of these numbers, with `declared`: what is known of each."""
    for symbol in symbols:
        if symbols.count(symbol) > 1:
            raise ModelError(f'{title}: two names are "{symbol}" without their units; give each a name of its own')
    try:
        made = namedtuple(title, symbols)  # type: ignore[misc]
    except ValueError as error:
        raise ModelError(f"{title}: {error}; a name without its unit is a word of letters, digits and _") from None
    made.declared = declared  # type: ignore[attr-defined]
    return made


def _field(what: str, name: str, item: Any) -> Field:
    if isinstance(item, Metric):
        raise ModelError(f'the {what} "{name}" is a metric; maximum_of and its like stand in metrics(...)')
    if not isinstance(item, str | Field):
        raise ModelError(f'the {what} "{name}" is {item!r}; it must be its meaning, a text, or Field("meaning", ...)')
    return _with_unit(Field(item) if isinstance(item, str) else item, name)


def _with_unit(item: Any, name: str) -> Any:
    """The number with its name, and the unit that the name says."""
    unit = item.unit
    if not isinstance(unit, str):
        raise ModelError(f'"{name}" has {unit!r} as its `unit`; it must be a text, such as "m/s"')
    if unit not in (OF_NAME, *UNITS):
        raise ModelError(f'"{name}" has the unit "{unit}"{unit_hint(unit)}')
    if unit == OF_NAME:
        has_none = isinstance(item, Setting) and (item.choices or item.date or isinstance(item.default, bool))
        unit = "" if has_none else unit_of(name)
    return replace(item, name=name, unit=unit)
