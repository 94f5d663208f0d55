"""Validation of a model's record before it flies: names, units, options of events, numbers of the clock."""

import inspect
import json
from collections.abc import Callable, Iterable
from keyword import iskeyword
from math import inf
from typing import TYPE_CHECKING, Any

from mc_engine.errors import ModelError
from mc_engine.model.fields import (
    DIRECTIONS,
    EXTREMA,
    AdaptiveStep,
    Event,
    FixedStep,
    Named,
    Setting,
    refuse_other_types,
    uses_rates,
)
from mc_engine.model.figures import refuse_false_figures
from mc_engine.suggestions import hint, listed
from mc_engine.units import UNITS, unit_hint, unit_suffix

if TYPE_CHECKING:
    from mc_engine.model.record import Model
    from mc_engine.model.simulator import Simulator, System

_CASE_COLUMNS = ("case_id", "status", "reason", "end_time_s")  # the engine's own, of cases and of histories
_HISTORY_COLUMNS = ("case_id", "t_s")
_ACTIONS = ("stop", "switch")
_MOST_ATTEMPTS = 1e9  # of a case, as there are steps on a fixed grid: minutes of one core
_MULTISTEP = tuple(f"abm{order}" for order in range(8, 13)) + tuple(f"gj{order}" for order in range(6, 11))
METHODS = {"FixedStep": ("rk4", *_MULTISTEP), "AdaptiveStep": ("dop853", "tp86", "dp54")}


def refuse_contradictions(model: "Model") -> None:
    """ModelError with one sentence if the model contradicts itself or names something that does not exist."""
    refuse_other_types(model, "the model")
    records: tuple[Any, ...] = (*model.event_list, *model.extrema)
    for record in records:
        refuse_other_types(record, f'{type(record).__name__} "{record.name}"')
    refuse_other_types(model.clock, "the clock")
    for name, declared in (("states", model.states), ("outputs", model.quantities), ("metrics", model.metrics)):
        if not declared:
            raise ModelError(f"`{name}` is empty; a model has one at least")
    if not hasattr(model.kernel_parameters, "_fields"):
        raise ModelError("kernel_parameters must be a named tuple, whose fields are the parameters' names without unit")
    _refuse_false_numbers(model)
    _refuse_twice("input", [item.symbol for item in (*model.parameters, *model.settings)])
    _refuse_twice("extremum", [item.name for item in model.extrema])
    _refuse_twice("event", [item.name for item in model.event_list])
    outputs = [output.name for output in model.quantities]
    for extremum in model.extrema:
        _refuse_word("extremum", extremum.name)
        if extremum.quantity not in outputs:
            near = hint(extremum.quantity, outputs)
            raise ModelError(f'extremum "{extremum.name}": there is no output "{extremum.quantity}"{near}')
        if extremum.kind not in EXTREMA:
            raise ModelError(f'extremum "{extremum.name}" has the kind "{extremum.kind}"; known are {listed(EXTREMA)}')
    if model.control is not None and model.start is None:
        raise ModelError("the model has `control`, but no `memory`; give memory=Memory, a named tuple with a default "
                         "for each field, or write start(p, o), which gives the first one")  # fmt: skip
    for event in model.event_list:
        _refuse_event(event, model.switch is not None)
    settings, states = ([item.symbol for item in items] for items in (model.settings, model.states))
    _refuse_clock(model.clock, settings, states)
    if model.control is not None and isinstance(model.clock, AdaptiveStep) and model.clock.control_period == inf:
        raise ModelError("the model has `control`, but its clock no `control_period`: the only sample is at t = 0; "
                         "write AdaptiveStep(..., control_period=0.1), the time [s] between samples")  # fmt: skip


def refuse_false_simulator(simulator: "Simulator") -> None:
    """ModelError with one sentence if a simulator contradicts itself."""
    if not simulator.metrics:
        raise ModelError("`metrics` is empty; a simulator has one at least")
    _refuse_other_arguments("fly", simulator.fly, "inputs", "cases" if simulator.batch else "case")
    _refuse_other_arguments("start", simulator.start)
    _refuse_false_numbers(simulator)


def _refuse_other_arguments(name: str, function: Callable[..., Any] | None, *given: str) -> None:
    """ModelError for a function of a simulator that cannot be called with these arguments."""
    try:
        if function is not None:
            inspect.signature(function).bind(*given)
    except TypeError:
        raise ModelError(f"the engine calls {name}({', '.join(given)}), and `{name}` takes other arguments") from None
    except ValueError:  # of a compiled function, which may not tell
        return


def _refuse_false_numbers(system: "System") -> None:
    """ModelError for numbers, or figures of them, that neither a model nor a simulator can have."""
    inputs: tuple[Named, ...] = (*system.parameters, *system.settings)
    numbers: tuple[Any, ...] = (*inputs, *system.states, *system.quantities, *system.metrics)
    for item in numbers:
        refuse_other_types(item, f'{type(item).__name__} "{item.name}"')
    _refuse_half_letters(system, numbers)
    for item in numbers:
        refuse_name(item)
        _refuse_swapped(item)
    names, outputs = [item.name for item in (*inputs, *system.metrics)], [item.name for item in system.quantities]
    ends = [f"end_{state.name}" for state in system.states]
    columns = [*names, *ends]
    _refuse_taken("column", names, _CASE_COLUMNS)
    _refuse_taken("output", outputs, _HISTORY_COLUMNS)
    if getattr(system, "phases", ()):
        _refuse_taken("column", columns, ("end_phase",))
        _refuse_taken("output", outputs, ("phase",))
    for name in names:
        if name in ends:
            state = name.removeprefix("end_")
            raise ModelError(f'the column "{name}" is that of the state "{state}" at the end; take another name')
    _refuse_twice("column", columns)
    _refuse_twice("output", outputs)
    for setting in system.settings:
        _refuse_choice(setting)
    refuse_false_figures(system)


def _refuse_half_letters(system: "System", numbers: Iterable[Any]) -> None:
    """ModelError for text that cannot be written to a file: a lone UTF-16 surrogate."""
    texts = [system.name, system.title, system.source, system.figures, system.published, *map(vars, numbers)]
    try:
        json.dumps(texts, ensure_ascii=False, default=str).encode()
    except UnicodeEncodeError as error:
        before = error.object[: error.start][-30:].rpartition('"')[2]
        letter = error.object[error.start]
        raise ModelError(f'a text has {letter!a} after "{before}", which is no character; leave it out') from None


def refuse_name(item: Named) -> None:
    """ModelError for an unknown unit, or a name that does not end in its unit or is none in Python."""
    if item.unit not in UNITS:
        raise ModelError(f'"{item.name}" has the unit "{item.unit}"{unit_hint(item.unit)}')
    suffix = unit_suffix(item.unit)
    if not item.name.endswith(suffix):
        raise ModelError(f'"{item.name}" has the unit "{item.unit}", so that its name must end in "{suffix}"; '
                         "change the name or the unit")  # fmt: skip
    _refuse_word("name", item.symbol)


def _refuse_swapped(item: Named) -> None:
    """ModelError for a lower limit above the upper one."""
    low, high = getattr(item, "low", -inf), getattr(item, "high", inf)
    if low > high:
        raise ModelError(f'"{item.name}" has low={low:g}, which is above high={high:g}; swap them')


def _refuse_choice(setting: Setting) -> None:
    """ModelError for a setting whose own value is none of its words."""
    if setting.choices and str(setting.default) not in setting.choices:
        raise ModelError(f'setting "{setting.name}" has the default {setting.default!r}'
                         f"{hint(str(setting.default), setting.choices)}")  # fmt: skip


def _refuse_taken(what: str, names: list[str], reserved: tuple[str, ...]) -> None:
    """ModelError for a name that the engine's own columns have."""
    for name in names:
        if name in reserved:
            raise ModelError(f'the {what} "{name}" has the name of a column that every table has; take another')


def _refuse_word(what: str, name: str) -> None:
    """ModelError for a name that no field of a named tuple can have."""
    if not name.isidentifier() or iskeyword(name) or name.startswith("_"):
        raise ModelError(f'the {what} "{name}" is no name for a number in Python; take letters, digits and "_", '
                         "begin with a letter, and leave out words such as lambda and class")  # fmt: skip


def _refuse_event(event: Event, switches: bool) -> None:
    name = f'event "{event.name}"'
    _refuse_word("event", event.name)
    _refuse_unknown(f"{name} has the direction", event.direction, DIRECTIONS)
    _refuse_unknown(f"{name} has the action", event.action, _ACTIONS)
    if event.action == "switch" and not switches:
        raise ModelError(f'{name} has the action "switch", but the model has no function `switch`')


def _refuse_unknown(what: str, word: Any, known: Iterable[str]) -> None:
    if word not in tuple(known):
        raise ModelError(f'{what} "{word}"{hint(str(word), known)}')


def _refuse_clock(clock: FixedStep | AdaptiveStep, settings: list[str], states: list[str]) -> None:
    """ModelError for invalid numbers of the integrator.  settings, states : symbols that it may name."""
    kind = type(clock).__name__
    if clock.method not in METHODS[kind]:
        raise ModelError(f'the clock has the method "{clock.method}"; {kind} has {listed(METHODS[kind])}')
    _refuse_time("until", clock.until, settings)
    if isinstance(clock, FixedStep):
        _refuse_time("step", clock.step, settings)
        _refuse_time("control_every", clock.control_every, settings, least=1.0)
        if not isinstance(clock.control_every, str) and clock.control_every % 1 != 0:
            raise ModelError(f"the clock's `control_every` is {clock.control_every}; it counts steps, in whole numbers")
        if clock.rates or uses_rates(clock):
            _refuse_rates(clock, states)
        return
    _refuse_time("rtol", clock.rtol, settings, most=1.0)  # a fraction of the state
    if not callable(clock.control_period):
        _refuse_time("control_period", clock.control_period, settings, most=inf)
    _refuse_time("attempts", clock.attempts, [], least=1.0, most=_MOST_ATTEMPTS)
    _refuse_time("first_step", clock.first_step, [], least=0.0)
    _refuse_time("longest_step", clock.longest_step, settings, most=inf)
    tolerances = clock.atol if isinstance(clock.atol, tuple) else (clock.atol,) * len(states)
    if len(tolerances) != len(states):
        raise ModelError(f"the clock's `atol` has {len(tolerances)} numbers, the model {len(states)} states")
    for tolerance in tolerances:
        _refuse_time("atol", tolerance, [], least=0.0)


def _refuse_rates(clock: FixedStep, states: list[str]) -> None:
    """ModelError unless each state is in one pair of `rates`."""
    named = [name for pair in clock.rates for name in pair]
    for name in named:
        _refuse_unknown("the clock's `rates` have the state", name, states)
    if sorted(named) == sorted(states):
        return
    each = f'each of the states {listed(states)} in one pair, such as ("x", "vx") where vx is the derivative of x'
    fix = f'the method "{clock.method}" needs {each}; "abm11" is for any states'
    if not uses_rates(clock):
        fix = f'the method "{clock.method}" does not use them: leave `rates` out, or name {each}'
    raise ModelError(f"the clock's `rates` name {listed(named) or 'no state'}; {fix}")


def _refuse_time(name: str, value: Any, settings: list[str], least: float | None = None, most: float = 1e300) -> None:
    """ModelError unless a number of the clock is positive, or at least `least`, or the symbol of a setting."""
    if isinstance(value, str):
        if value not in settings:
            known = hint(value, settings) if settings else "; write a number without quotes"
            raise ModelError(
                f'the clock\'s `{name}` is "{value}", and no setting has this name without its unit{known}'
            )
        return
    allowed = "above 0" if least is None else f"at least {least:g}"
    allowed += f", and {most:,.0f} at most" if most <= _MOST_ATTEMPTS else ""
    if not (0.0 < value <= most if least is None else least <= value <= most):
        raise ModelError(f"the clock's `{name}` is {value!r}; it must be a number {allowed}")


def _refuse_twice(what: str, names: list[str]) -> None:
    """ModelError if a name occurs twice; inputs are compared by their names inside SI code, without unit."""
    for name in names:
        if names.count(name) > 1:
            raise ModelError(f'two {what}s of the model are called "{name}"; give each a name of its own')
