"""Access to single lanes: which of them differ, and columns of arrays, from which a lane takes its next case."""

import functools
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np import arrayobj

from mc_engine.lanes.lane_type import F64, I1, I32, I64, Lanes, common_width, mask_type
from mc_engine.lanes.lowering import llvm_type
from mc_engine.lanes.tuples import _item, _pack, _pointer


def _get(builder: Any, value: Any, ty: Any, lane: Any) -> Any:
    return builder.extract_element(value, builder.trunc(lane, I32)) if isinstance(ty, Lanes) else value


def _put(builder: Any, value: Any, ty: Any, lane: Any, number: Any) -> Any:
    return builder.insert_element(value, number, builder.trunc(lane, I32)) if isinstance(ty, Lanes) else number


@intrinsic(prefer_literal=True)
def lane_numbers(typingctx, width):
    """Room for one whole number a lane, at first 0, 1, 2, ..., in the frame of the function that asks for it.

    width : a literal.  An array in its place would be allocated, which can fail, and a kernel on a card cannot fail.
    """
    count = width.literal_value

    def codegen(context, builder, sig, args):
        with builder.goto_entry_block():
            numbers = builder.alloca(I64, size=ir.Constant(I64, count))
        for lane in range(count):
            place = ir.Constant(I64, lane)
            builder.store(place, builder.gep(numbers, [place]))
        return numbers

    return types.CPointer(types.int64)(width), codegen


@intrinsic
def lane_holds(typingctx, mask, lane):
    """Whether a mask holds in one lane."""
    return types.boolean(mask, types.intp), lambda context, builder, sig, args: _get(builder, args[0], mask, args[1])


@intrinsic
def with_lane(typingctx, value, lane, number):
    """The lanes with one of them replaced by a plain number."""

    def codegen(context, builder, sig, args):
        return _put(builder, args[0], value, args[1], args[2])

    return value(value, types.intp, types.float64), codegen


@intrinsic
def with_column(typingctx, fields, lane, array, column):
    """The tuple of lanes with one lane of field i replaced by array[i, column]."""

    def codegen(context, builder, sig, args):
        values = []
        for i in range(len(fields)):
            row = ir.Constant(ir.IntType(64), i)
            number = builder.load(_pointer(context, builder, array, args[2], row, args[3], 1))
            values.append(_put(builder, _item(builder, args[0], i), fields[i], args[1], number))
        return _pack(context, builder, fields, values)

    return fields(fields, types.intp, array, types.intp), codegen


@intrinsic
def store_lane(typingctx, array, column, value, lane):
    """Write one lane of a value to array[column], or of the fields of a tuple to array[i, column]."""

    def codegen(context, builder, sig, args):
        if not isinstance(value, types.BaseTuple):
            number = _get(builder, args[2], value, args[3])
            builder.store(number, _pointer(context, builder, array, args[0], None, args[1], 1))
            return context.get_dummy_value()
        for i in range(len(value)):
            number = _get(builder, _item(builder, args[2], i), value[i], args[3])
            row = ir.Constant(ir.IntType(64), i)
            builder.store(number, _pointer(context, builder, array, args[0], row, args[1], 1))
        return context.get_dummy_value()

    return types.none(array, types.intp, value, types.intp), codegen


@intrinsic
def record(typingctx, history, rows, lanes, time, fields):
    """Write time and fields as one more row of each lane in which the mask holds; see `mc_engine.lanes.history`."""
    count, width = len(fields) + 1, common_width(time)

    def codegen(context, builder, sig, args):
        # on the stack, for a choice of the lane there is no instruction
        buffer = cgutils.alloca_once(builder, llvm_type(width), size=ir.Constant(I64, count))
        for i, value in enumerate([args[3], *(_item(builder, args[4], i) for i in range(count - 1))]):
            builder.store(value, builder.gep(buffer, [ir.Constant(I64, i)]))
        numbers = builder.bitcast(buffer, F64.as_pointer())
        holds = builder.zext(builder.bitcast(args[2], ir.IntType(width)), I64)
        room = builder.extract_value(arrayobj.make_array(history)(context, builder, args[0]).shape, 1)
        n_lanes = builder.extract_value(arrayobj.make_array(rows)(context, builder, args[1]).shape, 0)
        with cgutils.for_range(builder, n_lanes, intp=I64) as loop:
            lane = loop.index
            with builder.if_then(builder.trunc(builder.lshr(holds, lane), I1)):
                at = _pointer(context, builder, rows, args[1], None, lane, 1)
                at = builder.bitcast(at, I64.as_pointer())
                row = builder.load(at)
                builder.store(builder.add(row, ir.Constant(I64, 1)), at)
                with builder.if_then(builder.icmp_signed("<", row, room)):
                    first = builder.mul(lane, ir.Constant(I64, count))
                    for i in range(count):
                        place = builder.add(lane, ir.Constant(I64, i * width))
                        line = builder.add(first, ir.Constant(I64, i))
                        target = _pointer(context, builder, history, args[0], line, row, 1)
                        builder.store(builder.load(builder.gep(numbers, [place])), target)
        return context.get_dummy_value()

    return types.none(history, rows, lanes, time, fields), codegen


@intrinsic
def unequal(typingctx, one, other, like):
    """Mask of the lanes in which any number of two records differs; records of lanes as wide as `like`.

    A NaN equals itself here, such as the time of an event that has not happened yet.
    """
    result = mask_type(common_width(like))

    def codegen(context, builder, sig, args):
        return _unequal(builder, one, args[0], args[1])

    return result(one, one, like), codegen


@intrinsic
def differ(typingctx, one, other, like):
    """Mask of the lanes in which any number of two records has other bits; records of lanes as wide as `like`.

    A number and itself never differ, which the compiler knows: unlike `unequal` this costs nothing there.
    """
    width = common_width(like)

    def codegen(context, builder, sig, args):
        whole = llvm_type(width, I64)
        masks = []
        for i in range(len(one)):
            bits = [builder.bitcast(_item(builder, record, i), whole) for record in args[:2]]
            masks.append(builder.icmp_unsigned("!=", *bits))
        return functools.reduce(builder.or_, masks)

    return mask_type(width)(one, other, like), codegen


def _unequal(builder, ty, one, other):
    if not isinstance(ty, types.BaseTuple):
        # not by bits: what is not a number has one sign where it is written, and the processor's where it is computed
        lost = [builder.fcmp_unordered("uno", number, number) for number in (one, other)]
        return builder.or_(builder.fcmp_ordered("!=", one, other), builder.xor(*lost))
    masks = [_unequal(builder, ty[i], _item(builder, one, i), _item(builder, other, i)) for i in range(len(ty))]
    return functools.reduce(builder.or_, masks)
