"""What physics consists of: found by the names in its functions, without running or compiling them."""

import dis
from collections.abc import Iterable, Iterator
from types import CodeType, FunctionType, ModuleType, SimpleNamespace
from typing import Any

from mc_engine.lanes.composed import Alternatives, ComposedFunction
from mc_engine.lanes.kernel_data import DataBlock
from mc_engine.lanes.physics_function import PhysicsFunction


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
