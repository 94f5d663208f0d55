"""What a kernel takes from its model: the physics, defaults for functions left out, and selections of fields."""

from collections import namedtuple
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from importlib import import_module
from typing import Any, NamedTuple

from mc_engine.lanes import physics
from mc_engine.lanes.composed import Call, ComposedFunction, Pick, blocks_in, made_by, whole
from mc_engine.lanes.extrema import CORNER, EVENT, LAST, PEAK
from mc_engine.lanes.functions import TABLES
from mc_engine.lanes.kernel_data import Blocks, DataBlock
from mc_engine.model.fields import DIRECTIONS, AdaptiveStep, Extremum, Field, FixedStep
from mc_engine.model.phases import PHASE, at_first, noted_field, record_class
from mc_engine.model.reading import ARGUMENTS
from mc_engine.model.record import Model, NoMemory

# The physics of a model; whether the phase of a case is sampled, and intrinsics that pick or fill fields of tuples:
# peaks_of, lasts_of : from the outputs, the values of which peaks and last times above zero are wanted
# best_of, when_of : the model's extrema, from what the loop tracked;  smooth_of, kinds_of, signs_of : constants
# states_of, metrics_of : refuse to be compiled for another number of fields than the model declares
# stops_of, switches_of, notes_of : whether an event fired that ends the case, that calls `switch`, that calls `note`
Functions = namedtuple(
    "Functions",
    "initial start rhs control events switch note observe evaluate samples peaks_of lasts_of best_of when_of "
    "smooth_of kinds_of signs_of stops_of switches_of notes_of states_of metrics_of",
)
PHYSICS = Functions._fields[:9]
NoEvents = namedtuple("NoEvents", "unused")


@physics
def _no_start(p, o):
    return NoMemory(0.0)


@physics
def _no_control(t, s, m, p, o, draws):
    return m


@physics
def _always(t, s, m, p, o):
    return 1.0


@physics
def _no_events(t, s, m, p, o):
    return NoEvents(1.0)


@physics
def _no_switch(t, s, m, p, o, hit):
    return s, m


@physics
def _no_note(t, s, m, p, o, hit):
    return m


class Parts(NamedTuple):
    """What a kernel file needs from its model."""

    functions: Functions
    parameters: type
    settings: type
    has_events: bool
    must_stop: bool
    blocks: Blocks


def settings_class(model: Model) -> type:
    """Named tuple of the model's settings, by symbol, with its tables at the end if it has any."""
    names = [s.symbol for s in model.settings] or ["unused"]
    return namedtuple("Settings", [*names, TABLES] if model.tables else names)


def parts_of(model: Model, watching: bool, makers: Any = None) -> Parts:
    """Functions, tuple classes and flags of the model that a kernel is for.

    watching : of the model's events, see `watching_events`.  makers : see `functions_of`.
    """
    model = watching_events(model) if watching else model
    actions = [event.action for event in model.event_list]
    settings = settings_class(model)
    kinds = bool(actions), "stop" in actions
    return Parts(functions_of(model, makers), model.kernel_parameters, settings, *kinds, Blocks(blocks_of(model)))


@lru_cache(maxsize=64)
def blocks_of(model: Model) -> tuple[DataBlock, ...]:
    """The data that the physics of a model reads by their names, such as curves, in the order of its kernel."""
    return blocks_in(getattr(model, name) for name in PHYSICS)


def functions_of(model: Model, makers: Any = None) -> Functions:
    """The physics of a model, and picks of its fields as `makers` makes them: intrinsics by default."""
    makers = makers or import_module("mc_engine.lanes.model_intrinsics")  # which loads the compiler
    physics_of_model = (
        model.initial,
        model.start or _no_start,
        model.rhs,
        model.control or _no_control,
        model.events or _no_events,
        model.switch or _no_switch,
        model.note or _no_note,
        _with_phase(model, "observe"),
        _with_phase(model, "evaluate"),
        model.samples or _always,
    )
    return Functions(*(made_by(function, makers) for function in physics_of_model), *_picks(model, makers))


def _with_phase(model: Model, name: str) -> Any:
    """`observe` or `evaluate`; in a model with phases the number of the phase follows what it gives."""
    function, declared = getattr(model, name), model.quantities if name == "observe" else model.metrics
    if not model.phases:
        return function
    arguments = ARGUMENTS[name]
    picks: list[Pick] = [("result", 0, i) for i in range(len(declared))]
    picks.append(("argument", arguments.index("m"), PHASE))
    return ComposedFunction([(function, whole(range(len(arguments))))], tuple, picks, function)


def _picks(model: Model, makers: Any) -> list[Any]:
    names = [quantity.name for quantity in model.quantities]
    peaks = [e for e in model.extrema if e.kind in ("max", "min")]
    lasts = [e for e in model.extrema if e.kind == "last_above"]
    adaptive = isinstance(model.clock, AdaptiveStep)
    # on a grid a model without peaks or last times tracks its first output instead, so that no tuple of a loop is empty
    instead = [] if adaptive else [(0, 1.0, 0.0)]
    peak_picks = [(names.index(e.quantity), _sign(e), 0.0) for e in peaks] or instead
    last_picks = [(names.index(e.quantity), 1.0, e.level) for e in lasts] or instead
    n_events = max(1, len(model.event_list))
    first_peak = n_events if adaptive else 0
    best_picks, best_class = _tracked(model.extrema, peaks, lasts, first_peak, first_peak + len(peak_picks))
    smooth = [1.0 if e.smooth else 0.0 for e in peaks] or [0.0]
    kinds = [EVENT] * n_events + [PEAK if e.smooth else CORNER for e in peaks] + [LAST] * len(lasts)
    signs = [DIRECTIONS[e.direction] for e in model.event_list] or [-1.0]
    if adaptive:  # its events, peaks and last times are tracked as one
        signs += [-1.0] * (len(kinds) - n_events)
    actions = [event.action for event in model.event_list]
    return [
        makers.picker(None, peak_picks, len(names) + bool(model.phases)),
        makers.picker(None, last_picks, len(names) + bool(model.phases)),
        makers.picker(best_class, best_picks),
        makers.picker(best_class, [(i, 1.0, 0.0) for i, _, _ in best_picks]),
        makers.directions(smooth),
        makers.directions(kinds),
        makers.directions(signs),
        makers.any_of([i for i, action in enumerate(actions) if action == "stop"]),
        makers.any_of([i for i, action in enumerate(actions) if action == "switch"]),
        makers.any_of([i for i in range(len(actions)) if model.note is not None]),
        makers.counted("initial", len(model.states)),
        makers.counted("evaluate", len(model.metrics) + bool(model.phases)),
    ]


def second_order_of(model: Model, makers: Any = None) -> tuple[Any, ...]:
    """Picks for a method of states of second order, by the `rates` of the model's clock, as `makers` makes them.

    Of a state or derivative the positions; in the same order their rates; of positions and rates in a row, a state.
    """
    assert isinstance(model.clock, FixedStep)
    makers = makers or import_module("mc_engine.lanes.model_intrinsics")  # which loads the compiler
    names = [state.symbol for state in model.states]
    pairs = [(names.index(position), names.index(rate)) for position, rate in model.clock.rates]
    order = [position for position, _ in pairs] + [rate for _, rate in pairs]

    def picker(fields: Sequence[int]) -> Any:
        return makers.picker(None, [(i, 1.0, 0.0) for i in fields], len(names))

    return (
        picker(order[: len(pairs)]),
        picker(order[len(pairs) :]),
        picker([order.index(i) for i in range(len(names))]),
    )


def tracking_of(model: Model) -> str:
    """The module of `mc_engine.lanes` by which a model on a fixed grid tracks its extremes, see `Method`.

    Only models with extremes that can lie between grid points pay for the polynomials of a multistep method.
    """
    assert isinstance(model.clock, FixedStep)
    between = any(extremum.smooth or extremum.kind == "last_above" for extremum in model.extrema)
    return "multistep" if between and model.clock.method != "rk4" else "fixed_step"


def _sign(extremum: Extremum) -> float:
    return -1.0 if extremum.kind == "min" else 1.0


def _tracked(
    extrema: Sequence[Extremum], peaks: list[Extremum], lasts: list[Extremum], first_peak: int, first_last: int
) -> tuple[list[tuple[int, float, float]], type]:
    """Place and sign of each extremum among the tracked values, and the named tuple that `evaluate` gets."""
    place = {e.name: first_peak + i for i, e in enumerate(peaks)}
    place |= {e.name: first_last + i for i, e in enumerate(lasts)}
    names = [e.name for e in extrema]
    best_class = namedtuple("Best", names or ["unused"])  # type: ignore[misc]
    return [(place[e.name], _sign(e), 0.0) for e in extrema] or [(0, 1.0, 0.0)], best_class


# ---- to check that each event can occur: their times are kept in the discrete state, behind that of the model

_OWN, _NAN = "own", float("nan")
_TIME, _MEMORY, _HIT = (ARGUMENTS["note"].index(name) for name in ("t", "m", "hit"))


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
        samples=model.samples and _of_own("rhs", model.samples),
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
    picks = list(whole(range(len(ARGUMENTS[name]))))
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
