"""A model while its events are watched: the same flight, with the time of each event as a metric.

The times are kept in the discrete state, behind that of the model, which is one field.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from mc_engine.lanes.composed import Call, ComposedFunction, Pick, whole
from mc_engine.model.fields import Field
from mc_engine.model.phases import at_first, noted_field, record_class
from mc_engine.model.reading import ARGUMENTS
from mc_engine.model.record import Model

_OWN, _NAN = "own", float("nan")
_TIME, _MEMORY, _HIT = (ARGUMENTS["note"].split(", ").index(name) for name in ("t", "m", "hit"))


def watching_events(model: Model) -> Model:
    """The same flight, with the functions of the events as outputs, and as metrics `time_of_<event>` the times [s] at
    which they first happen, NaN where they do not.  The model must have events."""
    assert model.events is not None
    names = [event.name for event in model.event_list]
    times = [noted_field(name) for name in names]
    memory = record_class("Memory", [_OWN, *times])
    kept: list[Pick] = [("argument", _MEMORY, name) for name in times]
    events = _of_own("events", model.events)
    return replace(
        model,
        start=_starting(model.start, memory, len(times)),
        rhs=_of_own("rhs", model.rhs),
        control=model.control and _of_own("control", model.control, memory, kept),
        events=events,
        switch=model.switch and _switching(model.switch, memory, kept),
        note=_noting(model.note, memory, names),
        quantities=tuple(Field("the event's function", name=name, unit="") for name in names),
        observe=events,
        metrics=tuple(Field("time of an event", name=name, unit="") for name in times),
        evaluate=ComposedFunction([], record_class("Times", times), kept),
        phases=(),
        extrema=(),
        figures=(),
        published=(),
        watching=True,
    )


def _own_call(name: str, function: Callable[..., Any]) -> Call:
    """A call of a function of the model, with its own discrete state."""
    picks = list(whole(range(len(ARGUMENTS[name].split(", ")))))
    picks[_MEMORY] = ("argument", _MEMORY, _OWN)
    return function, tuple(picks)


def _of_own(
    name: str, function: Callable[..., Any], memory: Any = None, kept: list[Pick] | None = None
) -> ComposedFunction:
    """A function of the model, with its own discrete state; with `memory`, that record of what it gives and `kept`."""
    picks: list[Pick] = [("result", 0, ""), *(kept or [])]
    return ComposedFunction([_own_call(name, function)], memory, picks if memory else (), function)


def _starting(start: Callable[..., Any] | None, memory: Any, n_times: int) -> ComposedFunction:
    calls: list[Call] = [(start, whole(range(2)))] if start else []
    own: Pick = ("result", 0, "") if start else ("constant", 0.0, "")
    return ComposedFunction(calls, memory, [own, *[("constant", _NAN, "")] * n_times], start)


def _switching(switch: Callable[..., Any], memory: Any, kept: list[Pick]) -> ComposedFunction:
    made = ComposedFunction([], memory, whole(range(1 + len(kept))))
    calls: list[Call] = [_own_call("switch", switch), (made, (("result", 0, 1), *kept))]
    return ComposedFunction(calls, tuple, [("result", 0, 0), ("result", 1, "")], switch)


def _noting(note: Callable[..., Any] | None, memory: Any, names: list[str]) -> ComposedFunction:
    calls: list[Call] = [_own_call("note", note)] if note else []
    picks: list[Pick] = [("result", 0, "") if note else ("argument", _MEMORY, _OWN)]
    for name in names:
        noted: Pick = ("argument", _MEMORY, noted_field(name))
        picks.append(("result", len(calls), ""))
        calls.append((at_first, (noted, noted, ("argument", _HIT, name), ("argument", _TIME, ""))))
    return ComposedFunction(calls, memory, picks)
