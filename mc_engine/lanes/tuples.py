"""Arithmetic on named tuples of lanes, and their transfer from and to arrays.  For the compiled loops only.

The engine's loops do not use field names: they add, select and store whole tuples.  Each function here is a numba
intrinsic, so tuples of any length work without generated source.
"""

from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numba.np import arrayobj

from mc_engine.errors import ModelError
from mc_engine.lanes.functions import TABLES
from mc_engine.lanes.lane_type import common_width, convert, number_type
from mc_engine.lanes.lowering import fused, llvm_type


def _tuple_type(fields: Sequence[Any], like: Any = None) -> Any:
    """Tuple type of the given field types; named as `like` is, if it is a named tuple or its class."""
    cls = getattr(like, "instance_class", None)
    return types.BaseTuple.from_types(tuple(fields), cls)


def _pack(context: Any, builder: Any, ty: Any, values: Sequence[Any]) -> Any:
    packed = ir.Constant(context.get_value_type(ty), ir.Undefined)
    for i, value in enumerate(values):
        packed = builder.insert_value(packed, value, i)
    return packed


def _item(builder: Any, value: Any, i: int) -> Any:
    return builder.extract_value(value, i)


def _refuse_other_count(what: str, fields: Any, count: int) -> None:
    """ModelError where a tuple has not the number of fields that the kernel has room for: it trusts this number.

    Models are held to their contract before; this is for one that gives other counts to the compiler.
    """
    if isinstance(fields, types.BaseTuple) and len(fields) != count:
        raise ModelError(f"{what}: the physics gives {len(fields)} numbers where the model declares {count}")


def _spread_type(value, width):
    """The type of a number, or of a record of numbers and records, with lanes in place of the numbers."""
    if isinstance(value, types.BaseTuple):
        return _tuple_type([_spread_type(field, width) for field in value], value)
    return number_type(width)


@intrinsic
def spread(typingctx, value, like):
    """Every number of a record, of a record in it, or a plain number as lanes of the width of `like`."""
    result = _spread_type(value, common_width(like))
    return result(value, like), lambda context, builder, sig, args: convert(context, builder, args[0], value, result)


@intrinsic
def add_scaled(typingctx, y, h, k):
    """y + h k, field by field, each rounded once."""
    _refuse_other_count("rhs", k, len(y))

    def codegen(context, builder, sig, args):
        width = common_width(*y)
        step = convert(context, builder, args[1], h, number_type(width))
        fields = []
        for i in range(len(y)):
            fields.append(fused(builder, width, [step, _item(builder, args[2], i), _item(builder, args[0], i)]))
        return _pack(context, builder, y, fields)

    return y(y, h, k), codegen


def _select(context, builder, condition, ty, chosen, other):
    if not isinstance(ty, types.BaseTuple):
        return builder.select(condition, chosen, other)
    pairs = [(_item(builder, chosen, i), _item(builder, other, i)) for i in range(len(ty))]
    return _pack(
        context, builder, ty, [_select(context, builder, condition, ty[i], *pair) for i, pair in enumerate(pairs)]
    )


@intrinsic
def select(typingctx, mask, chosen, other):
    """`chosen` in the lanes where mask holds, `other` elsewhere; for lanes, tuples of lanes, and tuples of tuples."""
    if isinstance(chosen, types.BaseTuple):
        _refuse_other_count("state or memory", other, len(chosen))

    def codegen(context, builder, sig, args):
        return _select(context, builder, args[0], chosen, args[1], args[2])

    return chosen(mask, chosen, other), codegen


@intrinsic
def map_fields(typingctx, function, *args):
    """function(a_i, b_i, ...) for every field i; an argument that is no tuple counts for every field."""
    is_tuple = [isinstance(a, types.BaseTuple) for a in args]
    length = next(len(a) for a, t in zip(args, is_tuple, strict=True) if t)
    rows: list[list[Any]] = [[a[i] if t else a for a, t in zip(args, is_tuple, strict=True)] for i in range(length)]
    sigs = [function.get_call_type(typingctx, tuple(row), {}) for row in rows]
    named = next(a for a, t in zip(args, is_tuple, strict=True) if t)
    result = _tuple_type([sig.return_type for sig in sigs], named)

    def codegen(context, builder, sig, values):
        given = [_item(builder, values[1], i) for i in range(len(args))]
        fields = []
        for i, row_sig in enumerate(sigs):
            row = [_item(builder, v, i) if t else v for v, t in zip(given, is_tuple, strict=True)]
            fields.append(context.get_function(function, row_sig)(builder, row))
        return _pack(context, builder, result, fields)

    return result(function, types.StarArgTuple.from_types(args)), codegen


@intrinsic
def unset(typingctx, function, *args):
    """Zeros in place of what function(*args) gives, for a variable that a loop sets before it is read."""
    result = function.get_call_type(typingctx, args, {}).return_type

    def codegen(context, builder, sig, values):
        return ir.Constant(context.get_value_type(result), None)

    return result(function, types.StarArgTuple.from_types(args)), codegen


@intrinsic
def joined(typingctx, *tuples):
    """One plain tuple of the fields of all tuples."""
    result = _tuple_type([field for fields in tuples for field in fields])

    def codegen(context, builder, sig, args):
        given = [_item(builder, args[0], i) for i in range(len(tuples))]
        fields = [_item(builder, fields, i) for fields, ty in zip(given, tuples, strict=True) for i in range(len(ty))]
        return _pack(context, builder, result, fields)

    return result(types.StarArgTuple.from_types(tuples)), codegen


@intrinsic
def first_fields(typingctx, fields, like):
    """The first fields of a tuple, as many as `like` has and under its names."""
    result = _tuple_type([fields[i] for i in range(len(like))], like)

    def codegen(context, builder, sig, args):
        return _pack(context, builder, result, [_item(builder, args[0], i) for i in range(len(like))])

    return result(fields, like), codegen


def _reduction(emit: Callable[[Any, Any, Any], Any]) -> Callable[[Any, Any], Any]:
    def build(typingctx: Any, fields: Any) -> Any:
        def codegen(context, builder, sig, args):
            value = _item(builder, args[0], 0)
            for i in range(1, len(fields)):
                value = emit(builder, value, _item(builder, args[0], i))
            return value

        return fields[0](fields), codegen

    return build


@intrinsic
def any_field(typingctx, masks):
    """Mask of the lanes in which at least one field holds."""
    return _reduction(lambda b, x, y: b.or_(x, y))(typingctx, masks)


@intrinsic
def total(typingctx, fields):
    """Sum of the fields."""
    return _reduction(lambda b, x, y: b.fadd(x, y))(typingctx, fields)


@intrinsic
def total_in_pairs(typingctx, fields):
    """Sum of the fields by pairs, which is faster than a chain of additions as long as the tuple.

    Use it only to test whether the sum is finite: results depend on the rounding of `total`, which differs.
    """

    def codegen(context, builder, sig, args):
        values = [_item(builder, args[0], i) for i in range(len(fields))]
        while len(values) > 1:
            pairs = [builder.fadd(x, y) for x, y in zip(values[::2], values[1::2], strict=False)]
            values = pairs + values[2 * len(pairs) :]
        return values[0]

    return fields[0](fields), codegen


@intrinsic
def least(typingctx, fields):
    """Smallest field."""
    return _reduction(lambda b, x, y: b.select(b.fcmp_ordered("<", x, y), x, y))(typingctx, fields)


def _pointer(context: Any, builder: Any, array_type: Any, array: Any, row: Any, first: Any, width: int) -> Any:
    """Pointer to `width` numbers from column `first` of `row` (None for a 1-D array), contiguous."""
    struct = arrayobj.make_array(array_type)(context, builder, array)
    offset = first
    if row is not None:
        row_length = builder.extract_value(struct.shape, 1)
        offset = builder.add(builder.mul(row, row_length), first)
    return builder.bitcast(builder.gep(struct.data, [offset]), llvm_type(width).as_pointer())


def _read(builder: Any, pointer: Any) -> Any:
    value = builder.load(pointer)
    value.align = 8
    return value


@intrinsic(prefer_literal=True)
def load(typingctx, array, first, width):
    """The next `width` numbers of a 1-D array as lanes; `width` is a literal."""
    result = number_type(width.literal_value)

    def codegen(context, builder, sig, args):
        return _read(builder, _pointer(context, builder, array, args[0], None, args[1], width.literal_value))

    return result(array, types.intp, width), codegen


@intrinsic(prefer_literal=True)
def load_fields(typingctx, cls, array, first, width):
    """Named tuple of class `cls` with field i from row i of array[n_fields, n], `width` columns from `first`."""
    count = len(cls.instance_class._fields)
    result = _tuple_type([number_type(width.literal_value)] * count, cls)

    def codegen(context, builder, sig, args):
        rows = [ir.Constant(ir.IntType(64), i) for i in range(count)]
        at = [_pointer(context, builder, array, args[1], row, args[2], width.literal_value) for row in rows]
        return _pack(context, builder, result, [_read(builder, pointer) for pointer in at])

    return result(cls, array, types.intp, width), codegen


@intrinsic
def scalars_like(typingctx, like, array):
    """A tuple like `like` with one plain float64 per field from a 1-D array."""
    result = _tuple_type([types.float64] * len(like), like)

    def codegen(context, builder, sig, args):
        places = [ir.Constant(ir.IntType(64), i) for i in range(len(like))]
        at = [_pointer(context, builder, array, args[1], None, place, 1) for place in places]
        return _pack(context, builder, result, [_read(builder, pointer) for pointer in at])

    return result(like, array), codegen


@intrinsic
def load_scalars(typingctx, cls, array):
    """Named tuple of class `cls` with one plain float64 per field from a 1-D array.

    A last field called `tables` becomes the address of what follows in the array after NaN and its last place.
    """
    names = cls.instance_class._fields
    count = len(names) - (names[-1] == TABLES)
    extra = [types.CPointer(types.float64)] * (len(names) - count)
    result = _tuple_type([types.float64] * count + extra, cls)

    def codegen(context, builder, sig, args):
        places = [ir.Constant(ir.IntType(64), i + 2 * (i == count)) for i in range(len(names))]
        at = [_pointer(context, builder, array, args[1], None, place, 1) for place in places]
        return _pack(context, builder, result, [_read(builder, pointer) for pointer in at[:count]] + at[count:])

    return result(cls, array), codegen


def _write(builder: Any, value: Any, pointer: Any) -> None:
    builder.store(value, pointer).align = 8


@intrinsic
def store(typingctx, array, first, value):
    """Write one number or the lanes to a 1-D array from `first` on."""

    def codegen(context, builder, sig, args):
        _write(builder, args[2], _pointer(context, builder, array, args[0], None, args[1], common_width(value)))
        return context.get_dummy_value()

    return types.none(array, types.intp, value), codegen


@intrinsic
def store_fields(typingctx, array, first, fields):
    """Write field i of a tuple to row i of array[n_fields, n], from column `first` on."""

    def codegen(context, builder, sig, args):
        for i in range(len(fields)):
            row = ir.Constant(ir.IntType(64), i)
            pointer = _pointer(context, builder, array, args[0], row, args[1], common_width(fields[i]))
            _write(builder, _item(builder, args[2], i), pointer)
        return context.get_dummy_value()

    return types.none(array, types.intp, fields), codegen
