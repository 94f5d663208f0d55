"""Types and LLVM code of `kernel_data`, registered on import."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_constant
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.core.typing.typeof import typeof_impl
from numba.extending import lower_builtin, models, register_model

from mc_engine.errors import ModelError
from mc_engine.lanes import kernel_data
from mc_engine.lanes.call_frame import BLOCK, DATA, KernelCalls, PartCalls
from mc_engine.lanes.lane_type import F64, I32, I64, common_width, is_number, number_type
from mc_engine.lanes.lowering import constant, llvm_type, shuffle


class BlockType(types.Opaque):
    """A block, told apart by its serial number."""

    def __init__(self, serial: int):
        self.serial = serial
        super().__init__(f"data_block_{serial}")


class BlocksType(types.Opaque):
    """All blocks of a kernel."""

    def __init__(self, serials: tuple[int, ...]):
        self.serials = serials
        super().__init__(f"data_blocks_{serials}")


@typeof_impl.register(kernel_data.DataBlock)
def _of_block(value, context):
    return BlockType(value.serial)


@typeof_impl.register(kernel_data.Blocks)
def _of_blocks(value, context):
    return BlocksType(tuple(block.serial for block in value.blocks))


register_model(BlockType)(models.OpaqueModel)
register_model(BlocksType)(models.OpaqueModel)


@lower_constant(BlockType)
@lower_constant(BlocksType)
def _constant(context, builder, ty, value):
    return context.get_dummy_value()


def _index_name(serial: int) -> str:
    return f"{BLOCK}{serial}"


@infer_global(kernel_data.hand_over)
class _HandOverTyping(AbstractTemplate):
    key = kernel_data.hand_over

    def generic(self, args, kws):
        return signature(types.none, *args)


@lower_builtin(kernel_data.hand_over, BlocksType, types.Array)
def _hand_over(context, builder, sig, args):
    """Define the index of every block, a constant that the parts are linked with, and keep the array's address."""
    if not isinstance(context.call_conv, KernelCalls):
        raise ModelError("hand_over stands in a kernel")
    for index, serial in enumerate(sig.args[0].serials):
        place = cgutils.add_global_variable(builder.module, I64, _index_name(serial))
        place.linkage, place.global_constant, place.initializer = "weak_odr", True, ir.Constant(I64, index)
    array = context.make_array(sig.args[1])(context, builder, args[1])
    context.call_conv.hand_over(builder, builder.bitcast(array.data, DATA))
    return context.get_dummy_value()


@infer_global(kernel_data.numbers_of)
class _NumbersTyping(AbstractTemplate):
    key = kernel_data.numbers_of

    def generic(self, args, kws):
        return signature(types.CPointer(types.float64), *args) if isinstance(args[0], BlockType) else None


@lower_builtin(kernel_data.numbers_of, BlockType)
def _numbers_of(context, builder, sig, args):
    if not isinstance(context.call_conv, PartCalls):
        raise ModelError("data of a model are read by its physics alone")
    name = _index_name(sig.args[0].serial)
    index = builder.module.globals.get(name)
    if index is None:
        index = cgutils.add_global_variable(builder.module, I64, name)
        index.global_constant = True
    data = context.call_conv.data(builder)
    place = builder.load(builder.gep(builder.bitcast(data, I64.as_pointer()), [builder.load(index)]))
    _unchanging(builder, place)
    return builder.gep(data, [place])


def _unchanging(builder, load):
    """Nobody writes to the data while a kernel runs: what is read once need not be read again."""
    load.set_metadata("invariant.load", builder.module.add_metadata([]))


def _whole(context, builder, value, ty):
    """A number as the whole number that it begins with."""
    if isinstance(ty, types.Integer):
        return context.cast(builder, value, ty, types.int64)
    return builder.fptosi(value, llvm_type(common_width(ty), I64))


@infer_global(kernel_data.one_at)
class _OneTyping(AbstractTemplate):
    key = kernel_data.one_at

    def generic(self, args, kws):
        if len(args) != 2 or not isinstance(args[0], types.CPointer) or not is_number(args[1]):
            return None
        return signature(number_type(common_width(args[1])), *args)


@lower_builtin(kernel_data.one_at, types.CPointer, types.Any)
def _one_at(context, builder, sig, args):
    return _rows(builder, args[0], _whole(context, builder, args[1], sig.args[1]), common_width(sig.args[1]), 1)[0]


def _register(function: Any, count: int) -> None:
    """Type and lower a function that reads a row of `count` numbers for each lane."""

    @infer_global(function)
    class Typing(AbstractTemplate):
        key = function

        def generic(self, args, kws):
            if len(args) != 3 or not isinstance(args[0], types.CPointer) or not all(map(is_number, args[1:])):
                return None
            return signature(types.UniTuple(number_type(common_width(args[2])), count), *args)

    @lower_builtin(function, types.CPointer, types.Any, types.Any)
    def lower(context, builder, sig, args):
        width = common_width(sig.args[2])
        base = builder.gep(args[0], [_whole(context, builder, args[1], sig.args[1])])
        row = _whole(context, builder, args[2], sig.args[2])
        places = builder.mul(row, constant(width, count, I64))
        return context.make_tuple(builder, sig.return_type, _rows(builder, base, places, width, count))


def _rows(builder, base, places, width, count):
    """`count` numbers from each lane's place on, each as a vector of lanes."""
    rows = [_load_row(builder, base, places, lane if width > 1 else None, count) for lane in range(width)]
    if width == 1:
        return [builder.extract_element(rows[0], ir.Constant(I32, i)) for i in range(count)]
    return _columns(builder, rows, count)


def _load_row(builder, base, places, lane, count):
    """The numbers at one lane's place as a vector."""
    place = places if lane is None else builder.extract_element(places, ir.Constant(I32, lane))
    address = builder.gep(base, [place])
    row = builder.load(builder.bitcast(address, ir.VectorType(F64, count).as_pointer()))
    row.align = 8
    _unchanging(builder, row)
    return row


def _columns(builder, rows, count):
    """The rows of all lanes turned into one vector of lanes for each number."""
    while len(rows) > 1:
        pairs = zip(rows[::2], rows[1::2], strict=True)
        rows = [shuffle(builder, a, b, range(2 * a.type.count)) for a, b in pairs]
    whole = rows[0]
    return [shuffle(builder, whole, whole, range(i, whole.type.count, count)) for i in range(count)]


_register(kernel_data.row_of_two, 2)
_register(kernel_data.row_of_four, 4)
