"""Named tuples, classes and namespaces in kernels, beyond what numba supports.  Registered on import.

Fields of a named tuple may be plain numbers in one place and lanes in another: physics may return `State(s.v, 0.0)` in
one branch and `State(s.v, s.x)` in the other, or begin a loop with a record of plain numbers.

A field that is left out has the default of its class, as in Python.  A field may be a record.  `replace`, `merged` and
`where` for records are implemented here.

A tuple of plain numbers and lanes, such as (t, s.x), is looped over and looked up as one of lanes.

Compiled code reads the attributes of classes and of `SimpleNamespace` as constants, as it does those of modules.
"""

import inspect
import operator
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from numba import typeof, types
from numba.core import utils
from numba.core.registry import cpu_target
from numba.core.typing.collections import NamedTupleClassAttribute
from numba.core.typing.templates import AbstractTemplate, infer, infer_global, signature
from numba.core.typing.typeof import typeof_impl
from numba.extending import lower_builtin, lower_cast

from mc_engine.lanes import functions
from mc_engine.lanes.lane_type import common_width, is_mask, is_number, mask_type, number_type

_HEAP_TYPE = 1 << 9  # set of a class that is made by a statement, Py_TPFLAGS_HEAPTYPE
_type_of_class = typeof_impl.dispatch(type)


def _of_one_class(record: Any, other: Any) -> bool:
    return isinstance(other, types.NamedTuple | types.NamedUniTuple) and other.instance_class is record.instance_class


def _unify(record: Any, typingctx: Any, other: Any) -> Any:
    """The type of a record that may be either of two; None where some field has no common type."""
    if not _of_one_class(record, other):
        return None
    fields = [typingctx.unify_pairs(field, to) for field, to in zip(record, other, strict=True)]
    return None if None in fields else types.BaseTuple.from_types(fields, record.instance_class)


def _can_convert_to(record: Any, typingctx: Any, other: Any) -> Any:
    """The least safe of the conversions of the fields; None where one has none."""
    if not _of_one_class(record, other):
        return None
    conversions = [typingctx.can_convert(field, to) for field, to in zip(record, other, strict=True)]
    return None if None in conversions else max(conversions)


for _record_type in (types.NamedTuple, types.NamedUniTuple):
    _record_type.unify = _unify  # type: ignore[assignment]
    _record_type.can_convert_to = _can_convert_to  # type: ignore[assignment]


@lower_cast(types.BaseNamedTuple, types.BaseNamedTuple)
def _cast(context, builder, source, target, value):
    fields = [builder.extract_value(value, i) for i in range(len(source))]
    cast = [context.cast(builder, *field) for field in zip(fields, source, target, strict=True)]
    return context.make_tuple(builder, target, cast)


def _constructor(self: Any, class_type: Any) -> Any:
    """The call of a named tuple's class, with defaults for the fields that are left out."""
    made = class_type.instance_class
    written = utils.pysignature(made)

    class Constructor(AbstractTemplate):
        key = class_type.key

        def generic(self, args: Any, kws: Any) -> Any:
            bound = written.bind(*args, **kws)
            bound.apply_defaults()
            # the values that are no types are defaults, which numba then gives as constants
            fields = [value if isinstance(value, types.Type) else _type_of_default(value) for value in bound.args]
            return signature(types.BaseTuple.from_types(tuple(fields), made), *fields).replace(pysig=written)

    return types.Function(Constructor)


def _type_of_default(value: Any) -> Any:
    return typeof(value) if isinstance(value, tuple) else types.float64


NamedTupleClassAttribute.resolve___call__ = _constructor  # type: ignore[method-assign]


@infer_global(functions.replace)
class _Replace(AbstractTemplate):
    key = functions.replace

    def generic(self, args, kws):
        record = args[0] if len(args) == 1 else None
        if not isinstance(record, types.BaseNamedTuple) or not set(kws) <= set(record.fields):
            return None
        fields = [kws.get(name, field) for name, field in zip(record.fields, record, strict=True)]
        named = [inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD) for name in ("_record", *kws)]
        made = types.BaseTuple.from_types(fields, record.instance_class)
        return signature(made, record, *kws.values()).replace(pysig=inspect.Signature(named))


@lower_builtin(functions.replace, types.BaseNamedTuple, types.VarArg(types.Any))
def _lower_replace(context, builder, sig, args):
    given = dict(zip(sig.pysig.parameters, args, strict=True))
    fields = [
        given[name] if name in given else builder.extract_value(args[0], i) for i, name in enumerate(sig.args[0].fields)
    ]
    return context.make_tuple(builder, sig.return_type, fields)


@infer_global(functions.merged)
class _Merged(AbstractTemplate):
    key = functions.merged

    def generic(self, args, kws):
        made, records = getattr(args[0], "instance_class", None) if args else None, args[1:]
        if made is None or not all(isinstance(record, types.BaseNamedTuple) for record in records):
            return None
        fields = []
        for name in made._fields:
            found = [record[record.fields.index(name)] for record in records if name in record.fields]
            if name not in kws and len(found) != 1:
                return None
            fields.append(kws[name] if name in kws else found[0])
        if not set(kws) <= set(made._fields):
            return None
        places = [f"_{i}" for i in range(len(args))]
        named = [inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD) for name in (*places, *kws)]
        result = types.BaseTuple.from_types(fields, made)
        return signature(result, *args, *kws.values()).replace(pysig=inspect.Signature(named))


@lower_builtin(functions.merged, types.NamedTupleClass, types.VarArg(types.Any))
def _lower_merged(context, builder, sig, args):
    given = dict(zip(sig.pysig.parameters, args, strict=True))
    records = [(ty, value) for ty, value in zip(sig.args, args, strict=True) if isinstance(ty, types.BaseNamedTuple)]

    def field(name):
        if name in given:
            return given[name]
        return next(builder.extract_value(value, ty.fields.index(name)) for ty, value in records if name in ty.fields)

    fields = [field(name) for name in sig.return_type.fields]
    return context.make_tuple(builder, sig.return_type, fields)


@infer_global(functions.where)
class _Where(AbstractTemplate):
    """`where` on two records of one class: in every field as on numbers."""

    key = functions.where

    def generic(self, args, kws):
        if len(args) != 3 or not isinstance(args[1], types.BaseNamedTuple) or not _of_one_class(*args[1:]):
            return None
        fields = [_choice(self.context, args, i) for i in range(len(args[1]))]
        made = types.BaseTuple.from_types([field.return_type for field in fields], args[1].instance_class)
        return signature(made, *args)


def _choice(typingctx: Any, args: Any, i: int) -> Any:
    """The signature of `where` on field i of two records."""
    function = typingctx.resolve_value_type(functions.where)
    return function.get_call_type(typingctx, (args[0], args[1][i], args[2][i]), {})


@lower_builtin(functions.where, types.Any, types.BaseNamedTuple, types.BaseNamedTuple)
def _lower_where(context, builder, sig, args):
    function = context.typing_context.resolve_value_type(functions.where)
    fields = []
    for i in range(len(sig.return_type)):
        own = _choice(context.typing_context, sig.args, i)
        values = [args[0], *(builder.extract_value(record, i) for record in args[1:])]
        given = [sig.args[0], sig.args[1][i], sig.args[2][i]]
        cast = [context.cast(builder, *conversion) for conversion in zip(values, given, own.args, strict=True)]
        fields.append(context.get_function(function, own)(builder, cast))
    return context.make_tuple(builder, sig.return_type, fields)


# ---- tuples of plain numbers and lanes


def _even(ty: Any) -> Any:
    """The type of a tuple that a mixed one is converted to where that makes all its fields of one type, else itself."""
    if not isinstance(ty, types.Tuple | types.NamedTuple):
        return ty
    even = _in_lanes(ty, common_width(*_leaves(ty)))
    return even if isinstance(even, types.IterableType) else ty


def _leaves(ty: Any) -> list[Any]:
    return [leaf for field in _fields_of(ty) for leaf in _leaves(field)] if _fields_of(ty) else [ty]


def _in_lanes(ty: Any, width: int) -> Any:
    """A type with lanes in place of plain numbers and truth values."""
    if _fields_of(ty):
        fields = [_in_lanes(field, width) for field in ty]
        return types.BaseTuple.from_types(fields, getattr(ty, "instance_class", None))
    return number_type(width) if is_number(ty) else mask_type(width) if is_mask(ty) else ty


def _fields_of(ty: Any) -> Any:
    return ty if isinstance(ty, types.BaseTuple) else ()


def _take_mixed(function: Any, add: Callable[[Any], Any]) -> None:
    """Let numba type a function that it knows for tuples of one type of fields on mixed ones, too."""

    @add
    class Typing(AbstractTemplate):
        key = function

        def generic(self, args, kws):
            even = tuple(_even(ty) for ty in args)
            return self.context.resolve_function_type(function, even, kws) if even != args else None


_take_mixed("getiter", infer)
for _function in (operator.getitem, enumerate, zip):
    _take_mixed(_function, infer_global(_function))


# ---- classes and namespaces


class Namespace(types.Module):
    """The numba type of one class or namespace: a module to numba, whose attributes are constants."""

    @property
    def key(self) -> int:
        """By identity: namespaces have no hash."""
        return id(self.pymod)


@typeof_impl.register(type)
def _of_class(value: Any, context: Any) -> Any:
    """What numba knows a class as, and a namespace where it knows none."""
    known = _type_of_class(value, context)
    if known is not None or not value.__flags__ & _HEAP_TYPE:
        return known
    return Namespace(value) if cpu_target.typing_context._lookup_global(value) is None else None


@typeof_impl.register(SimpleNamespace)
def _of_namespace(value: Any, context: Any) -> Any:
    return Namespace(value)
