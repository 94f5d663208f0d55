"""Physics put together from the functions of a model: each is handed the arguments that it names.

The engine's loops call every function with the same arguments in the same order.  A `ComposedFunction` hands each of
its parts those that it asks for, and gathers their results in one record.  Kernels compile it to these calls alone
(`mc_engine.lanes.model_intrinsics`): no copy, no other operation, the same bits.

`Alternatives` are functions of which each case has its own, such as the right-hand sides of phases.  A function of
which no lane of a vector has need is not run; a lane's result is chosen, never mixed, so that it has the same bits
beside any other.
"""

import functools
from collections.abc import Callable, Sequence
from typing import Any

from mc_engine.lanes.functions import any_lane, where
from mc_engine.lanes.physics_function import PhysicsFunction

# A value by its origin: "argument" or "result" of an earlier call, its index, and the field of it (by name, or by index
# in a plain tuple) or "" for all of it; or "constant", the number, "".  A plain number is taken whole.
Pick = tuple[str, Any, str | int]
Call = tuple[Callable[..., Any], tuple[Pick, ...]]  # a function, and what it is handed


class ComposedFunction(PhysicsFunction):
    """Physics that calls others, one after another.

    calls : the functions, each with what it is handed
    record : class of the result's named tuple, or tuple; None where the result is that of the last call
    picks : one for each field of the record
    written : the function of the model that a message about this one names; None where there are several
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
    """Physics that is function k where a number among the arguments is k.

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
