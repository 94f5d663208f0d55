"""Arithmetic on named tuples of lanes, and their way from and to arrays.  For the compiled loops only.

The engine's loops know no field names: they add, select and store whole tuples.  Each function here is a
numba intrinsic, so any tuple of any length works without generated source.
"""

from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numba.np import arrayobj

from mc_engine.errors import ModelError
from mc_engine.lanes.functions import TABLES
from mc_engine.lanes.lane_type import I1, Lanes, common_width, convert, number_type
from mc_engine.lanes.lowering import constant, fused, llvm_type


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


@intrinsic
def spread(typingctx, value, like):
    """Every field of a tuple (or a plain number) as lanes of the width of `like`."""
    width = common_width(like)
    if isinstance(value, types.BaseTuple):
        result = _tuple_type([number_type(width)] * len(value), value)
    else:
        result = number_type(width)

    def codegen(context, builder, sig, args):
        if not isinstance(value, types.BaseTuple):
            return convert(context, builder, args[0], value, result)
        fields = [convert(context, builder, _item(builder, args[0], i), value[i], result[i]) for i in range(len(value))]
        return _pack(context, builder, result, fields)

    return result(value, like), codegen


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


@intrinsic
def record(typingctx, array, row, time, fields):
    """Write time and fields of the first lane to a row of array[n_rows, 1 + n_fields]."""

    def codegen(context, builder, sig, args):
        for i in range(len(fields) + 1):
            value, ty = (args[2], time) if i == 0 else (_item(builder, args[3], i - 1), fields[i - 1])
            if isinstance(ty, Lanes):
                value = builder.extract_element(value, ir.Constant(ir.IntType(32), 0))
            place = ir.Constant(ir.IntType(64), i)
            _write(builder, value, _pointer(context, builder, array, args[0], args[1], place, 1))
        return context.get_dummy_value()

    return types.none(array, types.intp, time, fields), codegen


def counted(what: str, count: int) -> Any:
    """Intrinsic handing a tuple on that has `count` fields; ModelError when a kernel is built with another."""

    @intrinsic
    def hand_on(typingctx, fields):
        _refuse_other_count(what, fields, count)
        return fields(fields), lambda context, builder, sig, args: args[0]

    return hand_on


def picker(cls: type | None, picks: Sequence[tuple[int, float, float]], count: int | None = None) -> Any:
    """Intrinsic taking a tuple of lanes to (sign * field - offset, ...) for each (field, sign, offset).

    count : how many fields the tuple must have, if that is known.
    """

    @intrinsic
    def pick(typingctx, fields):
        _refuse_other_count("quantities", fields, len(fields) if count is None else count)
        result = types.BaseTuple.from_types(tuple(fields[i] for i, _, _ in picks), cls)

        def codegen(context, builder, sig, args):
            values = []
            for i, sign, offset in picks:
                width, value = common_width(fields[i]), _item(builder, args[0], i)
                value = builder.fneg(value) if sign < 0 else value
                values.append(builder.fsub(value, constant(width, offset)) if offset else value)
            return _pack(context, builder, result, values)

        return result(fields), codegen

    return pick


def directions(signs: Sequence[float]) -> Any:
    """Intrinsic giving a tuple of constant lanes like the one it is handed."""

    @intrinsic
    def give(typingctx, fields):
        _refuse_other_count("events or quantities", fields, len(signs))

        def codegen(context, builder, sig, args):
            values = [constant(common_width(fields[i]), sign) for i, sign in enumerate(signs)]
            return _pack(context, builder, fields, values)

        return fields(fields), codegen

    return give


def any_of(indices: Sequence[int]) -> Any:
    """Intrinsic giving the mask of lanes in which at least one of the chosen mask fields holds."""

    @intrinsic
    def chosen(typingctx, masks):
        def codegen(context, builder, sig, args):
            value = constant(common_width(masks[0]), 0, I1)
            for i in indices:
                value = builder.or_(value, _item(builder, args[0], i))
            return value

        return masks[0](masks), codegen

    return chosen


def composed(calls: Sequence[tuple[Any, tuple[int, ...]]], record: Any, picks: Sequence[tuple[str, int, str]]) -> Any:
    """Intrinsic that calls the functions, each with some of its arguments; see `mc_engine.lanes.composed`."""

    @intrinsic
    def call(typingctx, *args):
        functions = [typingctx.resolve_value_type(function) for function, _ in calls]
        chosen = [tuple(args[i] for i in indices) for _, indices in calls]
        sigs = [function.get_call_type(typingctx, own, {}) for function, own in zip(functions, chosen, strict=True)]
        given: dict[str, Sequence[Any]] = {"argument": args, "result": [sig.return_type for sig in sigs]}
        places = [(source, i, _place(given[source][i], field)) for source, i, field in picks]
        fields = [given[source][i] if place is None else given[source][i][place] for source, i, place in places]
        result = given["result"][0] if record is None else types.BaseTuple.from_types(tuple(fields), record)

        def codegen(context, builder, sig, values):
            own = [_item(builder, values[0], i) for i in range(len(args))]
            results = []
            for function, call_sig, (_, indices) in zip(functions, sigs, calls, strict=True):
                handed = [own[i] for i in indices]
                if call_sig.args and isinstance(call_sig.args[0], types.StarArgTuple):  # of a composed function
                    handed = [_pack(context, builder, call_sig.args[0], handed)]
                results.append(context.get_function(function, call_sig)(builder, handed))
            if record is None:
                return results[0]
            held: dict[str, Sequence[Any]] = {"argument": own, "result": results}
            parts = [held[s][i] if place is None else _item(builder, held[s][i], place) for s, i, place in places]
            return _pack(context, builder, result, parts)

        return result(types.StarArgTuple.from_types(args)), codegen

    return call


def _place(record: Any, field: str) -> int | None:
    """Index of a field of a named tuple's type; None where the whole is meant."""
    return record.fields.index(field) if field else None
