"""How compiled functions call one another: by numba's convention, and with access to the data of the kernel.

Every function that numba compiles takes, before its own arguments, the address of a slot for errors.  numba makes a
slot for each call.  Here the callers pass on their own slot, so that all functions in one call of a kernel have the
same one, on the stack of its thread.  The address of the kernel's data follows it in memory.  So physics reads data
without an argument for them, and without globals: many threads may fly different data through the same machine code.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.callconv import CPUCallConv, excinfo_ptr_t
from numba.core.compiler import Flags
from numba.core.cpu import CPUContext

from mc_engine.errors import ModelError

DATA = ir.DoubleType().as_pointer()
BLOCK = "mc_engine.block."  # begins the name of the constant that holds a block's index among the kernel's
_FRAME = ir.LiteralStructType([excinfo_ptr_t, DATA])  # slot for errors, data of the kernel


class _SharedSlot(CPUCallConv):
    """numba's calls, with the slot for errors that `_slot` gives."""

    def call_function(
        self, builder: Any, callee: Any, resty: Any, argtys: Any, args: Any, attrs: Any = None
    ) -> tuple[Any, Any]:
        """Called by numba to write a call; (status, result) as numba's own gives them."""
        result = cgutils.alloca_once(builder, self.get_return_type(resty).pointee)
        builder.store(cgutils.get_null_value(result.type.pointee), result)
        slot = self._slot(builder)
        values = self._get_arg_packer(argtys).as_arguments(builder, args)
        code = builder.call(callee, [result, slot, *values], attrs=tuple(attrs or ()))
        status = self._get_return_status(builder, code, builder.load(slot))
        return status, self.context.get_returned_value(builder, resty, builder.load(result))

    def _slot(self, builder: Any) -> Any:
        return self._get_excinfo_argument(builder.function)


class PartCalls(_SharedSlot):
    """Calls of the functions that kernels consist of."""

    def data(self, builder: Any) -> Any:
        """Address of the kernel's data."""
        frame = builder.bitcast(self._slot(builder), _FRAME.as_pointer())
        return builder.load(cgutils.gep_inbounds(builder, frame, 0, 1))


class KernelCalls(_SharedSlot):
    """Calls of a kernel itself, which has the frame on its stack."""

    def __init__(self, context: Any):
        super().__init__(context)
        self._frames: dict[Any, Any] = {}  # by function: numba's wrapper around the kernel is one of its own

    def hand_over(self, builder: Any, data: Any) -> None:
        """From here on `data` are the kernel's."""
        builder.store(data, cgutils.gep_inbounds(builder, self._frame(builder), 0, 1))

    def _slot(self, builder: Any) -> Any:
        return cgutils.gep_inbounds(builder, self._frame(builder), 0, 0)

    def _frame(self, builder: Any) -> Any:
        function = builder.function
        if function not in self._frames:
            self._frames[function] = cgutils.alloca_once(builder, _FRAME, name="frame")
        return self._frames[function]


class _Context(CPUContext):
    """numba's target with calls of our own."""

    calls: Any
    is_fresh: bool

    @property
    def call_conv(self) -> Any:
        return self.calls

    def refresh(self) -> None:
        """Called by numba, for each call that it lowers, to take over what modules have registered meanwhile.

        Once is enough: lowering a function imports none.
        """
        if not self.is_fresh:
            super().refresh()
            self.is_fresh = True

    def get_constant_generic(self, builder: Any, ty: Any, val: Any) -> Any:
        """A constant, and nothing in place of the address of a function's dispatcher.

        Its type alone says which function is called.  An address counts in this process only, and a kernel that hands
        one on to a part could not be kept on disk.
        """
        if isinstance(ty, types.Dispatcher):
            return ir.Constant(self.get_value_type(ty), None)
        return super().get_constant_generic(builder, ty, val)

    def _compile_subroutine_no_cache(
        self, builder: Any, impl: Any, sig: Any, locals: Any = None, flags: Any = None
    ) -> Any:
        """Called by numba for functions of its own inside of ours, such as 1 / x of a negative power.

        numba would let them raise where x is zero, which lanes cannot: a case is to be the same alone and among others.
        """
        if flags is None:
            flags = Flags()
            flags.error_model = "numpy"
        return super()._compile_subroutine_no_cache(builder, impl, sig, locals, flags)


def calling_by(calls: type[_SharedSlot], context: Any) -> None:
    """Let the functions that are compiled in this context, one compilation's own, call others in this way."""
    context.__class__ = _Context
    context.calls, context.is_fresh = calls(context), False


def refuse_missing_blocks(module: Any) -> None:
    """ModelError where a kernel reads data that it is not handed; undefined, their index would be any number."""
    if any(variable.is_declaration and variable.name.startswith(BLOCK) for variable in module.global_variables):
        raise ModelError("the physics reads a curve or other data that were not found by the names in its functions; "
                         "let the function name them itself, at the top of its module")  # fmt: skip
