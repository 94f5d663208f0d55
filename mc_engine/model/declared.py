"""`model`: makes the record that the engine reads from what a model file declares.

A function of a model takes the arguments that it names, in any order; the engine calls them all alike, so each becomes
a `ComposedFunction` that hands on what was asked for.  Events and metrics that have functions of their own, or none,
are composed in the same way.
"""

import inspect
from collections import namedtuple
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mc_engine.errors import ModelError
from mc_engine.lanes.composed import Call, ComposedFunction, Pick
from mc_engine.lanes.physics_function import PhysicsFunction
from mc_engine.model.declarations import Metric
from mc_engine.model.fields import AdaptiveStep, Event, Extremum, Field, FixedStep, Parameter, Setting
from mc_engine.model.figures import Figure
from mc_engine.model.reading import ARGUMENTS
from mc_engine.model.record import Model
from mc_engine.suggestions import hint, nearest
from mc_engine.units import UNITS

_LONG = {"time": "t", "state": "s", "memory": "m", "parameters": "p", "settings": "o"}
_TIME = Field("time since the start", name="t_s", unit="s")  # of histories
_DECLARATIONS = {"inputs": "Inputs", "states": "State", "outputs": "Outputs", "metrics": "Metrics"}
Physics = Callable[..., Any]


def model(
    *,
    name: str,
    title: str,
    inputs: Any,
    states: Any,
    outputs: Any,
    metrics: Any,
    clock: FixedStep | AdaptiveStep,
    initial: Physics,
    rhs: Physics,
    observe: Physics,
    evaluate: Physics | None = None,
    events: Mapping[str, Event] | None = None,
    switch: Physics | None = None,
    memory: Any = None,
    start: Physics | None = None,
    control: Physics | None = None,
    extrema: Mapping[str, Metric] | None = None,
    prepare: Callable[..., Any] | None = None,
    kernel_parameters: Any = None,
    tables: Callable[..., np.ndarray] | None = None,
    source: str = "",
    figures: tuple[Figure, ...] = (),
    data: tuple[str, ...] = (),
    published: tuple[Mapping[str, Any], ...] = (),
) -> Model:
    """The model of a file, which ends with MODEL = model(...).

    Except `prepare` and `tables`, which are NumPy, the functions are marked with `mc_engine.lanes.physics`.  Each takes
    what it names, in any order, in SI and radians: the time t [s], the state s, the discrete state m, the parameters p
    and the settings o, also called time, state, memory, parameters and settings.

    name : str
    title : str, one line for reports
    inputs, states, outputs, metrics : made by the functions of these names
    clock : FixedStep or AdaptiveStep, the integrator
    initial : p, o; gives the first state
    rhs : gives the derivative of the state
    observe : gives the outputs, which histories show
    evaluate : best and when too, value and time of each extremum; gives the metrics that the engine does not compute
    events : dict of Event by name
    switch : hit too, which has 1.0 where an event fired; gives (state, discrete state) after events with the action
        "switch"
    memory : class of the discrete state, a named tuple with defaults, with which a case starts; or see `start`
    start : p, o; gives the first discrete state
    control : draws too; gives the next discrete state, at each sample, the first at t = 0
    extrema : dict of extremes that `evaluate` finds in `best` and `when`, such as {"force": maximum_of("force_n", "")}.
        Those of the metrics are there under the metrics' own names, without unit.
    prepare(inputs, settings, refusals) : dict, by the fields of `kernel_parameters`, of SI arrays or of numbers for all
        cases, such as {**vars(inputs), "burn_dv": dv}.  NumPy, for many cases at once: inputs and settings have an
        attribute for each symbol, `inputs.altitude` for altitude_km.  Cases that cannot start are added to `refusals`.
        An array "tables" [n, k] is put after the model's tables: a parameter must say where each case's begins.
    kernel_parameters : class of p, a named tuple; by default `inputs`
    tables(o) : float64[n], NumPy, numbers that all cases with the same settings share, such as a reference path;
        physics reads them with look_up(o.tables, index)
    source : str, the publication that the physics is from
    figures : tuple of figure records, such as `MapFigure`, that every report shows
    data : tuple of str, files that the model reads while it is imported, such as ("aero.csv", "tables/wind.csv"),
        inside its own folder.  They count as its source, and a run directory keeps copies of them.
    published : tuple of dict, published values to compare with

    Returns the Model that the engine reads.

    Raises ModelError where the declarations contradict one another.

    >>> [metric.name for metric in load_campaign("minimal").model.metrics]
    ['apogee_altitude_km', 'apogee_time_s', 'top_speed_m_s']
    """
    for what, record in (("inputs", inputs), ("states", states), ("outputs", outputs), ("metrics", metrics)):
        if not hasattr(record, "declared"):
            raise ModelError(f"`{what}` is {record!r}; declare it, {_DECLARATIONS[what]} = {what}(...)")
    listed = tuple(replace(event, name=key) for key, event in _events(events).items())
    tracked, places = _extrema(metrics, outputs, extrema or {})
    seen = _called("observe", observe)
    if memory is not None and start is None:
        start = _starting(memory)
    return Model(
        name=name,
        title=title,
        source=source,
        parameters=tuple(item for item in inputs.declared if isinstance(item, Parameter)),
        settings=tuple(item for item in inputs.declared if isinstance(item, Setting)),
        states=states.declared,
        quantities=outputs.declared,
        metrics=metrics.declared,
        clock=clock,
        kernel_parameters=kernel_parameters or inputs,
        initial=_called("initial", initial),
        rhs=_called("rhs", rhs),
        observe=seen,
        evaluate=_metrics(metrics, outputs, seen, evaluate, places),
        prepare=prepare,
        start=_called("start", start),
        control=_called("control", control),
        events=_event_functions(listed) if listed else None,
        switch=_called("switch", switch),
        event_list=listed,
        extrema=tracked,
        tables=tables,
        figures=figures,
        data=data,
        published=published,
    )


def _called(name: str, function: Any) -> Any:
    """The function as the engine calls it, with all arguments of `name` in their order."""
    given = ARGUMENTS[name].split(", ")
    if not callable(function) or list(inspect.signature(function).parameters) == given:
        return function  # what is no function, `source_faults` tells
    return ComposedFunction([_call(name, f"`{name}`", function)], written=function)


def _call(name: str, what: str, function: Any) -> Call:
    """A function and the indices of what it takes of the arguments of `name`; ModelError for one that there is not."""
    given = ARGUMENTS[name].split(", ")
    known = {**{word: word for word in given}, **{word: short for word, short in _LONG.items() if short in given}}
    chosen = []
    for argument in inspect.signature(function).parameters.values():
        if argument.name in known:
            chosen.append(given.index(known[argument.name]))
        else:
            code = getattr(inspect.unwrap(getattr(function, "function", function)), "__code__", None)
            where = f" in line {code.co_firstlineno}" if code else ""
            near = nearest(argument.name, known)
            meant = f'; did you mean "{near}"?' if near else ""
            raise ModelError(f'{what}{where} takes "{argument.name}"{meant}; a function takes what it names of '
                             f"{', '.join(given)}")  # fmt: skip
    return function, tuple(chosen)


def _events(events: Any) -> Mapping[str, Event]:
    if not isinstance(events, Mapping | None):
        raise ModelError('`events` is no dictionary; declare it so: events={"apogee": Event(climb_rate, "falling")}')
    for name, event in (events or {}).items():
        if not isinstance(event, Event) or not callable(event.function):
            raise ModelError(f'the event "{name}" has no function; declare it so: "{name}": Event(function, "falling")')
    return events or {}


def _event_functions(events: tuple[Event, ...]) -> ComposedFunction:
    calls = [_call("events", f'the function of the event "{event.name}"', event.function) for event in events]
    picks: list[Pick] = [("result", i, "") for i in range(len(events))]
    written = events[0].function if len(events) == 1 else None
    return ComposedFunction(calls, _tuple("Events", [event.name for event in events]), picks, written)


def _tuple(title: str, names: list[str]) -> Any:
    try:
        return namedtuple(title, names)
    except ValueError as error:
        raise ModelError(f"{title}: {error}; take letters, digits and _") from None


def _starting(memory: Any) -> PhysicsFunction:
    if len(getattr(memory, "_field_defaults", ())) != len(getattr(memory, "_fields", (None,))):
        raise ModelError("`memory` must be a named tuple with a default for each field, with which a case starts; or "
                         "write start(p, o), which gives the first one")  # fmt: skip

    @PhysicsFunction
    def start(p, o):
        return memory()

    return start


def _extrema(metrics: Any, outputs: Any, named: Mapping[str, Metric]) -> tuple[tuple[Extremum, ...], dict[str, str]]:
    """(the extremes that the flight tracks, each once; the name in `best` of each computed metric's)."""
    known = {item.name: item for item in outputs.declared} | {"t_s": _TIME}
    tracked: dict[Extremum, str] = {}
    symbols = {item.name: item.symbol for item in metrics.declared}
    units = {item.name: item.unit for item in metrics.declared}
    places = {}
    for key, metric in named.items():
        if not isinstance(metric, Metric) or metric.extremum is None:
            raise ModelError(f'the extremum "{key}" is {metric!r}; it must be maximum_of(...), minimum_of(...) or '
                             "last_above(...)")  # fmt: skip
        tracked[metric.extremum] = key
    for name, metric in metrics.computed.items():
        output = metric.output or getattr(metric.extremum, "quantity", "")
        if output not in known:
            raise ModelError(f'metric "{name}": there is no output "{output}"{hint(output, known)}')
        if output == _TIME.name and metric.source != "end":
            raise ModelError(f'metric "{name}": the time "t_s" has no extremum; use at_end')
        unit = "s" if metric.source == "time" else known[output].unit
        if UNITS[units[name]].quantity != UNITS[unit].quantity:
            raise ModelError(f'metric "{name}" is in "{units[name]}", but it holds a value in "{unit}"; change its '
                             "name or the output")  # fmt: skip
        if metric.extremum is not None:
            places[name] = tracked.setdefault(metric.extremum, symbols[name])
    return tuple(replace(extremum, name=name) for extremum, name in tracked.items()), places


def _metrics(metrics: Any, outputs: Any, observe: Any, evaluate: Any, places: Mapping[str, str]) -> Any:
    """The function that gives all metrics: those of `evaluate`, and those that the engine computes."""
    rest = [item.name for item in metrics.declared if item.name not in metrics.computed]
    if evaluate is None and rest:
        raise ModelError(f'nobody computes the metric "{rest[0]}"; write evaluate(...), which gives Metrics('
                         f"{metrics._fields[0]}=...), or declare it as maximum_of, at_end or the like")  # fmt: skip
    if evaluate is not None and not callable(evaluate):
        return evaluate
    outputs_by_name = {item.name: item.symbol for item in outputs.declared}
    arguments = ARGUMENTS["evaluate"].split(", ")
    picks: list[Pick] = []
    calls: list[Call] = [] if evaluate is None else [_call("evaluate", "`evaluate`", evaluate)]
    if any(metric.source == "end" and metric.output != _TIME.name for metric in metrics.computed.values()):
        calls.append((observe, tuple(range(len(ARGUMENTS["observe"].split(", "))))))
    for item in metrics.declared:
        metric = metrics.computed.get(item.name)
        if metric is None:
            picks.append(("result", 0, item.symbol))
        elif metric.extremum is not None:
            picks.append(("argument", arguments.index("best" if metric.source == "value" else "when"),
                          places[item.name]))  # fmt: skip
        elif metric.output == _TIME.name:
            picks.append(("argument", arguments.index("t"), ""))
        else:
            picks.append(("result", len(calls) - 1, outputs_by_name[metric.output]))
    symbols = [item.symbol for item in metrics.declared]
    return ComposedFunction(calls, _tuple("AllMetrics", symbols), picks, evaluate)
