"""The declarations of a model: its inputs, states, outputs and metrics, each declared once, with meaning and unit.

Each declaration returns the named tuple that physics uses.  The name of a number is its column.  The ending of the name
is the unit, and the rest is the name inside physics: `altitude_km` is `altitude` there, in metres.  If a name ends in
no unit, or its ending fits two units, the declaration states the unit: Parameter(0.1, "eccentricity", unit="").
"""

from collections import namedtuple
from collections.abc import Callable
from dataclasses import dataclass, replace
from types import ModuleType, SimpleNamespace
from typing import Any

from mc_engine.errors import ModelError
from mc_engine.lanes.physics_function import PhysicsFunction
from mc_engine.model.fields import OF_NAME, Extremum, Field, Named, Parameter, Setting, refuse_other_types
from mc_engine.units import UNITS, unit_hint, unit_of

_RECORDS = {"states": "State", "outputs": "Outputs", "metrics": "Metrics", "events": "EVENTS", "extrema": "EXTREMA"}
_PHYSICS = ("initial", "start", "rhs", "control", "switch", "observe", "evaluate")


@dataclass(frozen=True)
class Metric:
    """A metric that the engine computes: made by `maximum_of`, `at_end` and the like.

    source : str, "value" or "time" of an extremum, "end" or "event" for the output there
    field : Field, the column of the metric, before `metrics` has given it its name
    extremum : the output and the kind of its extreme value; None for the other sources
    output : str, the output whose value at the end or at an event is the metric; for the time, "t_s" or ""
    event : str, the name of the event
    """

    source: str
    field: Field
    extremum: Extremum | None = None
    output: str = ""
    event: str = ""

    @property
    def is_time(self) -> bool:
        """Whether it is the time of an event, of an extreme, or of the end."""
        return self.source == "time" or (self.source == "event" and not self.output) or self.output == "t_s"

    @property
    def of_output(self) -> str:
        """The output whose largest, smallest or last value it is; empty for times and for values at events."""
        if self.source == "value" and self.extremum is not None:
            return self.extremum.quantity
        return self.output if self.source == "end" and not self.is_time else ""

    def meaning(self, output: str) -> str:
        """The metric in words, made from the description of its output, such as "time of the smallest altitude"."""
        if self.event:
            return f"{output} {'at' if self.output else 'of'} the event {self.event}"
        if self.extremum is None:
            return f"{output} at the end"
        if self.extremum.kind == "last_above":
            return f"last time of the {output} above its level"
        extreme = f"{'largest' if self.extremum.kind == 'max' else 'smallest'} {output}"
        return extreme if self.source == "value" else f"time of the {extreme}"


def maximum_of(output: str, description: str = "", *, smooth: bool = True, **options: Any) -> Metric:
    """The largest value of an output along the flight: metrics(top_speed_m_s=maximum_of("speed_m_s", "top speed")).

    output : str, the name of an output
    description : str, one line; by default made from the description of the output
    smooth : bool, True: the extremum may lie between steps, on a curve through them; False: only at steps and events
    options : low, high, sometimes, unit; see `Field`

    Returns the Metric, for `metrics`.
    Raises TypeError for any other option.

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
    """The last time at which an output was above `level`, such as a settling time: 0 if it never was, and the time of
    the end if it is still above then, so choose the limit of a requirement below the end of the flight.

    output, description, options : as of `maximum_of`
    level : float, in SI and radians, whatever the unit of the output: 0.01 of an output in degrees is 0.57 deg

    Returns the Metric.
    Raises TypeError for another argument.

    >>> from math import radians
    >>> last_above("error_deg", radians(0.5), "last time above 0.5 deg").extremum.level
    0.008726646259971648
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

    For a delayed event, the value at the crossing, not at the action.  In a case without the event the metric is NaN.
    If it may be NaN in all cases, declare it with sometimes=True.

    event : str, the name of an event
    output : str, the name of an output; for the time use `time_of`
    description : str, one line; by default made from the output's description and the event's name
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
    description : str, one line; by default made from the name of the event
    options : low, high, sometimes, unit; see `Field`

    Returns the Metric, for `metrics`.

    Raises TypeError for another argument.

    >>> time_of("apogee", "time of the apogee").output
    ''
    """
    return Metric("event", _column(description, options), event=event)


def inputs(**declared: Parameter | Setting) -> Any:
    """The class of `p`: a named tuple of the parameters, without their units; settings are declared here, too.

    declared : Parameter or Setting, by column

    Returns the named tuple of the parameters.

    Raises ModelError for a name without its unit, or for a value of another type, such as a text in place of a number.

    >>> inputs(altitude_km=Parameter(300.0, "altitude of the orbit"))._fields
    ('altitude',)
    """
    for name, item in declared.items():
        if not isinstance(item, Parameter | Setting):
            raise ModelError(
                f'the input "{name}" is {item!r}; it must be Parameter(default, "meaning") or Setting(...)'
            )
    named = [_with_unit(item, name) for name, item in declared.items()]
    for item in named:
        refuse_other_types(item, f'{type(item).__name__} "{item.name}"')
    return _record("Inputs", [item.symbol for item in named if isinstance(item, Parameter)], tuple(named))


def choices(inputs: Any) -> SimpleNamespace:
    """The numbers by which physics knows the words of settings: CHOICES = choices(Inputs), o.law == CHOICES.law.a.

    inputs : made by the function of this name

    Returns an attribute for each setting with choices, by its name without unit; the words are its attributes.  For a
    word that is not a Python name, assign getattr(CHOICES.law, "two-body") to a name outside the physics.

    Raises AttributeError for an argument without declarations.

    >>> Inputs = inputs(law=Setting("a", "control law", choices=("a", "b")))
    >>> choices(Inputs).law.b
    1.0
    """
    settings = [item for item in inputs.declared if isinstance(item, Setting) and item.choices]
    numbers = {item.symbol: {word: item.code(word) for word in item.choices} for item in settings}
    return SimpleNamespace(**{symbol: SimpleNamespace(**words) for symbol, words in numbers.items()})


def states(**declared: str | Field) -> Any:
    """The class of the state: the named tuple that `initial` and `rhs` return.

    declared : str or Field, the meaning, by column

    Returns the named tuple of the state.

    Raises ModelError for a name without its unit.

    >>> State = states(x_m="distance", vx_m_s="speed")
    >>> State(x=1.0, vx=0.0)
    State(x=1.0, vx=0.0)
    """
    return _of_fields("State", "state", declared)


def outputs(**declared: str | Field) -> Any:
    """The class of the outputs along the flight: the named tuple that `observe` returns.

    declared : str or Field, the meaning, by column

    Returns the named tuple of the outputs.

    Raises ModelError for a name without its unit.

    >>> outputs(altitude_km="altitude", speed_m_s="speed")._fields
    ('altitude', 'speed')
    """
    return _of_fields("Outputs", "output", declared)


def metrics(**declared: str | Field | Metric) -> Any:
    """The class of the metrics that `evaluate` returns; the metrics that the engine computes are declared here, too.

    declared : by column, a str or Field for `evaluate`, or the result of `maximum_of`, `at_end` and the like

    Returns the named tuple of the metrics that `evaluate` returns.

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
    """The arguments of `model` that modules define: MODEL = model(name=..., **declared_in(dynamics, outcome)).

    modules : their names State, Outputs, Metrics, EVENTS and EXTREMA become the arguments `states`, `outputs`,
        `metrics`, `events` and `extrema`; physics called initial, start, rhs, control, switch, observe or evaluate too

    Returns the dictionary of all that are defined, by argument.

    Raises ModelError where two modules define the same name differently.

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
    """The named tuple of these numbers; its attribute `declared` holds the declaration of each."""
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
    if isinstance(item, str):
        return _with_unit(Field(item), name, 'Field("...", unit="{}")'.format)
    return _with_unit(item, name)


def _with_unit(item: Any, name: str, said: Callable[[str], str] = 'unit="{}"'.format) -> Any:
    """The number with its name, and with the unit that its name ends in; said : as in `unit_of`."""
    unit = item.unit
    if not isinstance(unit, str):
        raise ModelError(f'"{name}" has {unit!r} as its `unit`; it must be a text, such as "m/s"')
    if unit not in (OF_NAME, *UNITS):
        raise ModelError(f'"{name}" has the unit "{unit}"{unit_hint(unit)}')
    if unit == OF_NAME:
        has_none = isinstance(item, Setting) and (item.choices or item.date or isinstance(item.default, bool))
        unit = "" if has_none else unit_of(name, said)
    return replace(item, name=name, unit=unit)
