"""`model`: makes the record that the engine reads from the declarations of a model file.

A function of a model takes the arguments that it names, in any order, but the engine passes the same arguments to all.
So each function becomes a `ComposedFunction`, which passes on the arguments that it names.  The functions of events,
and the metrics that the engine computes, are composed in the same way.
"""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from mc_engine.errors import ModelError
from mc_engine.lanes.composed import Call, ComposedFunction, Pick, whole
from mc_engine.lanes.functions import TABLES
from mc_engine.lanes.physics_function import PhysicsFunction
from mc_engine.model.declarations import Metric
from mc_engine.model.fields import AdaptiveStep, Event, Extremum, Field, FixedStep, Parameter, Setting
from mc_engine.model.figures import Figure
from mc_engine.model.phases import Memory, Phase, checked_events, events_of, noted_field, record_class
from mc_engine.model.preparation import MISUSES, misuse
from mc_engine.model.reading import ARGUMENTS, code_of
from mc_engine.model.record import Model, Refusals
from mc_engine.suggestions import hint, nearest
from mc_engine.units import UNITS, compatible, units_at_the_end

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
    observe: Physics,
    rhs: Physics | None = None,
    phases: Mapping[str, Phase] | None = None,
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
    """The Model record of a model file, which ends with MODEL = model(...).

    Functions are marked with `mc_engine.lanes.physics`, except `prepare` and `tables`, which are NumPy code.  Each one
    takes the arguments that it names, in any order, in SI and radians: the time t [s], the state s, the discrete state
    m, the parameters p and the settings o.  The names time, state, memory, parameters and settings are allowed, too.
    Some functions take further arguments, see below.  `declared_in` collects the declarations of other files.

    name : str
    title : str, one line for reports
    inputs, states, outputs, metrics : made by the functions of these names
    clock : FixedStep or AdaptiveStep, the integrator
    initial : takes p and o alone; returns the first state
    rhs : returns the derivative of the state
    phases : dict of Phase by name, in place of `rhs`, `control` and `events`, which each phase then has of its own.  A
        case begins in the first.  Functions of such a model may also take `since`, the time [s] since the phase began,
        and `phase`, whose field is 1.0 for the phase that the case is in: `phase.rail`
    observe : returns the outputs, the columns of time histories
    evaluate : takes best and when, too: value and time of each extremum; returns the metrics not computed by the engine
    events : dict of Event by name.  Events with the same function share its call; it may return a named tuple, with a
        number for each of them by name.
    switch : takes hit, too, whose field is 1.0 for an event that acts; returns (state, discrete state) after events
        with the action "switch", and where a phase begins; there m, since and phase are those of the phase before
    memory : class of the discrete state, a named tuple of numbers, or of records of them; without `start`, a case
        starts with its default values
    start : takes p and o alone; returns the first discrete state.  A model with phases, delayed events or metrics at
        events must name its class in `memory`, too
    control : takes draws, too; returns the next discrete state at each sample, the first at t = 0
    extrema : dict of further extrema for `best` and `when`, such as {"force": maximum_of("force_n")}.  Extrema that are
        metrics are there under the names of the metrics, without unit; one of several metrics under that of the first.
    prepare(inputs, settings, refusals) : NumPy code for many cases; returns a dict with an SI array, or one number for
        all cases, for each field of `kernel_parameters`, such as {**vars(inputs), "burn_dv": dv}.  inputs and settings
        have attributes without unit, `inputs.altitude` for altitude_km.  Cases that cannot start go to `refusals`.
        An array "tables" [n, k] is put after the model's tables: a parameter must say where each case's begins.
    kernel_parameters : class of p, a named tuple; by default `inputs`; see `prepared`
    tables(o) : NumPy code; returns float64[n], numbers that cases with the same settings share, such as a reference
        path; physics reads them with look_up(o.tables, index), or as a named tuple look_up_record(o.tables, index, Row)
    source : str, the publication that the physics is from
    figures : tuple of figure records, such as `MapFigure`, that every report shows
    data : tuple of str, files in the model's folder that it reads while it is imported, such as ("aero.csv",
        "tables/wind.csv").  They are part of its source, and a run directory keeps copies of them.
    published : tuple of dict, published values to compare with

    Returns the Model that the engine reads.

    Raises ModelError where the declarations contradict one another.

    >>> [metric.name for metric in load_campaign("minimal").model.metrics]
    ['apogee_altitude_km', 'apogee_time_s', 'top_speed_m_s']
    """
    _refuse_undeclared(inputs=inputs, states=states, outputs=outputs, metrics=metrics)
    kernel_parameters = kernel_parameters or inputs
    phases = _phases(phases, rhs=rhs, control=control, events=events)
    declared = events_of(phases, checked_events(events))
    kept = _memory(memory, start, phases, declared, metrics, outputs)
    _refuse_idle_events(declared, switch, getattr(kernel_parameters, "_fields", ()))
    tracked, places = _extrema(metrics, outputs, extrema or {})
    seen = _called("observe", observe, kept)
    if memory is not None and start is None:
        start = _starting(memory)
    parts = [*phases.values()] if phases else [Phase(rhs, control)]  # type: ignore[arg-type]
    derivatives = [_called("rhs", part.rhs, kept) for part in parts]
    controls = [part.control and _called("control", part.control, kept) for part in parts]
    calls = {name: _call("events", f'the function of the event "{name}"', event.function, kept)
             for name, event in declared.items()}  # fmt: skip
    switch = _called("switch", switch, kept)
    start = _called("start", start, kept)
    return Model(
        name=name,
        title=title,
        source=source,
        parameters=tuple(item for item in inputs.declared if isinstance(item, Parameter)),
        settings=tuple(item for item in inputs.declared if isinstance(item, Setting)),
        states=states.declared,
        quantities=outputs.declared,
        metrics=_meant(metrics, outputs),
        clock=clock,
        kernel_parameters=kernel_parameters,
        initial=_called("initial", initial, kept),
        start=kept.start(start) if kept.kept else start,
        rhs=kept.rhs(derivatives) if phases else derivatives[0],
        control=kept.control(controls) if kept.kept else controls[0],
        samples=kept.samples(controls),
        events=kept.watched(calls) if calls else None,
        switch=kept.switch(switch) if kept.kept else switch,
        note=kept.note(seen, outputs._fields),
        observe=seen,
        evaluate=_metrics(metrics, outputs, seen, evaluate, places, kept),
        prepare=prepare,
        event_list=kept.event_list(),
        phases=tuple(phases),
        extrema=tracked,
        event_times=tuple(name for name, metric in metrics.computed.items() if metric.is_time),
        metric_outputs=tuple((name, of) for name, metric in metrics.computed.items() if (of := metric.of_output)),
        tables=tables,
        figures=figures,
        data=data,
        published=published,
    )


def prepared(prepare: Callable[..., Any], inputs: Any) -> Any:
    """The class of `p` for a model with `prepare`: model(..., kernel_parameters=prepared(prepare, Inputs)).

    prepare : see `model`; it is called once, for one case of the nominal inputs
    inputs : made by the function of this name

    Returns the named tuple, whose fields are the keys of what `prepare` returns.

    Raises ModelError if `prepare` misuses its arguments, or does not return a dictionary.

    >>> Inputs = inputs(altitude_km=Parameter(300.0, "altitude of the orbit"))
    >>> prepared(lambda inputs, settings, refusals: {"radius": 6378e3 + inputs.altitude}, Inputs)._fields
    ('radius',)
    """
    parameters, settings = SimpleNamespace(), SimpleNamespace()
    for item in inputs.declared:
        if isinstance(item, Setting):
            setattr(settings, item.symbol, np.full(1, item.code(item.default)))
        else:
            setattr(parameters, item.symbol, np.full(1, item.default * item.si_factor))
    try:
        with np.errstate(all="ignore"):
            given = prepare(parameters, settings, Refusals.none(1))
    except MISUSES as error:  # with its traceback, which leads to the line
        known = [item for item in inputs.declared if isinstance(item, Parameter)]
        raise ModelError(misuse(error, known)).with_traceback(error.__traceback__) from error
    if not isinstance(given, Mapping):
        raise ModelError(f"`prepare` gives {type(given).__name__}; it must return a dictionary of arrays, by the names "
                         "that physics reads from p")  # fmt: skip
    return record_class("Parameters", [name for name in given if name != TABLES])


def _refuse_undeclared(**records: Any) -> None:
    """ModelError for a record that the function of its name did not make."""
    for what, record in records.items():
        if not hasattr(record, "declared"):
            raise ModelError(f"`{what}` is {record!r}; declare it, {_DECLARATIONS[what]} = {what}(...)")
        if record.__name__ != _DECLARATIONS[what]:
            maker = next(name for name, title in _DECLARATIONS.items() if title == record.__name__)
            raise ModelError(f"`{what}` is what {maker}(...) made; hand over what {what}(...) made")


def _phases(phases: Any, **others: Any) -> Mapping[str, Phase]:
    """The phases by name; empty for a model with `rhs` in place of them.

    ModelError for a model with neither, or with phases and something that each phase has of its own.
    """
    if phases is None:
        if others["rhs"] is None:
            raise ModelError("the model has no `rhs`; write rhs(s), which gives the derivative of the state, or phases")
        return {}
    if not isinstance(phases, Mapping) or not phases:
        raise ModelError('`phases` is no dictionary; declare it so: phases={"rail": Phase(rhs=slide), ...}')
    for name, given in others.items():
        if given is not None:
            raise ModelError(f"the model has both `{name}` and `phases`; each phase has its own: Phase({name}=...)")
    record_class("Phases", [*phases])
    return phases


def _memory(
    memory: Any, start: Any, phases: Mapping[str, Phase], events: Mapping[str, Event], metrics: Any, outputs: Any
) -> Memory:
    """The discrete state with what the engine keeps in it for phases, delayed events and metrics at events."""
    if memory is not None and not isinstance(memory, type):
        raise ModelError(f"`memory` is {memory!r}; hand over its class, memory=Memory")
    symbols = {item.name: item.symbol for item in outputs.declared}
    noted = []
    for name, metric in metrics.computed.items():
        if metric.source != "event":
            continue
        if metric.event not in events:
            raise ModelError(f'metric "{name}": there is no event "{metric.event}"{hint(metric.event, events)}')
        noted.append((metric.event, symbols.get(metric.output, "")))
    kept = Memory(memory, phases, events, noted)
    controls = any(phase.control for phase in phases.values())
    if kept.kept and memory is None and (start is not None or controls):
        raise ModelError("the model has a discrete state; name its class, memory=Memory, beside phases, delayed events "
                         "and metrics at events")  # fmt: skip
    return kept


def _refuse_idle_events(events: Mapping[str, Event], switch: Any, parameters: tuple[str, ...]) -> None:
    """ModelError for an event that switches nothing, or waits for what is no parameter."""
    for name, event in events.items():
        if event.action == "switch" and not event.to and switch is None:
            raise ModelError(f'event "{name}" has the action "switch", but the model has no function `switch`; for an '
                             "event that is only noted, write one that returns (s, m)")  # fmt: skip
        if isinstance(event.after, str) and event.after not in parameters:
            raise ModelError(f'the event "{name}" acts after "{event.after}", and no parameter has this name without '
                             f"its unit{hint(event.after, parameters)}")  # fmt: skip


def _called(name: str, function: Any, kept: Memory) -> Any:
    """The function as the engine calls it, with all arguments of `name` in their order."""
    if not callable(function) or tuple(inspect.signature(function).parameters) == ARGUMENTS[name]:
        return function  # what is no function, `source_faults` tells
    called, picks = _call(name, f"`{name}`", function, kept)
    return ComposedFunction([(called, picks)], written=function)


def _call(name: str, what: str, function: Any, kept: Memory) -> Call:
    """A function and what it takes of the arguments of `name`; ModelError for an argument that there is not."""
    given = ARGUMENTS[name]
    known = {**{word: word for word in given}, **{word: short for word, short in _LONG.items() if short in given}}
    in_phase = ["since", "phase"] if kept.phases and {"t", "m"} <= {*given} else []
    calls: list[Call] = []
    chosen: list[Pick] = []
    taken = inspect.signature(function).parameters
    for argument in taken:
        if known.get(argument) in {*taken} - {argument}:
            raise ModelError(f'{what} takes "{known[argument]}" and "{argument}", which are the same; take one')
        if argument in known:
            chosen.append(("argument", given.index(known[argument]), ""))
        elif argument in in_phase:
            chosen.append(kept.handed(calls, argument, *map(given.index, "tm")))
        else:
            code = code_of(function)
            where = f" in line {code.co_firstlineno}" if code else ""
            near = nearest(argument, [*known, *in_phase])
            meant = f'; did you mean "{near}"?' if near else ""
            raise ModelError(f'{what}{where} takes "{argument}"{meant}; a function takes what it names of '
                             f"{', '.join([*given, *in_phase])}")  # fmt: skip
    if not calls:
        return function, tuple(chosen)
    return ComposedFunction([*calls, (function, tuple(chosen))], written=function), whole(range(len(given)))


def _starting(memory: Any) -> PhysicsFunction:
    if len(getattr(memory, "_field_defaults", ())) != len(getattr(memory, "_fields", (None,))):
        raise ModelError("`memory` must be a named tuple with a default for each field, with which a case starts; or "
                         "write start(p, o), which gives the first one")  # fmt: skip

    @PhysicsFunction
    def start(p, o):
        return memory()

    return start


def _meant(metrics: Any, outputs: Any) -> tuple[Field, ...]:
    """The metrics; one that the engine computes and that has no description gets one from its output's description."""
    words = {item.name: item.description for item in outputs.declared} | {_TIME.name: "time", "": "time"}
    fields = []
    for item in metrics.declared:
        metric = metrics.computed.get(item.name)
        if metric is not None and not item.description:
            output = metric.extremum.quantity if metric.extremum else metric.output
            item = replace(item, description=metric.meaning(words[output]))
        fields.append(item)
    return tuple(fields)


def _extrema(metrics: Any, outputs: Any, named: Mapping[str, Metric]) -> tuple[tuple[Extremum, ...], dict[str, str]]:
    """(the extremes that the flight tracks, each once; the name in `best` of each computed metric's)."""
    known = {item.name: item for item in outputs.declared} | {"t_s": _TIME}
    tracked: dict[Extremum, str] = {}
    fields = {item.name: item for item in metrics.declared}
    places = {}
    for key, metric in named.items():
        if not isinstance(metric, Metric) or metric.extremum is None:
            raise ModelError(f'the extremum "{key}" is {metric!r}; it must be maximum_of(...), minimum_of(...) or '
                             "last_above(...)")  # fmt: skip
        tracked[metric.extremum] = key
    for name, metric in metrics.computed.items():
        output = metric.output or getattr(metric.extremum, "quantity", _TIME.name)
        if not isinstance(output, str):
            raise ModelError(f'metric "{name}" is of the output {output!r}; the name of an output comes first, such as '
                             f'"{next(iter(known))}"')  # fmt: skip
        if output not in known:
            raise ModelError(f'metric "{name}": there is no output "{output}"{hint(output, known)}')
        if output == _TIME.name and metric.source not in ("end", "event"):
            raise ModelError(f'metric "{name}": the time "t_s" has no extremum; use at_end')
        unit = "s" if metric.source == "time" else known[output].unit
        if UNITS[fields[name].unit].quantity != UNITS[unit].quantity:
            meant = [f', or say unit="{ending}"' for ending in units_at_the_end(name) if ending in compatible(unit)]
            raise ModelError(f'metric "{name}" is in "{fields[name].unit}", but it holds a value in "{unit}"; change '
                             f"its name or the output{''.join(meant)}")  # fmt: skip
        if metric.extremum is not None:
            places[name] = tracked.setdefault(metric.extremum, fields[name].symbol)
    return tuple(replace(extremum, name=name) for extremum, name in tracked.items()), places


def _metrics(metrics: Any, outputs: Any, observe: Any, evaluate: Any, places: Mapping[str, str], kept: Memory) -> Any:
    """The function that gives all metrics: those of `evaluate`, and those that the engine computes."""
    rest = [item.name for item in metrics.declared if item.name not in metrics.computed]
    if evaluate is None and rest:
        raise ModelError(f'nobody computes the metric "{rest[0]}"; write evaluate(...), which gives Metrics('
                         f"{metrics._fields[0]}=...), or declare it as maximum_of, at_end or the like")  # fmt: skip
    if evaluate is not None and not callable(evaluate):
        return evaluate
    outputs_by_name = {item.name: item.symbol for item in outputs.declared}
    arguments = ARGUMENTS["evaluate"]
    picks: list[Pick] = []
    calls: list[Call] = [] if evaluate is None else [_call("evaluate", "`evaluate`", evaluate, kept)]
    if any(metric.source == "end" and metric.output != _TIME.name for metric in metrics.computed.values()):
        calls.append((observe, whole(range(len(ARGUMENTS["observe"])))))
    for item in metrics.declared:
        metric = metrics.computed.get(item.name)
        if metric is None:
            picks.append(("result", 0, item.symbol))
        elif metric.extremum is not None:
            picks.append(("argument", arguments.index("best" if metric.source == "value" else "when"),
                          places[item.name]))  # fmt: skip
        elif metric.source == "event":
            noted = noted_field(metric.event, outputs_by_name.get(metric.output, ""))
            picks.append(("argument", arguments.index("m"), noted))
        elif metric.output == _TIME.name:
            picks.append(("argument", arguments.index("t"), ""))
        else:
            picks.append(("result", len(calls) - 1, outputs_by_name[metric.output]))
    names = [item.name for item in metrics.declared]
    return ComposedFunction(calls, record_class("AllMetrics", names), picks, evaluate)
