"""Floats for interpreted flights: they compute as kernels do and record which operation gave an infinity or NaN.

1/0 is infinite, as in kernels.  A result that is infinite or NaN has an `Origin`: the operation on finite numbers that
gave it, and its source line.  Results computed from it keep the same origin, so that the number that ends a flight
identifies the first faulty operation.
"""

import functools
import inspect
import math
import operator
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

_HERE = Path(__file__).parent
_MATHEMATICS = tuple(str(_HERE / name) for name in ("elementary.py", "functions.py"))


class Place(NamedTuple):
    """A line of a source."""

    file: str
    line: int

    def __str__(self) -> str:
        return f"{Path(self.file).name}, line {self.line}"


class Origin(NamedTuple):
    """What made a number that is not finite: an operation, its arguments and its result.

    places : where, from the inside out, up to the function of the model that the engine called.
    called, t : that function's name, and the time [s] that it was given.
    """

    operation: str
    arguments: tuple[Any, ...] = ()
    result: float = math.nan
    places: tuple[Place, ...] = ()
    called: str = ""
    t: float = math.nan


class Number(float):
    """A float with an origin; none where it is finite, or was given as it is."""

    __array_ufunc__ = None  # a NumPy number leaves the operation to this one
    origin: Origin | None = None

    def __neg__(self) -> "Number":
        return result_of("-", (self,), -float(self))

    def __abs__(self) -> "Number":
        return result_of("abs", (self,), abs(float(self)))

    def __pos__(self) -> "Number":
        return self


def number(value: Any, origin: Origin | None = None) -> Number:
    """The value as a Number, of this origin where it is not finite and has none."""
    made = value if type(value) is Number else Number(value)
    if origin is not None and made.origin is None and not math.isfinite(made):
        made.origin = origin
    return made


def numbers(value: Any) -> Any:
    """A number as a Number, a record with Numbers in place of its numbers; all else as it is."""
    if isinstance(value, tuple):
        fields = [numbers(field) for field in value]
        return type(value)(*fields) if hasattr(value, "_fields") else tuple(fields)
    return number(value) if isinstance(value, float | int) and not isinstance(value, bool) else value


def result_of(operation: str, arguments: tuple[Any, ...], value: float) -> Number:
    """The result of an operation as a Number."""
    made = Number(value)
    if not math.isfinite(value):
        made.origin = _known(arguments) or _origin(operation, arguments, value)
    return made


def _known(arguments: tuple[Any, ...]) -> Origin | None:
    """The first origin among those of the arguments."""
    return next((argument.origin for argument in arguments if type(argument) is Number and argument.origin), None)


def taking_numbers(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function of floats that also takes Numbers, and then returns one."""

    signature = inspect.signature(function)

    @functools.wraps(function)
    def call(*arguments: Any, **named: Any) -> Any:
        if named:  # as a kernel takes them, too
            arguments = signature.bind(*arguments, **named).args
        if Number not in map(type, arguments):
            return function(*arguments)
        plain = [float(argument) if type(argument) is Number else argument for argument in arguments]
        return result_of(function.__name__, arguments, function(*plain))

    return call


def calling(name: str, function: Callable[..., Any], arguments: tuple[Any, ...], floats_first: bool = True) -> Any:
    """The result of a function of a model as a kernel has it, with origins.

    floats_first : on floats, which is ten times as fast, and with Numbers only where that gives one that is not finite.
    """
    try:
        result = function(*(_bare(argument) for argument in arguments)) if floats_first else math.nan
        if _is_finite(result):
            return result
    except ArithmeticError:  # where kernels go on with an infinity
        pass
    return function(*(numbers(argument) for argument in arguments))


def as_in_kernels(function: Callable[..., Any], arguments: Sequence[Any], named: Mapping[str, Any]) -> Any:
    """What a function gives for plain numbers where Python would raise and kernels go on, as for 1/0."""
    return _bare(function(*map(numbers, arguments), **{name: numbers(value) for name, value in named.items()}))


def are_numbers(value: Any) -> bool:
    """Whether this is a number, or a record of numbers: no arrays."""
    return all(map(are_numbers, value)) if isinstance(value, tuple) else isinstance(value, float | int)


def _bare(value: Any) -> Any:
    if isinstance(value, tuple):
        if {*map(type, value)} == {float}:
            return value
        fields = [_bare(field) for field in value]
        return type(value)(*fields) if hasattr(value, "_fields") else tuple(fields)
    return float(value) if type(value) is Number else value


def _is_finite(result: Any) -> bool:
    return all(map(_is_finite, result)) if isinstance(result, tuple) else math.isfinite(result)


def _origin(operation: str, arguments: tuple[Any, ...], value: float) -> Origin:
    places: list[Place] = []
    frame: FrameType | None = sys._getframe(2)
    while frame is not None:
        code = frame.f_code
        if code is calling.__code__:
            given = frame.f_locals["arguments"]
            t = float(given[0]) if isinstance(given[0], float) else math.nan
            return Origin(operation, arguments, value, tuple(places), frame.f_locals["name"], t)
        if code.co_filename in _MATHEMATICS and not places:
            operation = code.co_name
            arguments = tuple(frame.f_locals[name] for name in code.co_varnames[: code.co_argcount])
            if operation != "where" and (known := _known(arguments)):  # log(nan) is a constant that it has at hand
                return known
        elif _HERE not in Path(code.co_filename).parents:
            places.append(Place(code.co_filename, frame.f_lineno))
        frame = frame.f_back
    return Origin(operation, arguments, value)  # of the engine's own loops


def _quotient(x: float, y: float) -> float:
    if y != 0.0:
        return x / y
    return math.nan if x == 0.0 or math.isnan(x) else math.copysign(math.inf, x) * math.copysign(1.0, y)


def power_by_squaring(multiply: Callable[[Any, Any], Any], base: Any, n: int) -> Any:
    """base**n for n >= 1 with the multiplications in the order that numba uses for one float64."""
    result = None
    while n:
        if n & 1:
            result = base if result is None else multiply(result, base)
        n >>= 1
        if n:
            base = multiply(base, base)
    return result


def _power(x: float, n: float) -> float:
    if n == 0.0:
        return 1.0
    value = power_by_squaring(operator.mul, x, abs(int(n)))
    return value if n > 0.0 else _quotient(1.0, value)


def _method(symbol: str, compute: Callable[[float, float], float], reflected: bool) -> Callable[..., Any]:
    def method(self: Number, other: Any) -> Any:
        if not isinstance(other, float | int):
            return NotImplemented
        arguments = (other, self) if reflected else (self, other)
        return result_of(symbol, arguments, compute(float(arguments[0]), float(arguments[1])))

    return method


for _name, _symbol, _compute in (
    ("add", "+", operator.add),
    ("sub", "-", operator.sub),
    ("mul", "*", operator.mul),
    ("truediv", "/", _quotient),
    ("pow", "**", _power),
):
    setattr(Number, f"__{_name}__", _method(_symbol, _compute, False))
    setattr(Number, f"__r{_name}__", _method(_symbol, _compute, True))
