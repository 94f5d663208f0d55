"""Intrinsics that are made for one model: constants, selections of fields, and functions composed of the model's own.

A kernel takes them from `mc_engine.flight.kernel_parts`.  Interpreted versions with the same names are in
`mc_engine.flight.interpreted`.
"""

from collections.abc import Sequence
from typing import Any

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from mc_engine.lanes.composed import Call, Pick
from mc_engine.lanes.lane_type import I1, common_width, convert
from mc_engine.lanes.lowering import any_bit, constant
from mc_engine.lanes.tuples import _item, _pack, _refuse_other_count, _select, _spread_type


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
        _refuse_other_count("outputs", fields, len(fields) if count is None else count)
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
        _refuse_other_count("events or outputs", fields, len(signs))

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


def composed(calls: Sequence[Call], record: Any, picks: Sequence[Pick]) -> Any:
    """Intrinsic that calls the functions one after another; see `mc_engine.lanes.composed`."""

    @intrinsic
    def call(typingctx, *args):
        functions = [typingctx.resolve_value_type(function) for function, _ in calls]
        sigs: list[Any] = []
        for function, (_, chosen) in zip(functions, calls, strict=True):
            handed = tuple(_type_of(pick, args, [sig.return_type for sig in sigs]) for pick in chosen)
            sigs.append(function.get_call_type(typingctx, handed, {}))
        results = [sig.return_type for sig in sigs]
        fields = tuple(_type_of(pick, args, results) for pick in picks)
        result = results[-1] if record is None else types.BaseTuple.from_types(fields, _class_of(record))

        def codegen(context, builder, sig, values):
            own = [_item(builder, values[0], i) for i in range(len(args))]
            made: list[Any] = []

            def value(pick: Pick) -> Any:
                return _value_of(context, builder, pick, args, own, results, made)

            for function, call_sig, (_, chosen) in zip(functions, sigs, calls, strict=True):
                made.append(_called(context, builder, function, call_sig, [value(pick) for pick in chosen]))
            return made[-1] if record is None else _pack(context, builder, result, [value(pick) for pick in picks])

        return result(types.StarArgTuple.from_types(args)), codegen

    return call


def alternatives(number: Pick, functions: Sequence[Any]) -> Any:
    """Intrinsic that calls function k where `number` is k, if it is in any lane; see `mc_engine.lanes.composed`."""

    @intrinsic
    def call(typingctx, *args):
        which = _type_of(number, args, ())
        width = common_width(which)
        resolved = [typingctx.resolve_value_type(function) for function in functions]
        sigs = [function.get_call_type(typingctx, args, {}) for function in resolved]
        result = _spread_type(sigs[0].return_type, width)
        for sig in sigs:
            _refuse_other_count("phases", sig.return_type, len(result))

        def codegen(context, builder, sig, values):
            own = [_item(builder, values[0], i) for i in range(len(args))]
            there = _value_of(context, builder, number, args, own, (), ())
            kept = cgutils.alloca_once(builder, context.get_value_type(result))
            builder.store(cgutils.get_null_value(context.get_value_type(result)), kept)
            for k, (function, own_sig) in enumerate(zip(resolved, sigs, strict=True)):
                mask = builder.fcmp_ordered("==", there, constant(width, float(k)))
                with builder.if_then(any_bit(builder, mask, width)):
                    given = _called(context, builder, function, own_sig, own)
                    given = convert(context, builder, given, own_sig.return_type, result)
                    before = builder.load(kept)
                    builder.store(_select(context, builder, mask, result, given, before), kept)
            return builder.load(kept)

        return result(types.StarArgTuple.from_types(args)), codegen

    return call


def _called(context: Any, builder: Any, function: Any, sig: Any, handed: Sequence[Any]) -> Any:
    if sig.args and isinstance(sig.args[0], types.StarArgTuple | types.StarArgUniTuple):  # of an intrinsic made here
        handed = [_pack(context, builder, sig.args[0], handed)]
    return context.get_function(function, sig)(builder, handed)


def _type_of(pick: Pick, args: Sequence[Any], results: Sequence[Any]) -> Any:
    source, place, field = pick
    if source == "constant":
        return types.float64
    whole = (args if source == "argument" else results)[place]
    return whole if field == "" or _fields_of(whole) is None else whole[_index(whole, field)]


def _value_of(
    context: Any,
    builder: Any,
    pick: Pick,
    args: Sequence[Any],
    own: Sequence[Any],
    results: Sequence[Any],
    made: Sequence[Any],
) -> Any:
    source, place, field = pick
    if source == "constant":
        return context.get_constant(types.float64, place)
    kinds, values = (args, own) if source == "argument" else (results, made)
    if field == "" or _fields_of(kinds[place]) is None:
        return values[place]
    return _item(builder, values[place], _index(kinds[place], field))


def _index(record: Any, field: str | int) -> int:
    """Index of a field of a tuple's type."""
    return field if isinstance(field, int) else record.fields.index(field)


def _class_of(record: Any) -> Any:
    """What names a tuple's type: nothing for a plain one."""
    return None if record is tuple else record


def _fields_of(ty: Any) -> Any:
    """The types of a tuple's fields; None for another type."""
    return ty if isinstance(ty, types.BaseTuple) else None
