"""The decorator of compiled physics.

`physics` marks a function that is written once, on plain numbers.  Called from Python, it is interpreted, on floats or
NumPy arrays; 1/0 of floats is infinite, as in kernels.  Inside a kernel, it is compiled for one case and for vectors
of cases.  Nothing is compiled, and numba is not imported, before a kernel needs it.
"""

import functools
from collections.abc import Callable
from typing import Any

from mc_engine.errors import ModelError
from mc_engine.lanes.number import are_numbers, as_in_kernels


class PhysicsFunction:
    """A function on numbers that kernels can compile; made by `physics`.  `compiled` is its numba dispatcher."""

    def __init__(self, function: Callable[..., Any]):
        self.function = function
        functools.update_wrapper(self, function)

    def __call__(self, *args: Any, **named: Any) -> Any:
        try:
            return self.function(*args, **named)
        except ArithmeticError:
            if not are_numbers((*args, *named.values())):
                raise
            return as_in_kernels(self.function, args, named)

    @functools.cached_property
    def compiled(self) -> Any:
        """The numba dispatcher; one flag set for all physics, and no fastmath: every width has the same bits."""
        from mc_engine.lanes.compiler import compile_inline

        return compile_inline(self.function)

    @property
    def _numba_type_(self) -> Any:
        """What numba sees when compiled code names this function."""
        return self.compiled._numba_type_


def physics(function: Callable[..., Any] | None = None) -> PhysicsFunction:
    """Mark `function` as physics: numbers and named tuples in and out, functions from `mc_engine.lanes` inside."""
    if function is None:
        raise ModelError("@physics stands alone on the line above a function, without brackets")
    if not callable(function):
        raise ModelError(f"physics marks a function, not {function!r}")
    return PhysicsFunction(function)
