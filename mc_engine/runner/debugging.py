"""One case flown by Python, which stops in the user's debugger, in a line of the model's physics.

A debugger stops in the function that calls `breakpoint()`.  Therefore a function of the model in which a flight is to
stop is replaced, during the flight, by the same function with one more statement: `if due: breakpoint()`.
"""

import ast
import builtins
import contextlib
import io
import sys
from collections.abc import Callable, Iterable, Iterator
from copy import deepcopy
from dataclasses import dataclass
from functools import partial
from importlib.abc import InspectLoader
from inspect import unwrap
from types import CellType, CodeType, FunctionType
from typing import Any

from mc_engine.errors import ModelError
from mc_engine.flight.flight import fly_interpreted, prepare
from mc_engine.flight.interpreted import InterpretedFlight
from mc_engine.flight.lost_numbers import origin_of
from mc_engine.lanes.number import Origin, Place, numbers
from mc_engine.lanes.physics_function import PhysicsFunction
from mc_engine.model.phases import due_field
from mc_engine.model.reading import FOR_DEBUGGING, code_of, definition_of, functions_of_model, source_faults
from mc_engine.model.record import Model
from mc_engine.status import STATUS_NAME


@dataclass(frozen=True)
class Stop:
    """Where a flight is to stop; by default in the first call of `rhs`.

    time : [s], in the first call of `rhs` at this time or later
    event : name of the event after which it stops: in `switch`, in the next right-hand side if the model has no
        `switch`, or in `observe` and `evaluate` if the event ends the case
    not_finite : at the line whose result ended the flight as not finite, or made a metric NaN
    """

    time: float | None = None
    event: str | None = None
    not_finite: bool = False


@dataclass
class Debugged:
    """How a debugged flight ended: status, end time [s], metrics in declared units, whether it reached the stop."""

    status: str
    end_time: float
    metrics: dict[str, float]
    stopped: bool


def fly_debugged(
    model: Model, inputs: dict[str, Any], noise: int, seed: int, stop: Stop | None, tell: Callable[[str], None]
) -> Debugged:
    """Fly one case, stopping where `stop` says; without a stop, only at the model's own `breakpoint()`.

    inputs : every parameter and setting, in declared units.  noise : see `mc_engine.flight.flyer.Flyer.fly`.
    tell : called with a line on the function and the time before it stops.
    ModelError if the physics has other faults than `print` and `breakpoint()`, or the case cannot start.  What the
    debugger raises to leave, such as bdb.BdbQuit, passes through.
    """
    faults = [fault for fault in source_faults(model) if not fault.endswith(FOR_DEBUGGING)]
    if faults:
        raise ModelError(faults[0])
    refusals = prepare(model, inputs, 1).refusals
    if refusals.mask[0]:
        raise ModelError(f"the case cannot start: {refusals.reason[0]}")
    flight = _StoppingFlight(model, stop, tell)
    functions: list[tuple[PhysicsFunction, int]] = []
    if stop is not None and stop.not_finite:
        flight.origin_call, places = _breaking_call(model, inputs, noise, seed)
        functions = _stopped_at(model, places) if flight.origin_call >= 0 else []
    elif stop is not None:
        functions = [(physics, 0) for physics in _written(model, flight.functions)]
    with _stopping(functions, flight.is_due):
        time, status, _, metrics = fly_interpreted(flight, inputs, noise, seed)
    # the last row of a model with phases is none of a metric
    names = {field.name: row[0] / field.si_factor for field, row in zip(model.metrics, metrics, strict=False)}
    return Debugged(STATUS_NAME[int(status[0])], float(time[0]), names, flight.stopped)


def has_own_stops(model: Model) -> bool:
    """Whether the physics has a `print` or a `breakpoint()` of its own."""
    return any(fault.endswith(FOR_DEBUGGING) for fault in source_faults(model))


class _StoppingFlight(InterpretedFlight):
    """Knows before each call of a function of the model whether it is the one to stop in.

    functions : what the engine calls those in which it may stop.  origin_call : index of the call that made the number.
    """

    def __init__(self, model: Model, stop: Stop | None, tell: Callable[[str], None]):
        self.stopped, self.origin_call = False, -1
        self._tell = tell
        self._stop, self._calls, self._due, self._event = stop, 0, False, -1
        self.functions: tuple[str, ...] = () if stop is None else ("rhs",)
        if stop is not None and stop.event is not None:
            event = next(event for event in model.event_list if event.name == stop.event)
            self._event = model.event_list.index(event)
            self.functions = ("switch",) if event.action == "switch" else ("observe", "evaluate")
            acts_later = due_field(event.name) in [other.name for other in model.event_list]
            if acts_later or not _written(model, self.functions):  # or the event begins a phase, and nothing else
                self.functions = ("rhs",)
        super().__init__(model)

    def call(self, name: str, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        stop, self._calls = self._stop, self._calls + 1
        if stop is not None and not self.stopped:
            if stop.not_finite:
                self._due = self._calls == self.origin_call
            elif stop.event is None and name == "rhs":
                self._due = stop.time is None or arguments[0] >= stop.time
        # with Numbers at once: what is printed is printed once, and a quotient by zero is infinite as in kernels
        return function(*(numbers(argument) for argument in arguments))

    def unset(self, function: Callable[..., Any], f: Any, *arguments: Any) -> Any:
        with _silent():
            return super().unset(function, f, *arguments)

    def any_of(self, indices: Any) -> Callable[[Any], Any]:
        def has_fired(masks: Any) -> bool:
            if not self.stopped and self._event >= 0 and masks[self._event]:
                self._due = True
            return any(masks[i] for i in indices)

        return has_fired

    def is_due(self, name: str) -> bool:
        """Whether to stop here; asked in the functions of the model, each by its name."""
        due, self._due = self._due, False
        if due:
            self.stopped = True
            self._tell(f"stopped in `{name}` at t = {self.t:.9g} s")
        return due


class _NotingFlight(InterpretedFlight):
    """Notes which call of a function made each number that is not finite."""

    def __init__(self, model: Model):
        self.calls = 0
        self.made: dict[int, tuple[Origin, int]] = {}  # by the identity of the origin, which is kept alive
        super().__init__(model)

    def call(self, name: str, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        self.calls += 1
        result = super().call(name, function, arguments)
        for value in _flattened(result):
            if origin := getattr(value, "origin", None):
                self.made.setdefault(id(origin), (origin, self.calls))
        return result


def _flattened(value: Any) -> Iterator[Any]:
    if isinstance(value, tuple):
        for item in value:
            yield from _flattened(item)
    else:
        yield value


def _breaking_call(model: Model, inputs: dict[str, Any], noise: int, seed: int) -> tuple[int, tuple[Place, ...]]:
    """(index of the call that made the number which broke the flight, its places); (-1, ()) where none did."""
    flight = _NotingFlight(model)
    with _silent():
        _, status, _, _ = fly_interpreted(flight, inputs, noise, seed)
    origin, _ = origin_of(flight, int(status[0]))
    if origin is None:
        return -1, ()
    return flight.made.get(id(origin), (origin, flight.calls))[1], origin.places


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """Within the block the model's own `print` and `breakpoint()` do nothing."""
    hook = sys.breakpointhook
    try:
        sys.breakpointhook = lambda *_, **__: None
        with contextlib.redirect_stdout(io.StringIO()):
            yield
    finally:
        sys.breakpointhook = hook


def _stopped_at(model: Model, places: Iterable[Place]) -> list[tuple[PhysicsFunction, int]]:
    """The function of the model in which a number was lost, and the line; all functions where none holds the line."""
    known = _reachable(_written(model))
    for place in places:
        for physics in known:
            code = code_of(physics)
            if code and code.co_filename == place.file and place.line in {line for *_, line in code.co_lines()}:
                return [(physics, place.line)]
    return [(physics, 0) for physics in _written(model)]


def _written(model: Model, names: Iterable[str] = ()) -> list[PhysicsFunction]:
    """The physics of the model that the engine calls by these names; all of it without."""
    return [
        function
        for name, function in functions_of_model(model)
        if isinstance(function, PhysicsFunction) and (not names or name in names)
    ]


def _reachable(functions: Iterable[PhysicsFunction]) -> list[PhysicsFunction]:
    """These and all physics that they name."""
    reached, waiting = [], list(functions)
    while waiting:
        physics = waiting.pop()
        if physics not in reached:
            reached.append(physics)
            function = unwrap(physics.function)
            cells = [cell.cell_contents for cell in function.__closure__ or ()]
            named = [function.__globals__.get(name) for name in function.__code__.co_names]
            waiting += [value for value in (*cells, *named) if isinstance(value, PhysicsFunction)]
    return reached


@contextlib.contextmanager
def _stopping(functions: Iterable[tuple[PhysicsFunction, int]], is_due: Callable[[str], bool]) -> Iterator[None]:
    """Within the block these functions stop where `is_due(name)`: before a line of theirs, at their beginning for 0."""
    before = [(physics, physics.function) for physics, _ in functions]
    try:
        for physics, line in functions:
            physics.function = _with_stop(unwrap(physics.function), line, is_due)
        yield
    finally:
        for physics, function in before:
            physics.function = function


def _with_stop(function: Any, line: int, is_due: Callable[[str], bool]) -> Any:
    """The function with `if is_due(): breakpoint()` before the statement of a line, or as its first statement."""
    definition = definition_of(function.__code__)
    if not isinstance(definition, ast.FunctionDef):
        return function
    own = deepcopy(definition)
    own.decorator_list = []
    body, index = _position(own.body, line) if line else (own.body, int(ast.get_docstring(own) is not None))
    stop = ast.parse("if __is_due__(): __breakpoint__()").body[0]
    # a debugger shows the line of the call; before Python 3.13 the next, so that the call has one above the function
    shown = body[index].lineno if sys.version_info >= (3, 13) and index < len(body) else max(own.lineno - 1, 1)
    for node in ast.walk(stop):
        if isinstance(node, ast.stmt | ast.expr):
            node.lineno = node.end_lineno = shown
    body.insert(index, stop)
    given = {"__is_due__": partial(is_due, function.__name__), "__breakpoint__": builtins.breakpoint}
    given |= {
        name: cell.cell_contents
        for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
    }
    outer = ast.parse(f"def outer({', '.join(given)}): pass").body[0]
    assert isinstance(outer, ast.FunctionDef)
    outer.body = [own]
    module = ast.fix_missing_locations(ast.Module([outer], []))
    made: CodeType = InspectLoader.source_to_code(module, function.__code__.co_filename)
    code = _code_in(_code_in(made, "outer"), own.name)
    cells = tuple(CellType(given[name]) for name in code.co_freevars)
    return FunctionType(code, function.__globals__, function.__name__, function.__defaults__, cells)


def _position(body: list[ast.stmt], line: int) -> tuple[list[ast.stmt], int]:
    """The innermost list of statements that holds a line, and the index of the statement."""
    index = next((i for i, node in enumerate(body) if line <= (node.end_lineno or node.lineno)), len(body) - 1)
    for name in ("body", "orelse", "finalbody"):
        inner = getattr(body[index], name, None)
        if inner and inner[0].lineno <= line <= (inner[-1].end_lineno or line):
            return _position(inner, line)
    return body, index


def _code_in(code: CodeType, name: str) -> CodeType:
    return next(item for item in code.co_consts if isinstance(item, CodeType) and item.co_name == name)
