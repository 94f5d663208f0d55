"""Named tuples that hold plain numbers in one place and lanes in another: the compiler treats them as one type.

Physics may return `State(s.v, 0.0)` in one branch and `State(s.v, s.x)` in the other, or begin a loop with a record of
plain numbers.  numba itself unifies numbers and plain tuples in this way, but not named tuples.

A field that is left out has the default of its class, as in Python; numba itself makes a record without it.
Registered on import.
"""

from typing import Any

from numba import types
from numba.core import utils
from numba.core.typing.collections import NamedTupleClassAttribute
from numba.core.typing.templates import AbstractTemplate, signature
from numba.extending import lower_cast


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
            fields = [value if isinstance(value, types.Type) else types.float64 for value in bound.args]
            return signature(types.BaseTuple.from_types(tuple(fields), made), *fields).replace(pysig=written)

    return types.Function(Constructor)


NamedTupleClassAttribute.resolve___call__ = _constructor  # type: ignore[method-assign]
