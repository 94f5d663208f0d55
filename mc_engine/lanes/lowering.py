"""Vector instructions for the functions of `functions`: types and LLVM code, registered on import."""

from collections.abc import Callable, Iterable
from functools import cache
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin

from mc_engine.lanes import functions, philox
from mc_engine.lanes.lane_type import (
    F64,
    I32,
    I64,
    Lanes,
    common_width,
    convert,
    is_mask,
    is_number,
    mask_type,
    number_type,
    splat,
)

_NAN = float("nan")
Emit = Callable[[Any, int, list[Any]], Any]


def llvm_type(width: int, element: Any = F64) -> Any:
    """LLVM type of a number (width 1) or of lanes."""
    return ir.VectorType(element, width) if width > 1 else element


def constant(width: int, value: Any, element: Any = F64) -> Any:
    """LLVM constant, the same in every lane."""
    return ir.Constant(llvm_type(width, element), [value] * width if width > 1 else value)


def shuffle(builder: Any, a: Any, b: Any, order: Iterable[int]) -> Any:
    """Lanes of two vectors side by side, at these places."""
    places = list(order)
    return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(I32, len(places)), places))


def _register(function: Any, n_numbers: int, emit: Emit, *, mask_first: bool = False) -> None:
    """Type `function` on numbers and lanes (after a leading mask if asked) and lower it by `emit`."""
    n_args = n_numbers + mask_first

    @infer_global(function)
    class Typing(AbstractTemplate):
        key = function

        def generic(self, args, kws):
            if len(args) != n_args or not all(is_number(a) for a in args[mask_first:]):
                return None
            if mask_first and not is_mask(args[0]):
                return None
            width = common_width(*args)
            masks = [args[0] if isinstance(args[0], Lanes) else types.boolean] if mask_first else []
            numbers = [a if isinstance(a, Lanes) else types.float64 for a in args[mask_first:]]
            return signature(number_type(width), *masks, *numbers)

    def lower(context, builder, sig, args):
        width = common_width(sig.return_type)
        targets = [mask_type(width)] * mask_first + [number_type(width)] * n_numbers
        wide = [convert(context, builder, v, t, to) for v, t, to in zip(args, sig.args, targets, strict=True)]
        return emit(builder, width, wide)

    lower_builtin(function, *([types.Any] * n_args))(lower)


def _intrinsic(base: str) -> Emit:
    def emit(builder, width, args):
        kind = llvm_type(width)
        name = f"llvm.{base}." + (f"v{width}f64" if width > 1 else "f64")
        function_type = ir.FunctionType(kind, [kind] * len(args))
        return builder.call(cgutils.get_or_insert_function(builder.module, function_type, name), args)

    return emit


def _choose(builder, width, args):
    mask, x, y = args
    if width == 1 and mask.type != ir.IntType(1):
        mask = builder.trunc(mask, ir.IntType(1))
    return builder.select(mask, x, y)


def _handed_on(builder, width, tested, value):
    """The value, but NaN where the tested number is NaN."""
    return builder.select(builder.fcmp_unordered("uno", tested, tested), constant(width, _NAN), value)


def _is_written_out(value):
    """Whether a value is a number of the source, the same in every lane."""
    if isinstance(value, ir.Constant) and isinstance(value.type, ir.VectorType):
        value = value.constant[0]
    return isinstance(value, ir.Constant) and value.constant == value.constant


def _extreme(sign: str) -> Emit:
    """Compare and select, because minnum ignores NaN; the second number where they are equal."""

    def emit(builder, width, args):
        x, y = args
        if _is_written_out(y):  # only x can be none
            return builder.select(builder.fcmp_unordered(sign, x, y), x, y)
        # one instruction, which gives y where either is none
        chosen = builder.select(builder.fcmp_ordered(sign, x, y), x, y)
        return chosen if _is_written_out(x) else _handed_on(builder, width, x, chosen)

    return emit


def _copysign(builder, width, args):
    return _handed_on(builder, width, args[1], _intrinsic("copysign")(builder, width, args))


def _two_to(builder, width, args):
    # adding 1.5 * 2**52 leaves the whole number in the low bits; the exponent field is 52 bits up
    shifted = builder.fadd(args[0], constant(width, 6755399441055744.0 + 1023.0))
    bits = builder.shl(builder.bitcast(shifted, llvm_type(width, I64)), constant(width, 52, I64))
    return builder.bitcast(bits, llvm_type(width))


@cache
def _has_avx512() -> bool:
    """Whether the processor that numba compiles for has AVX-512."""
    from numba.core.registry import cpu_target

    return "+avx512f" in cpu_target.target_context.codegen().magic_tuple()[2]


def _scaled(builder, width, args):
    x, n = args
    if width % 8 == 0 and _has_avx512():
        eights = [[shuffle(builder, v, v, range(first, first + 8)) for v in (x, n)] for first in range(0, width, 8)]
        parts = [_scaled_eight(builder, *eight) for eight in eights]
        return shuffle(builder, parts[0], parts[-1], range(width))
    # two factors, because 2**n alone leaves the range of doubles before the product does
    half = _intrinsic("rint")(builder, width, [builder.fmul(n, constant(width, 0.5))])
    first, second = (_two_to(builder, width, [part]) for part in (half, builder.fsub(n, half)))
    return builder.fmul(builder.fmul(x, first), second)


def _scaled_eight(builder, x, n):
    every, current_rounding = ir.Constant(ir.IntType(8), -1), ir.Constant(I32, 4)
    kinds = [llvm_type(8)] * 3 + [every.type, current_rounding.type]
    name, kind = "llvm.x86.avx512.mask.scalef.pd.512", ir.FunctionType(llvm_type(8), kinds)
    scale = cgutils.get_or_insert_function(builder.module, kind, name)
    return builder.call(scale, [x, n, ir.Constant(x.type, ir.Undefined), every, current_rounding])


def _exponent(builder, width, args):
    bits = builder.bitcast(args[0], llvm_type(width, I64))
    field = builder.and_(builder.lshr(bits, constant(width, 52, I64)), constant(width, 2047, I64))
    # as a float by the same trick backwards: the bits of 2**52 + field
    number = builder.bitcast(builder.or_(field, constant(width, 0x4330 << 48, I64)), llvm_type(width))
    return builder.fsub(number, constant(width, 4503599627370496.0 + 1023.0))


def _mantissa(builder, width, args):
    bits = builder.bitcast(args[0], llvm_type(width, I64))
    fraction = builder.and_(bits, constant(width, (1 << 52) - 1, I64))
    return builder.bitcast(builder.or_(fraction, constant(width, 1023 << 52, I64)), llvm_type(width))


def _inverse_root_guess(builder, width, args):
    half = builder.lshr(builder.bitcast(args[0], llvm_type(width, I64)), constant(width, 1, I64))
    return builder.bitcast(builder.sub(constant(width, functions.INVERSE_ROOT_BITS, I64), half), llvm_type(width))


fused = _intrinsic("fma")  # x y + z, rounded once: the same at every width, because it is asked for

_register(functions.sqrt, 1, _intrinsic("sqrt"))
_register(functions.rint, 1, _intrinsic("rint"))
_register(functions.floor, 1, _intrinsic("floor"))
_register(functions.fma, 3, fused)
_register(functions.sign_copied, 2, _intrinsic("copysign"))
_register(functions.copysign, 2, _copysign)
_register(functions.minimum, 2, _extreme("<"))
_register(functions.maximum, 2, _extreme(">"))
_register(functions.where, 2, _choose, mask_first=True)
_register(functions.two_to, 1, _two_to)
_register(functions.scaled, 2, _scaled)
_register(functions.exponent, 1, _exponent)
_register(functions.mantissa, 1, _mantissa)
_register(functions.inverse_root_guess, 1, _inverse_root_guess)


@infer_global(functions.look_up)
class _LookUpTyping(AbstractTemplate):
    key = functions.look_up

    def generic(self, args, kws):
        if len(args) != 2 or not isinstance(args[0], types.CPointer) or not is_number(args[1]):
            return None
        place = types.int64 if isinstance(args[1], types.Integer) else number_type(common_width(args[1]))
        return signature(number_type(common_width(args[1])), args[0], place)


@lower_builtin(functions.look_up, types.CPointer, types.Any)
def _look_up(context, builder, sig, args):
    """One load a lane: the vector gather is no faster.  The last place and, before it, NaN stand before the first."""
    width = common_width(sig.args[1])
    last = builder.load(builder.gep(args[0], [ir.Constant(I64, -1)]))
    if sig.args[1] == types.int64:
        place, last = args[1], builder.fptosi(last, I64)
        place = builder.select(builder.icmp_signed("<", place, last), place, last)
        place = builder.select(builder.icmp_signed(">", place, ir.Constant(I64, 0)), place, ir.Constant(I64, 0))
        return builder.load(builder.gep(args[0], [place]))
    last = splat(builder, last, width) if width > 1 else last
    least, missing = constant(width, 0.0), constant(width, -2.0)
    place = builder.select(builder.fcmp_ordered("<", args[1], least), least, args[1])
    # by now only what is not a number is not above the place of NaN
    place = builder.select(builder.fcmp_ordered(">", place, missing), place, missing)
    place = builder.select(builder.fcmp_ordered("<", place, last), place, last)
    places = builder.fptosi(place, llvm_type(width, I64))
    if width == 1:
        return builder.load(builder.gep(args[0], [places]))
    value = ir.Constant(llvm_type(width), ir.Undefined)
    for lane in range(width):
        at = ir.Constant(ir.IntType(32), lane)
        number = builder.load(builder.gep(args[0], [builder.extract_element(places, at)]))
        value = builder.insert_element(value, number, at)
    return value


@infer_global(functions.look_up_record)
class _LookUpRecordTyping(AbstractTemplate):
    key = functions.look_up_record

    def generic(self, args, kws):
        if len(args) != 3 or not isinstance(args[2], types.NamedTupleClass):
            return None
        one = _LookUpTyping.generic(self, args[:2], kws)
        cls = args[2].instance_class
        fields = (one.return_type,) * len(cls._fields) if one else ()
        return signature(types.BaseTuple.from_types(fields, cls), *one.args, args[2]) if one else None


@lower_builtin(functions.look_up_record, types.CPointer, types.Any, types.NamedTupleClass)
def _look_up_record(context, builder, sig, args):
    place, width = sig.args[1], common_width(sig.args[1])
    one = signature(sig.return_type[0], *sig.args[:2])
    numbers = []
    for index in range(len(sig.return_type)):
        if place == types.int64:
            at = builder.add(args[1], ir.Constant(I64, index))
        else:
            at = builder.fadd(args[1], constant(width, float(index)))
        numbers.append(_look_up(context, builder, one, [args[0], at]))
    return context.make_tuple(builder, sig.return_type, numbers)


@infer_global(functions.any_lane)
class _AnyTyping(AbstractTemplate):
    key = functions.any_lane

    def generic(self, args, kws):
        return signature(types.boolean, args[0]) if len(args) == 1 and is_mask(args[0]) else None


@lower_builtin(functions.any_lane, types.Any)
def _any_lane(context, builder, sig, args):
    return any_bit(builder, args[0], common_width(sig.args[0]))


def any_bit(builder: Any, mask: Any, width: int) -> Any:
    """LLVM truth value: the mask holds in at least one lane."""
    if width == 1:
        return mask
    word = builder.bitcast(mask, ir.IntType(width))
    return builder.icmp_unsigned("!=", word, ir.Constant(ir.IntType(width), 0))


@infer_global(philox.uniform_pair)
class _UniformPairTyping(AbstractTemplate):
    key = philox.uniform_pair

    def generic(self, args, kws):
        if len(args) != 2 or not isinstance(args[0], types.BaseNamedTuple) or not isinstance(args[1], types.Integer):
            return None
        return signature(types.UniTuple(number_type(common_width(*args[0])), 2), args[0], types.int64)


@lower_builtin(philox.uniform_pair, types.BaseNamedTuple, types.Integer)
def _uniform_pair(context, builder, sig, args):
    draws, width = sig.args[0], common_width(*sig.args[0])

    def whole(value):
        return constant(width, value, I64)

    def widen(value):
        return splat(builder, value, width) if width > 1 else value

    def counter(i):
        number = convert(context, builder, builder.extract_value(args[0], i), draws[i], number_type(width))
        return builder.fptoui(number, llvm_type(width, I64))

    def low(value):
        return builder.and_(value, whole(0xFFFFFFFF))

    def high(value):
        return builder.lshr(value, whole(32))

    key = widen(context.cast(builder, builder.extract_value(args[0], 0), draws[0], types.uint64))
    k0, k1, case = low(key), high(key), counter(1)
    c0, c1, c2, c3 = low(case), high(case), low(counter(2)), low(widen(args[1]))
    for _ in range(philox.ROUNDS):
        p0, p1 = builder.mul(c0, whole(philox.MULTIPLIERS[0])), builder.mul(c2, whole(philox.MULTIPLIERS[1]))
        c0, c2 = builder.xor(builder.xor(high(p1), c1), k0), builder.xor(builder.xor(high(p0), c3), k1)
        c1, c3 = low(p1), low(p0)
        k0, k1 = low(builder.add(k0, whole(philox.WEYL[0]))), low(builder.add(k1, whole(philox.WEYL[1])))

    def fraction(upper, lower):
        # 52 bits behind the point of a number in [1, 2), then less one: no conversion, no rounding
        bits = builder.or_(builder.shl(upper, whole(20)), builder.lshr(lower, whole(12)))
        number = builder.bitcast(builder.or_(bits, whole(1023 << 52)), llvm_type(width))
        return builder.fsub(number, constant(width, 1.0))

    return context.make_tuple(builder, sig.return_type, (fraction(c0, c1), fraction(c2, c3)))
