"""Phases of a flight, events with a delayed action, and metrics at events.

Their data are fields of the discrete state, after the model's own: the number of the phase and the time it began, the
time at which the action of a delayed event is due, and the time and outputs at an event.  A `Memory` names these
fields.  Its methods make the functions for the engine's loops, which know only events and a discrete state.
"""

from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from mc_engine.errors import ModelError
from mc_engine.lanes.composed import Alternatives, Call, ComposedFunction, Pick, whole
from mc_engine.lanes.functions import where
from mc_engine.lanes.physics_function import physics
from mc_engine.model.fields import Event
from mc_engine.suggestions import hint

PHASE, BEGAN = "in_phase", "phase_began"  # fields of the discrete state
NEVER, _NAN = 1e300, float("nan")
_TIME, _STATE, _MEMORY, _PARAMETERS, _SETTINGS, _LAST = range(6)  # of the arguments; the last are draws or hit
_ALL = tuple(range(6))


@dataclass(frozen=True)
class Phase:
    """A phase of flight with its own right-hand side: phases={"rail": Phase(slide, events={...}), ...}.

    A case begins in the first phase of the dictionary.  An event with `to` begins another phase.  The functions of a
    phase are not computed while no case of the vector is in it.

    rhs : returns the derivative of the state, as in `model`
    control : returns the next discrete state at each sample in this phase; without it the discrete state stays the same
    events : dict of Event by name, detected in this phase.  The same event may be in several phases.

    >>> Phase(rhs=None, events={"ground": Event(None, "falling")}).events["ground"].action
    'stop'
    """

    rhs: Callable[..., Any]
    control: Callable[..., Any] | None = None
    events: Mapping[str, Event] = field(default_factory=dict)


@physics
def _duration(t, began):
    return t - began


@physics
def _flag(number, wanted):
    return where(number == wanted, 1.0, 0.0)


@physics
def _flag_of_either(before, number, wanted):
    return where(number == wanted, 1.0, before)


@physics
def _acted(due, crossing, after):
    """Flag of the action of a delayed event: without a delay it is that of the crossing."""
    return where(after <= 0.0, crossing, due)


@physics
def _due(due, crossing, acted, t, after):
    """Time at which the delayed action is due; a further crossing during the delay changes nothing."""
    due = where(acted > 0.5, NEVER, due)
    ahead = where(t + after > t, t + after, t + 4e-16 * abs(t) + 1e-300)  # a step cannot end before it begins
    ahead = where(after == after, ahead, after)
    return where((crossing > 0.5) & (acted < 0.5) & (due == NEVER), ahead, due)


@physics
def _since_due(t, due):
    return where(due == NEVER, -1.0, t - due)


@physics
def _moved(before, acted, after):
    return where(acted > 0.5, after, before)


@physics
def at_first(noted, first, hit, value):
    """The noted number of an event: `value` if it happens now for the first time; `first`, its time, tells that."""
    return where((hit > 0.5) & (first != first), value, noted)


@physics
def _as_it_is(t, s, m, p, o, draws):
    return m


class Memory:
    """The discrete state of a model: its own fields, followed by those of the engine.

    own : class of the model's own discrete state, None if it has none
    phases : by name, empty for a model without
    events : all declared, by name
    noted : (event, symbol of an output or "" for the time), for each metric that is a value or time at an event
    """

    def __init__(
        self, own: Any, phases: Mapping[str, Phase], events: Mapping[str, Event], noted: Sequence[tuple[str, str]]
    ):
        self.own, self.phases, self.events = own, dict(phases), dict(events)
        self.delayed = {name: event for name, event in events.items() if event.after != 0.0}
        self.values = [pair for pair in dict.fromkeys(noted) if pair[1]]
        self.times = list(dict.fromkeys(event for event, _ in noted))
        self.kept: dict[str, float] = {PHASE: 0.0, BEGAN: 0.0} if phases else {}
        self.kept |= {due_field(name): NEVER for name in self.delayed}
        self.kept |= {noted_field(name): _NAN for name in self.times}
        self.kept |= {noted_field(*pair): _NAN for pair in self.values}
        self._own_fields = getattr(own, "_fields", ())
        self.record: Any = record_class("Memory", [*self._own_fields, *self.kept])

    def handed(self, calls: list[Call], argument: str, time: int, memory: int) -> Pick:
        """What "since" or "phase" stands for, by calls that are added before that of the function which takes it.

        time, memory : indices among its arguments.
        """
        number: Pick = ("argument", memory, PHASE)
        if argument == "since":
            calls.append((_duration, (("argument", time, ""), ("argument", memory, BEGAN))))
            return ("result", len(calls) - 1, "")
        first = len(calls)
        calls += [(_flag, (number, ("constant", float(k), ""))) for k in range(len(self.phases))]
        made = ComposedFunction([], record_class("Phases", [*self.phases]), whole(range(len(self.phases))))
        calls.append((made, tuple(("result", first + k, "") for k in range(len(self.phases)))))
        return ("result", len(calls) - 1, "")

    def start(self, start: Any) -> ComposedFunction:
        """The first discrete state.  start : gives the model's own fields."""
        calls: list[Call] = [(start, whole(range(2)))] if self._own_fields else []
        own: list[Pick] = [("result", 0, name) for name in self._own_fields]
        return ComposedFunction(calls, self.record, [*own, *(("constant", value, "") for value in self.kept.values())],
                                start)  # fmt: skip

    def rhs(self, functions: Sequence[Any]) -> Any:
        """The right-hand side of each case's phase."""
        return Alternatives(("argument", _MEMORY, PHASE), functions)

    def control(self, functions: Sequence[Any]) -> Any:
        """The sampled control of each case's phase; one for all in a model without phases.  None for no function."""
        if not any(functions):
            return None
        made = [_as_it_is if function is None else self._kept_by(function) for function in functions]
        return Alternatives(("argument", _MEMORY, PHASE), made) if self.phases else made[0]

    def samples(self, functions: Sequence[Any]) -> ComposedFunction | None:
        """1.0 in the phases that have a control, 0.0 in the others; None where all have one, or none.

        functions : the controls, None for a phase without.
        """
        if all(functions) or not any(functions):
            return None
        calls: list[Call] = []
        flag: Pick = ("constant", 0.0, "")
        for k in (k for k, function in enumerate(functions) if function is not None):
            calls.append((_flag_of_either, (flag, ("argument", _MEMORY, PHASE), ("constant", float(k), ""))))
            flag = ("result", len(calls) - 1, "")
        return ComposedFunction(calls)

    def _kept_by(self, function: Any) -> ComposedFunction:
        picks: list[Pick] = [("result", 0, name) for name in self._own_fields]
        picks += [("argument", _MEMORY, name) for name in self.kept]
        return ComposedFunction([(function, whole(_ALL))], self.record, picks, function)

    def watched(self, calls: Mapping[str, Call]) -> Any:
        """The functions of all events, and the time since the action of each delayed one was due.

        calls : of the events' own functions, by name.  In another phase an event is a constant.
        """
        if self.phases:
            parts = [self._watched_in(phase.events, calls) for phase in self.phases.values()]
            watched: Any = Alternatives(("argument", _MEMORY, PHASE), parts)
        else:
            watched = self._watched_in(self.events, calls)
        if not self.delayed:
            return watched
        since: list[Call] = [
            (_since_due, (("argument", _TIME, ""), ("argument", _MEMORY, due_field(name)))) for name in self.delayed
        ]
        picks: list[Pick] = [("result", 0, name) for name in self.events]
        picks += [("result", 1 + i, "") for i in range(len(since))]
        both = record_class("Events", [event.name for event in self.event_list()])
        return ComposedFunction([(watched, whole(range(5))), *since], both, picks)

    def _watched_in(self, events: Mapping[str, Event], calls: Mapping[str, Call]) -> ComposedFunction:
        """The functions of all events; one that is not among `events` is constant, on the side before its crossing.

        Events with the same function share its call, which may give a record of them.
        """
        own = list(dict.fromkeys(calls[name] for name in self.events if name in events))
        picks: list[Pick] = []
        for name, event in self.events.items():
            before = -1.0 if event.direction == "rising" else 1.0
            field = name if sum(calls[name] == call for call in calls.values()) > 1 else ""
            picks.append(("result", own.index(calls[name]), field) if name in events else ("constant", before, ""))
        only = own[0][0] if own and len({*calls.values()}) == 1 else None
        return ComposedFunction(own, record_class("Events", [*self.events]), picks, only)

    def event_list(self) -> tuple[Event, ...]:
        """The events of the loops: a delayed one is two, its crossing and its action."""
        crossings = [
            replace(event, name=name, action="switch") if name in self.delayed else replace(event, name=name)
            for name, event in self.events.items()
        ]
        actions = [
            replace(event, name=due_field(name), direction="rising", after=0.0, rare=True)
            for name, event in self.delayed.items()
        ]
        return (*crossings, *actions)

    def switch(self, function: Any) -> ComposedFunction | None:
        """The effects of events: the model's own `switch`, the next phase, delays that begin and end.  None without."""
        if function is None and not self.delayed and not any(event.to for event in self.events.values()):
            return None
        steps = _Steps()
        acted: dict[str, Pick] = {name: ("argument", _LAST, name) for name in self.events}
        crossings = {name: acted[name] for name in self.delayed}
        delays = {name: self._delay(event) for name, event in self.delayed.items()}
        for name, event in self.delayed.items():
            acted[name] = ("argument", _LAST, due_field(name))
            if event.action != "stop":  # which only the event of its own time does
                acted[name] = steps.add(_acted, acted[name], crossings[name], delays[name])
        state: Pick = ("argument", _STATE, "")
        now: dict[str, Pick] = {name: ("argument", _MEMORY, name) for name in self.record._fields}
        if function is not None:
            given = self._own_switch(steps, function, acted)
            state = (*given[:2], 0)
            if self._own_fields:
                copied = steps.add(self._only_own(), (*given[:2], 1))
                now |= {name: (*copied[:2], name) for name in self._own_fields}
        t: Pick = ("argument", _TIME, "")
        for name, crossing in crossings.items():
            now[due_field(name)] = steps.add(_due, now[due_field(name)], crossing, acted[name], t, delays[name])
        for name, event in reversed(self.events.items()):  # of two at once, the first decides
            if event.to:
                number: Pick = ("constant", float([*self.phases].index(event.to)), "")
                now[PHASE] = steps.add(_moved, now[PHASE], acted[name], number)
                now[BEGAN] = steps.add(_moved, now[BEGAN], acted[name], t)
        memory = steps.add(ComposedFunction([], self.record, whole(range(len(now)))), *now.values())
        return ComposedFunction(steps.calls, tuple, [state, memory], function)

    @staticmethod
    def _delay(event: Event) -> Pick:
        if isinstance(event.after, str):
            return ("argument", _PARAMETERS, event.after)
        return ("constant", float(event.after), "")

    def _own_switch(self, steps: "_Steps", function: Any, acted: Mapping[str, Pick]) -> Pick:
        """(state, the model's own fields) after its `switch`, which is not called for the mere crossing of an event."""
        own: list[Call] = [(self._only_own(), (("result", 0, 1),))] if self._own_fields else []
        picks: list[Pick] = [("result", 0, 0), *([("result", 1, "")] if own else [])]
        called: Any = ComposedFunction([(function, whole(_ALL)), *own], tuple, picks, function)
        arguments = list(whole(range(5)))
        if not self.delayed:
            return steps.add(called, *arguments, ("argument", _LAST, ""))
        hit = steps.add(ComposedFunction([], record_class("Hit", [*acted]), whole(range(len(acted)))), *acted.values())
        any_acted = next(iter(acted.values()))
        for pick in acted.values():
            any_acted = steps.add(_moved, any_acted, pick, ("constant", 1.0, ""))
        before: list[Call] = [(self._only_own(), whole([_MEMORY]))] if self._own_fields else []
        kept = ComposedFunction(before, tuple, [("argument", _STATE, ""), *([("result", 0, "")] if before else [])])
        return steps.add(Alternatives(("argument", 6, ""), (kept, called)), *arguments, hit, any_acted)

    def _only_own(self) -> ComposedFunction:
        """Of a discrete state, the model's own fields."""
        return ComposedFunction([], self.own, [("argument", 0, name) for name in self._own_fields])

    def note(self, observe: Any, symbols: Sequence[str]) -> ComposedFunction | None:
        """The function that notes time and outputs when an event first happens.  None if nothing is noted."""
        if not self.times:
            return None
        steps = _Steps()
        now: dict[str, Pick] = {name: ("argument", _MEMORY, name) for name in self.record._fields}
        first = {name: now[noted_field(name)] for name in self.times}
        seen: Pick = steps.add(observe, *whole(range(5))) if self.values else ("", 0, "")
        for event, symbol in [*self.values, *((name, "") for name in self.times)]:
            value: Pick = (*seen[:2], list(symbols).index(symbol)) if symbol else ("argument", _TIME, "")
            name, hit = noted_field(event, symbol), ("argument", _LAST, event)
            now[name] = steps.add(at_first, now[name], first[event], hit, value)
        return ComposedFunction(steps.calls, self.record, [*now.values()])


class _Steps:
    """Calls one after another, as a `ComposedFunction` makes them."""

    def __init__(self) -> None:
        self.calls: list[Call] = []

    def add(self, function: Any, *handed: Pick) -> Pick:
        """Add a call; returns what stands for its result."""
        self.calls.append((function, handed))
        return ("result", len(self.calls) - 1, "")


def due_field(event: str) -> str:
    """The field of the discrete state, and the event of the loops, for the action of a delayed event."""
    return f"{event}_due"


def noted_field(event: str, symbol: str = "") -> str:
    """The field of the discrete state for the time of an event, or for an output at it."""
    return f"{symbol}_at_{event}" if symbol else f"time_of_{event}"


def record_class(title: str, names: Sequence[str]) -> Any:
    """A named tuple; ModelError for names that it cannot have."""
    if twice := next((name for name in names if names.count(name) > 1), ""):
        raise ModelError(f'{title}: the field "{twice}" is there twice; the engine keeps the time of an event as '
                         "`time_of_EVENT` and what is due as `EVENT_due`: take another name")  # fmt: skip
    try:
        return namedtuple(title, names)
    except ValueError as error:
        raise ModelError(f"{title}: {error}; take letters, digits and _") from None


# ---- what is declared


def events_of(phases: Mapping[str, Phase], events: Mapping[str, Event]) -> dict[str, Event]:
    """All events, each once; ModelError where phases and events contradict one another."""
    for name, phase in phases.items():
        if not isinstance(phase, Phase):
            raise ModelError(f'the phase "{name}" is {phase!r}; declare it so: "{name}": Phase(rhs=..., events=...)')
        if isinstance(phase.control, Mapping):
            raise ModelError(f'the phase "{name}" has a dictionary as its control; say what it is: '
                             "Phase(rhs, events={...})")  # fmt: skip
    all_events = dict(events)
    for name, phase in phases.items():
        for event_name, event in checked_events(phase.events).items():
            if all_events.setdefault(event_name, event) != event:
                raise ModelError(f'the phase "{name}" has another event "{event_name}" than a phase before; give it a '
                                 "name of its own, or declare it once and hand it to both phases")  # fmt: skip
    for name, event in all_events.items():
        _refuse_event(name, event, phases)
    _refuse_unreached(phases)
    return all_events


def checked_events(events: Any) -> Mapping[str, Event]:
    """The events, a dictionary; ModelError for anything else."""
    if not isinstance(events, Mapping | None):
        raise ModelError('`events` is no dictionary; declare it so: events={"apogee": Event(climb_rate, "falling")}')
    for name, event in (events or {}).items():
        if not isinstance(event, Event) or not callable(event.function):
            raise ModelError(f'the event "{name}" has no function; declare it so: "{name}": Event(function, "falling")')
    return events or {}


def _refuse_event(name: str, event: Event, phases: Mapping[str, Phase]) -> None:
    if event.to and not phases:
        raise ModelError(f'the event "{name}" begins the phase "{event.to}", but the model has no phases; declare '
                         f'them: phases={{"{event.to}": Phase(rhs=..., events=...)}}')  # fmt: skip
    if event.to and event.to not in phases:
        raise ModelError(f'the event "{name}" begins the phase "{event.to}", which there is not'
                         f"{hint(event.to, phases)}")  # fmt: skip
    if event.to and event.action != "switch":
        raise ModelError(f'the event "{name}" has the action "{event.action}" and begins the phase "{event.to}"; '
                         "leave one of them out")  # fmt: skip
    if not isinstance(event.after, str) and not 0.0 <= event.after < NEVER:
        raise ModelError(f'the event "{name}" acts after {event.after!r} s; a delay is a number not below 0, or the '
                         "name of a parameter without its unit")  # fmt: skip


def _refuse_unreached(phases: Mapping[str, Phase]) -> None:
    reached, waiting = set[str](), [*phases][:1]
    while waiting:
        name = waiting.pop()
        if name not in reached:
            reached.add(name)
            waiting += [event.to for event in phases[name].events.values() if event.to]
    for name in phases:
        if name not in reached:
            raise ModelError(f'no event begins the phase "{name}"; let one of a phase before it do so: '
                             f'Event(..., to="{name}"), or leave the phase out')  # fmt: skip
