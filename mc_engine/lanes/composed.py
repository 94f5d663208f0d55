"""Physics put together from the functions of a model: each is handed the arguments that it names.

The engine's loops call every function with the same arguments in the same order.  A `ComposedFunction` hands each of
its parts those that it asks for, and gathers their results in one record.  Kernels compile it to these calls alone
(`mc_engine.lanes.tuples.composed`): no copy, no other operation, the same bits.
"""

import functools
from collections.abc import Callable, Sequence
from typing import Any

from mc_engine.lanes.physics_function import PhysicsFunction

Call = tuple[Callable[..., Any], tuple[int, ...]]  # a function, and the indices of the arguments that it is handed
# Where a field of the record comes from: "argument" or "result", its index, and the field of it, or "" for all of it.
Pick = tuple[str, int, str]


class ComposedFunction(PhysicsFunction):
    """Physics that calls others.

    calls : the functions, each with the indices of the arguments that it is handed
    record : class of the result's named tuple; None where the result is that of the only call
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
        results = [function(*(arguments[index] for index in chosen)) for function, chosen in self.calls]
        if self.record is None:
            return results[0]
        given = {"argument": arguments, "result": results}
        values = ((given[source][index], field) for source, index, field in self.picks)
        return self.record(*(getattr(value, field) if field else value for value, field in values))


def made_by(function: Any, makers: Any) -> Any:
    """The function as kernels have it: composed ones by `makers`, see `mc_engine.flight.kernel_parts.functions_of`."""
    if not isinstance(function, ComposedFunction):
        return function
    calls = tuple((made_by(part, makers), chosen) for part, chosen in function.calls)
    return makers.composed(calls, function.record, function.picks)
