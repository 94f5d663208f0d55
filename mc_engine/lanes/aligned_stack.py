"""Alignment of a kernel's stack to the size of a vector register.

A kernel has more values than registers and keeps the others on its stack.  LLVM fixes the alignment of the stack before
it knows of these values.  Without an object that asks for the alignment, most of them cross a cache line in three of
four calls, depending on the caller's stack, and the kernel takes a quarter longer.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

BOUNDARY = 64  # bytes: a cache line, and eight doubles


@intrinsic
def align_stack(typingctx):
    """Put the stack of the function that this is inlined into on the boundary."""

    def codegen(context, builder, sig, args):
        align(builder)
        return context.get_dummy_value()

    return types.none(), codegen


def align(builder: Any) -> None:
    """Put the stack of the function that is being built on the boundary."""
    vector = ir.VectorType(ir.DoubleType(), 8)
    place = cgutils.alloca_once(builder, vector)
    place.align = BOUNDARY
    # an assembly that is given the place, and does nothing with it: nothing may remove the place
    kind = ir.FunctionType(ir.VoidType(), [place.type])
    builder.asm(kind, "", "r,~{memory}", [place], side_effect=True)
