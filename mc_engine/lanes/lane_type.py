"""The lane number: W float64 values, one per case, in one LLVM vector; and its truth values.

`Lanes(8)` maps to `<8 x double>`.  Operators take (lanes, lanes), (lanes, number) and (number, lanes); a
plain number counts for every lane.  A mask, `Lanes(8, "m")`, comes from a comparison and knows `&`, `|`,
`not`, `==` between masks is not defined.
"""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.datamodel.models import PrimitiveModel
from numba.core.registry import cpu_target
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, ConcreteTemplate, infer_global, signature
from numba.extending import lower_builtin, lower_cast, register_model

from mc_engine.lanes.number import power_by_squaring

F64, I64, I32, I1 = ir.DoubleType(), ir.IntType(64), ir.IntType(32), ir.IntType(1)
_TYPED: list[Any] = []  # the operators that know lanes


class Lanes(types.Type):
    """W float64 numbers (kind "f") or truth values (kind "m"), one per case."""

    def __init__(self, width: int, kind: str = "f"):
        self.width, self.kind = width, kind
        super().__init__(name=f"lanes_{kind}{width}")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        if self.kind == "f" and isinstance(other, (types.Float, types.Integer)):
            return Conversion.safe
        return Conversion.safe if self.kind == "m" and isinstance(other, types.Boolean) else None


@register_model(Lanes)
class LanesModel(PrimitiveModel):
    """One LLVM vector; masks are vectors of single bits."""

    def __init__(self, manager: Any, lanes: Any):
        element = F64 if lanes.kind == "f" else I1
        super().__init__(manager, lanes, ir.VectorType(element, lanes.width))


def is_number(ty: Any) -> bool:
    """Whether a numba type is a plain real number or number lanes."""
    return isinstance(ty, (types.Float, types.Integer)) or (isinstance(ty, Lanes) and ty.kind == "f")


def is_mask(ty: Any) -> bool:
    """Whether a numba type is a truth value or mask lanes."""
    return isinstance(ty, types.Boolean) or (isinstance(ty, Lanes) and ty.kind == "m")


def common_width(*tys: Any) -> int:
    """Width of the lanes among the types; 1 if all are plain."""
    return next((ty.width for ty in tys if isinstance(ty, Lanes)), 1)


def number_type(width: int) -> Any:
    """float64, or number lanes."""
    return Lanes(width) if width > 1 else types.float64


def mask_type(width: int) -> Any:
    """A truth value, or mask lanes."""
    return Lanes(width, "m") if width > 1 else types.boolean


def splat(builder: Any, value: Any, width: int) -> Any:
    """One LLVM scalar in every element of a vector; of a constant, a constant."""
    if isinstance(value, ir.Constant):
        return ir.Constant(ir.VectorType(value.type, width), [value.constant] * width)
    undefined = ir.Constant(ir.VectorType(value.type, width), ir.Undefined)
    first = builder.insert_element(undefined, value, ir.Constant(I32, 0))
    return builder.shuffle_vector(first, undefined, ir.Constant(ir.VectorType(I32, width), [0] * width))


def convert(context: Any, builder: Any, value: Any, ty: Any, target: Any) -> Any:
    """LLVM value of numba type `ty` as `target`: the same, or a plain number in every lane."""
    if ty == target:
        return value
    if isinstance(target, Lanes):
        scalar = types.float64 if target.kind == "f" else types.boolean
        return splat(builder, context.cast(builder, value, ty, scalar), target.width)
    return context.cast(builder, value, ty, target)


@lower_cast(types.Float, Lanes)
@lower_cast(types.Integer, Lanes)
@lower_cast(types.Boolean, Lanes)
def _cast_plain(context, builder, source, target, value):
    return convert(context, builder, value, source, target)


def _operator(op: Any, emit: Callable[..., Any], accepts: Callable[[Any], bool], kind: str) -> None:
    """Type and lower `op` wherever at least one argument is lanes."""

    _TYPED.append(op)

    @infer_global(op)
    class Typing(AbstractTemplate):
        key = op

        def generic(self, args, kws):
            if not any(isinstance(a, Lanes) for a in args) or not all(accepts(a) for a in args):
                return None
            width, plain = common_width(*args), types.float64 if accepts is is_number else types.boolean
            return signature(Lanes(width, kind), *[a if isinstance(a, Lanes) else plain for a in args])

    def lower(context, builder, sig, args):
        wide = Lanes(sig.return_type.width, "f" if accepts is is_number else "m")
        return emit(builder, *[convert(context, builder, v, t, wide) for v, t in zip(args, sig.args, strict=True)])

    plain = types.Float if accepts is is_number else types.Boolean
    for pair in ((Lanes, Lanes), (Lanes, plain), (plain, Lanes)):
        lower_builtin(op, *pair)(lower)


def _comparison(sign: str) -> Callable[..., Any]:
    # "!=" alone is true where a number is missing, as IEEE 754 has it
    return lambda b, x, y: b.fcmp_unordered(sign, x, y) if sign == "!=" else b.fcmp_ordered(sign, x, y)


_operator(operator.add, lambda b, x, y: b.fadd(x, y), is_number, "f")
_operator(operator.sub, lambda b, x, y: b.fsub(x, y), is_number, "f")
_operator(operator.mul, lambda b, x, y: b.fmul(x, y), is_number, "f")
_operator(operator.truediv, lambda b, x, y: b.fdiv(x, y), is_number, "f")
for _op, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
    (operator.ne, "!="),
):
    _operator(_op, _comparison(_sign), is_number, "m")
_operator(operator.and_, lambda b, x, y: b.and_(x, y), is_mask, "m")
_operator(operator.or_, lambda b, x, y: b.or_(x, y), is_mask, "m")
_operator(operator.xor, lambda b, x, y: b.xor(x, y), is_mask, "m")

# x += y on lanes is x = x + y
for _op, _plain_op in (
    (operator.iadd, operator.add),
    (operator.isub, operator.sub),
    (operator.imul, operator.mul),
    (operator.itruediv, operator.truediv),
):
    _emit = {"add": "fadd", "sub": "fsub", "mul": "fmul", "truediv": "fdiv"}[_plain_op.__name__]
    _operator(_op, lambda b, x, y, name=_emit: getattr(b, name)(x, y), is_number, "f")


def _unary(op: Any, emit: Callable[..., Any], kind: str) -> None:
    _TYPED.append(op)

    @infer_global(op)
    class Typing(AbstractTemplate):
        key = op

        def generic(self, args, kws):
            if len(args) == 1 and isinstance(args[0], Lanes) and args[0].kind == kind:
                return signature(args[0], args[0])
            return None

    lower_builtin(op, Lanes)(lambda context, builder, sig, args: emit(builder, args[0]))


def _absolute(builder: Any, value: Any) -> Any:
    width = value.type.count
    name = f"llvm.fabs.v{width}f64"
    function = builder.module.globals.get(name)
    if function is None:
        function = ir.Function(builder.module, ir.FunctionType(value.type, [value.type]), name)
    return builder.call(function, [value])


_unary(operator.neg, lambda b, x: b.fneg(x), "f")
_unary(operator.pos, lambda b, x: x, "f")
_unary(abs, _absolute, "f")
_unary(operator.not_, lambda b, x: b.not_(x), "m")


@infer_global(operator.pow)
class WholePower(AbstractTemplate):
    """lanes ** literal whole number; other powers are `mc_engine.lanes.pow`."""

    key = operator.pow
    prefer_literal = True

    def generic(self, args, kws):
        base, n = args[:2]
        if isinstance(base, Lanes) and isinstance(n, types.IntegerLiteral) and abs(n.literal_value) <= 64:
            return signature(base, base, n)
        return None


@lower_builtin(operator.pow, Lanes, types.IntegerLiteral)
def _whole_power(context, builder, sig, args):
    n = sig.args[1].literal_value
    one = splat(builder, ir.Constant(F64, 1.0), sig.args[0].width)
    if n == 0:
        return one
    value = power_by_squaring(builder.fmul, args[0], abs(n))
    return value if n > 0 else builder.fdiv(one, value)


def _try_lanes_first() -> None:
    """Put the operators of lanes before numba's own, and those of plain numbers next: each that is tried in vain costs
    more than the one that fits."""

    def order(template: Any) -> int:
        is_ours = any(known.__module__ == __name__ for known in template.__mro__)
        return 0 if is_ours else 1 if issubclass(template, ConcreteTemplate) else 2

    context = cpu_target.typing_context
    context.refresh()
    for op in (*_TYPED, operator.pow):
        templates = sorted(context._lookup_global(op).templates, key=order)
        context._remove_global(op)
        context._insert_global(op, types.Function(tuple(templates)))


_try_lanes_first()
