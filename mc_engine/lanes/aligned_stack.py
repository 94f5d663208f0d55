"""The stack of a kernel on the boundary of a vector register.

A kernel has far more values than registers, and keeps the others on its stack.  LLVM decides whether a function puts
its stack on a boundary before it knows of these, so without an object that asks for it most of them lie across two
cache lines, by the chance of where the caller's stack ends: three times in four, and a quarter of the time then.
"""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

BOUNDARY = 64  # bytes: a cache line, and eight doubles


@intrinsic
def align_stack(typingctx):
    """Put the stack of the function that this is inlined into on the boundary."""

    def codegen(context, builder, sig, args):
        vector = ir.VectorType(ir.DoubleType(), 8)
        place = cgutils.alloca_once(builder, vector)
        place.align = BOUNDARY
        # an assembly that is given the place, and does nothing with it: nothing may remove the place
        kind = ir.FunctionType(ir.VoidType(), [place.type])
        builder.asm(kind, "", "r,~{memory}", [place], side_effect=True)
        return context.get_dummy_value()

    return types.none(), codegen
