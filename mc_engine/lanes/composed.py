"""Physics composed of several functions of a model, each called with the arguments that it names.

The engine's loops call every function with the same arguments in the same order.  A `ComposedFunction` passes to each
of its parts the arguments that it names, and collects their results in one record.  Kernels compile it to these calls
alone (`mc_engine.lanes.model_intrinsics`), without copies or other operations, so the bits are the same.

`Alternatives` are functions of which each case uses one, such as the right-hand sides of phases.  A function that no
lane of a vector needs is not run.  The result of a lane is selected, never blended, so its bits do not depend on the
other lanes.

`blocks_in` and `has_powers` find the data that physics reads, and its powers, by the names in its functions, without
running or compiling them.
"""

import dis
import functools
from collections.abc import Callable, Iterable, Iterator, Sequence
from types import CodeType, FunctionType, ModuleType, SimpleNamespace
from typing import Any

from mc_engine.lanes.functions import any_lane, where
from mc_engine.lanes.kernel_data import DataBlock
from mc_engine.lanes.physics_function import PhysicsFunction

# A value by its origin: "argument" or "result" of an earlier call, its index, and the field of it (by name, or by index
# in a plain tuple) or "" for all of it; or "constant", the number, "".  A plain number is taken whole.
Pick = tuple[str, Any, str | int]
Call = tuple[Callable[..., Any], tuple[Pick, ...]]  # a function, and what it is handed


class ComposedFunction(PhysicsFunction):
    """Physics that calls other functions, one after another.

    calls : the functions, each with its arguments
    record : class of the result's named tuple, or tuple; None if the result is that of the last call
    picks : one for each field of the record
    written : the function of the model that error messages name; None if there are several
    """

    def __init__(
        self,
        calls: Sequence[Call],
        record: Any = None,
        picks: Sequence[Pick] = (),
        written: Callable[..., Any] | None = None,
    ):
        self.calls, self.record, self.picks = tuple(calls), record, tuple(picks)
        self.written = written
        self.function = getattr(written, "function", written) or self.__call__
        if written is not None:
            functools.update_wrapper(self, self.function, updated=())

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        results: list[Any] = []
        for function, chosen in self.calls:
            results.append(function(*(value_of(pick, arguments, results) for pick in chosen)))
        if self.record is None:
            return results[-1]
        values = [value_of(pick, arguments, results) for pick in self.picks]
        return tuple(values) if self.record is tuple else self.record(*values)

    @property
    def parts(self) -> tuple[Callable[..., Any], ...]:
        """The functions that it calls."""
        return tuple(function for function, _ in self.calls)

    def made_by(self, makers: Any) -> Any:
        """See `made_by`."""
        calls = tuple((made_by(part, makers), chosen) for part, chosen in self.calls)
        return makers.composed(calls, self.record, self.picks)


class Alternatives(PhysicsFunction):
    """Physics that calls function k in lanes where one of its arguments is k.

    number : the field of an argument.  parts : functions of the same arguments, which give the same record.
    """

    def __init__(self, number: Pick, parts: Sequence[Callable[..., Any]]):
        self.number, self.parts = number, tuple(parts)
        self.function = self.__call__

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        number, chosen = value_of(self.number, arguments, ()), None
        for k, part in enumerate(self.parts):
            if any_lane(mask := number == float(k)):
                given = part(*arguments)
                chosen = given if chosen is None else _selected(mask, given, chosen)
        return chosen

    def made_by(self, makers: Any) -> Any:
        """See `made_by`."""
        return makers.alternatives(self.number, tuple(made_by(part, makers) for part in self.parts))


def value_of(pick: Pick, arguments: Sequence[Any], results: Sequence[Any]) -> Any:
    """The value that a pick stands for."""
    source, place, field = pick
    if source == "constant":
        return place
    whole = (arguments if source == "argument" else results)[place]
    if field == "" or not isinstance(whole, tuple):
        return whole
    return whole[field] if isinstance(field, int) else getattr(whole, field)


def whole(indices: Sequence[int]) -> tuple[Pick, ...]:
    """Picks of whole arguments."""
    return tuple(("argument", index, "") for index in indices)


def _selected(mask: Any, chosen: Any, other: Any) -> Any:
    if not isinstance(chosen, tuple):
        return where(mask, chosen, other)
    fields = [_selected(mask, *pair) for pair in zip(chosen, other, strict=True)]
    return type(chosen)(*fields) if hasattr(chosen, "_fields") else tuple(fields)


def made_by(function: Any, makers: Any) -> Any:
    """The function as kernels have it: what is put together by `makers`, see `mc_engine.flight.kernel_parts`."""
    return function.made_by(makers) if isinstance(function, ComposedFunction | Alternatives) else function


def blocks_in(functions: Iterable[Any]) -> tuple[DataBlock, ...]:
    """Blocks that these functions of physics name, or those that they call; each once.

    The order depends on the sources alone, so that a kernel that was compiled in another process finds them.
    """
    return tuple(value for value in _reached(functions) if isinstance(value, DataBlock))


def has_powers(functions: Iterable[Any]) -> bool:
    """Whether these functions, or those that they call, have an operator `**`, which Python and kernels round apart."""
    codes = [
        value.function.__code__
        for value in _reached(functions)
        if isinstance(value, PhysicsFunction) and isinstance(value.function, FunctionType)
    ]
    return any(step.argrepr in ("**", "**=") for code in codes for step in dis.get_instructions(code))


def _reached(functions: Iterable[Any]) -> list[Any]:
    found: dict[int, Any] = {}  # what was seen, by identity
    waiting = list(functions)[::-1]
    while waiting:
        value = waiting.pop()
        if id(value) in found or not isinstance(value, PhysicsFunction | DataBlock | tuple):
            continue
        found[id(value)] = value
        if isinstance(value, tuple):
            waiting += value[::-1]
        elif isinstance(value, ComposedFunction | Alternatives):
            waiting += value.parts[::-1]
        elif isinstance(value, PhysicsFunction) and isinstance(value.function, FunctionType):
            waiting += [*_named(value.function)][::-1]
    return [*found.values()]


def _named(function: FunctionType) -> Iterator[Any]:
    """The objects that a function names from outside, with those of its namespaces that it may name."""
    names = list(_names(function.__code__))
    outside = [function.__globals__[name] for name in names if name in function.__globals__]
    outside += [cell.cell_contents for cell in function.__closure__ or ()]
    for value in outside:
        yield value
        if isinstance(value, ModuleType | SimpleNamespace | type):
            yield from _held(value, names)


def _held(space: Any, names: list[str]) -> Iterator[Any]:
    for name in names:
        value = getattr(space, "__dict__", {}).get(name)
        yield value
        if isinstance(value, ModuleType | SimpleNamespace):  # a package's module, a namespace in a namespace
            yield from (vars(value).get(inner) for inner in names)


def _names(code: CodeType) -> Iterator[str]:
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)
