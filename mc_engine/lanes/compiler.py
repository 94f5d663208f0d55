"""Compiler flags and decorators: the only module that sets options of numba."""

from collections.abc import Callable
from typing import Any

from numba import config, njit, types
from numba.core.compiler_lock import global_compiler_lock

from mc_engine.errors import ModelError
from mc_engine.lanes import kernel_data_lowering as _kernel_data  # registers what reads the data of a kernel
from mc_engine.lanes import lowering as _lowering  # registers the lane type and its functions
from mc_engine.lanes import records as _records  # registers records, and classes that hold constants
from mc_engine.lanes.kernel_cache import Form
from mc_engine.lanes.linked import KernelCompiler, LinkedCompiler

# numpy's error model: 1/0 is infinite, as in the vector instructions.  No fastmath and no contraction:
# a case has the same bits alone and among seven others.
STRICT: dict[str, Any] = {"error_model": "numpy", "boundscheck": False, "fastmath": False}

# together these spare more than half of the time of compilation
_UNWRAPPED: dict[str, Any] = {
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    "_nrt": False,  # no counting of references: what they allocate is on the stack
    "pipeline_class": LinkedCompiler,
}

_KERNEL: dict[str, Any] = {**_UNWRAPPED, "pipeline_class": KernelCompiler}

if config.DISABLE_JIT:  # type: ignore[attr-defined]
    raise ModelError("the environment has NUMBA_DISABLE_JIT, with which no kernel can be compiled; unset it")
assert _kernel_data
assert _lowering
assert _records


def compile_inline(function: Callable[..., Any]) -> Any:
    """Dispatcher for physics and loops that are inlined into the kernel; never called from Python, so unwrapped."""
    return njit(forceinline=True, **_UNWRAPPED, **STRICT)(function)


def compile_callable(function: Callable[..., Any]) -> Any:
    """Dispatcher for code that several places of a kernel share without copying it: histories, and events in a step.

    A call keeps the compiler from computing once what both sides need.  Adaptive flights, which start a new case or
    change one in every few rounds, take 5 to 40 % longer where these parts are shared, and 3 to 6 % longer where the
    steps of their histories are, so theirs are inlined.
    """
    # numba takes over what is not set here from the function that calls
    return njit(forceinline=False, **_UNWRAPPED, **STRICT)(function)


class KernelCompilation:
    """A function that becomes a kernel, which `mc_engine.lanes.kernel_cache.Kernel` loads and calls without numba."""

    def __init__(self, function: Callable[..., Any]):
        self.dispatcher: Any = njit(**_KERNEL, **STRICT)(function)

    def library(self, form: Form) -> tuple[str, Any]:
        """(name of the kernel in its library, library) for arguments of a form."""
        self.dispatcher._compilation_chain_init_hook()
        with global_compiler_lock:
            compiled = self.dispatcher._compiler.compile(tuple(_type(word) for word in form), None)
        if compiled.fndesc.restype != types.none:
            name = self.dispatcher.py_func.__qualname__
            raise ModelError(f"{name} returns something; its results have to be written into arrays that it is handed")
        return compiled.fndesc.llvm_func_name, compiled.library


def compile_kernel(function: Callable[..., Any]) -> KernelCompilation:
    """Mark a function as a kernel."""
    return KernelCompilation(function)


def _type(word: str) -> Any:
    """numba's type of an argument."""
    number, bracket, _ = word.partition("[")
    kind = getattr(types, number)
    return types.Array(kind, 1 + ("," in word), "C") if bracket else kind
