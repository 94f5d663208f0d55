"""Memory for the stages of a Runge-Kutta step: derivatives of all lanes, and weighted sums of them.

A high-order method has a dozen stages.  Written out, each would contain a copy of the right-hand side and its own
sums.  With the stages in memory, the step of any method is a short loop, which compiles as fast as RK4.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel.models import PrimitiveModel
from numba.extending import intrinsic, register_model

from mc_engine.lanes.lane_type import I64, common_width
from mc_engine.lanes.lowering import constant, fused, llvm_type


class StageMemory(types.Type):
    """`count` derivatives of a state of `fields`, in the frame of the function that asked for them."""

    def __init__(self, fields: Any, count: int):
        self.fields, self.count = fields, count
        super().__init__(name=f"stage_memory({fields}, {count})")


@register_model(StageMemory)
class StageMemoryModel(PrimitiveModel):
    """A pointer to the first stage's first field."""

    def __init__(self, manager: Any, memory: Any):
        width = common_width(*memory.fields)
        super().__init__(manager, memory, llvm_type(width).as_pointer())


@intrinsic(prefer_literal=True)
def stage_memory(typingctx, like, count):
    """Room for `count` (a literal) derivatives of a state like this one."""
    result = StageMemory(like, count.literal_value)

    def codegen(context, builder, sig, args):
        element = llvm_type(common_width(*like))
        size = ir.Constant(I64, len(like) * result.count)
        with builder.goto_entry_block():
            return builder.alloca(element, size=size)

    return result(like, count), codegen


def _place(builder: Any, memory: Any, pointer: Any, stage: Any, field: int) -> Any:
    n_fields = ir.Constant(I64, len(memory.fields))
    offset = builder.add(builder.mul(stage, n_fields), ir.Constant(I64, field))
    return builder.gep(pointer, [offset])


@intrinsic
def put_stage(typingctx, memory, stage, derivative):
    """Keep a derivative as number `stage`."""

    def codegen(context, builder, sig, args):
        for i in range(len(derivative)):
            value = builder.extract_value(args[2], i)
            builder.store(value, _place(builder, memory, args[0], args[1], i))
        return context.get_dummy_value()

    return types.none(memory, types.intp, derivative), codegen


@intrinsic
def take_stage(typingctx, memory, stage, like):
    """The derivative number `stage`, as a tuple like `like`."""

    def codegen(context, builder, sig, args):
        packed = ir.Constant(context.get_value_type(like), ir.Undefined)
        for i in range(len(like)):
            value = builder.load(_place(builder, memory, args[0], args[1], i))
            packed = builder.insert_value(packed, value, i)
        return packed

    return like(memory, types.intp, like), codegen


@intrinsic
def stage_sum(typingctx, memory, like, first, last, columns, weights):
    """Sum of weights[e] times stage columns[e] for first <= e < last, as a tuple like `like`.

    columns : int64[n], weights : float64[n].  The terms are added in their order.
    """

    def codegen(context, builder, sig, args):
        width = common_width(*like)
        sums = [cgutils.alloca_once_value(builder, constant(width, 0.0)) for _ in range(len(like))]
        column_data = context.make_array(columns)(context, builder, args[4]).data
        weight_data = context.make_array(weights)(context, builder, args[5]).data
        with cgutils.for_range_slice(builder, args[2], args[3], ir.Constant(I64, 1), I64) as (entry, _):
            stage = builder.load(builder.gep(column_data, [entry]))
            weight = _splat(builder, builder.load(builder.gep(weight_data, [entry])), width)
            for i, total in enumerate(sums):
                value = builder.load(_place(builder, memory, args[0], stage, i))
                builder.store(fused(builder, width, [weight, value, builder.load(total)]), total)
        packed = ir.Constant(context.get_value_type(like), ir.Undefined)
        for i, total in enumerate(sums):
            packed = builder.insert_value(packed, builder.load(total), i)
        return packed

    return like(memory, like, types.intp, types.intp, columns, weights), codegen


@intrinsic
def stage_sums(typingctx, memory, like, first, last, columns, weights):
    """Two sums of one pass, as `stage_sum`, which have the weights[0] and the weights[1]: tuples like `like`.

    Stages may have more fields than `like`: the first are summed.  weights : float64[2, n]
    """
    result = types.UniTuple(like, 2)

    def codegen(context, builder, sig, args):
        width = common_width(*like)
        sums = [[cgutils.alloca_once_value(builder, constant(width, 0.0)) for _ in range(len(like))] for _ in range(2)]
        column_data = context.make_array(columns)(context, builder, args[4]).data
        table = context.make_array(weights)(context, builder, args[5])
        second = builder.gep(table.data, [builder.extract_value(table.shape, 1)])
        with cgutils.for_range_slice(builder, args[2], args[3], ir.Constant(I64, 1), I64) as (entry, _):
            stage = builder.load(builder.gep(column_data, [entry]))
            values = [builder.load(_place(builder, memory, args[0], stage, i)) for i in range(len(like))]
            for row, totals in zip((table.data, second), sums, strict=True):
                weight = _splat(builder, builder.load(builder.gep(row, [entry])), width)
                for value, total in zip(values, totals, strict=True):
                    builder.store(fused(builder, width, [weight, value, builder.load(total)]), total)
        packed = [ir.Constant(context.get_value_type(like), ir.Undefined)] * 2
        for row, totals in enumerate(sums):
            for i, total in enumerate(totals):
                packed[row] = builder.insert_value(packed[row], builder.load(total), i)
        return context.make_tuple(builder, result, packed)

    return result(memory, like, types.intp, types.intp, columns, weights), codegen


def _splat(builder: Any, value: Any, width: int) -> Any:
    from mc_engine.lanes.lane_type import splat

    return splat(builder, value, width) if width > 1 else value
