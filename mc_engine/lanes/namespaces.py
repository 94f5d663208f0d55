"""Classes and namespaces with constants and functions of physics: compiled code reads their attributes as constants.

`Earth.mu` of a class `Earth`, and `EARTH.mu` of `EARTH = SimpleNamespace(mu=...)`, work in kernels as `constants.mu` of
a module `constants` does.
"""

from types import SimpleNamespace
from typing import Any

from numba import types
from numba.core.registry import cpu_target
from numba.core.typing.typeof import typeof_impl

_HEAP_TYPE = 1 << 9  # set of a class that is made by a statement, Py_TPFLAGS_HEAPTYPE
_type_of_class = typeof_impl.dispatch(type)


class Namespace(types.Module):
    """The numba type of one class or namespace: a module to numba, whose attributes are constants."""

    @property
    def key(self) -> int:
        """By identity: namespaces have no hash."""
        return id(self.pymod)


@typeof_impl.register(type)
def _of_class(value: Any, context: Any) -> Any:
    """What numba knows a class as, and a namespace where it knows none."""
    known = _type_of_class(value, context)
    if known is not None or not value.__flags__ & _HEAP_TYPE:
        return known
    return Namespace(value) if cpu_target.typing_context._lookup_global(value) is None else None


@typeof_impl.register(SimpleNamespace)
def _of_namespace(value: Any, context: Any) -> Any:
    return Namespace(value)
