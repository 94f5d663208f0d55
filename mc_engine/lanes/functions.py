"""Arithmetic on a number or on a vector of cases: the functions that physics imports instead of `math`.

The functions here are the interpreted versions, for floats and NumPy arrays.  Compiled physics uses the vector
instructions of the same names (see `lowering`), with results identical to the last bit.
"""

import ctypes
import math
import struct
from fractions import Fraction

import numpy as np

from mc_engine.errors import ModelError
from mc_engine.lanes.number import Number, result_of, taking_numbers
from mc_engine.suggestions import hint


@taking_numbers
def sqrt(x):
    """Square root; NaN below zero.  Correctly rounded."""
    if isinstance(x, float):  # here and below: NumPy would take ten times as long
        return math.sqrt(x) if x >= 0.0 else math.nan
    with np.errstate(invalid="ignore"):
        return _plain(np.sqrt(x))


@taking_numbers
def fma(x, y, z):
    """x y + z with one rounding."""
    if isinstance(x, float) and isinstance(y, float) and isinstance(z, float):
        return _FMA(x, y, z)
    with np.errstate(all="ignore"):
        return _plain(np.asarray(_exact_fma(x, y, z), dtype=np.float64))


@taking_numbers
def rint(x):
    """Nearest whole number, halves to even."""
    return _plain(np.rint(x))


@taking_numbers
def floor(x):
    """Largest whole number not above x."""
    return _plain(np.floor(x))


def minimum(x, y):
    """The smaller of x and y; y where they are equal, as 0.0 and -0.0 are.  NaN if either is NaN."""
    return where((x < y) | (x != x), x, y)


def maximum(x, y):
    """The larger of x and y; y where they are equal, as 0.0 and -0.0 are.  NaN if either is NaN."""
    return where((x > y) | (x != x), x, y)


def copysign(x, y):
    """|x| with the sign of y.  NaN if either is NaN, as the sign of a NaN means nothing."""
    return where(y == y, sign_copied(x, y), y)


@taking_numbers
def sign_copied(x, y):
    """|x| with the sign bit of y, also if y is NaN."""
    return _plain(np.copysign(x, y))


def where(mask, x, y):
    """x where mask is true, y elsewhere.  Both are computed, so the arguments of both must be in range.

    mask : truth values, the result of a comparison.  x, y : numbers, or named tuples of one class, for which each field
    is selected.  ModelError for others, which kernels refuse, too.
    """
    if type(mask) is bool and type(x) is float and type(y) is float:
        return x if mask else y  # nearly all that an interpreted flight asks for
    _refuse_number(mask, "where")
    if isinstance(x, tuple) or isinstance(y, tuple):
        if type(x) is not type(y) or not hasattr(x, "_fields"):
            raise ModelError("`where` chooses between numbers, or between named tuples of one class")
        return type(x)(*(where(mask, *fields) for fields in zip(x, y, strict=True)))
    if _is_condition(x) or _is_condition(y):
        raise ModelError("`where` chooses between numbers; between conditions, write (mask & x) | ((not mask) & y)")
    if isinstance(mask, bool) and isinstance(x, float | int) and isinstance(y, float | int):
        chosen = x if mask else y
        return result_of("where", (chosen,), chosen) if Number in (type(x), type(y)) else float(chosen)
    return _plain(np.where(mask, x, y))


def replace(record, /, **fields):
    """The record with other values in some fields, such as replace(m, mode=2.0, due=t + 60.0).

    record : a named tuple.  fields : the new values by name; ModelError for a name that the record does not have.
    """
    for name in fields:
        if name not in record._fields:
            raise ModelError(f'{type(record).__name__}(...) has no field "{name}"{hint(name, record._fields)}')
    return record._replace(**fields)


def merged(made, /, *records, **fields):
    """A record of the class `made`: the fields given by name, and all others from the records that have them.

    made : class of a named tuple, such as in merged(Outputs, ground, place, speed=v).  ModelError for a field that the
    class does not have, or that is in none of the records, or in two of them.
    """
    for name in fields:
        if name not in made._fields:
            raise ModelError(f'{made.__name__}(...) has no field "{name}"{hint(name, made._fields)}')
    return made(*(fields[name] if name in fields else _only(made, name, records) for name in made._fields))


def _only(made, name, records):
    """The field of the one record that has it."""
    found = [record for record in records if name in record._fields]
    if len(found) != 1:
        where_from = "no record has" if not found else f"{len(found)} records have"
        raise ModelError(f'merged({made.__name__}, ...): {where_from} the field "{name}"; give it by name')
    return getattr(found[0], name)


@taking_numbers
def two_to(n):
    """2**n for a whole number -1022 <= n <= 1023, given as a float."""
    if isinstance(n, float) and -1100.0 < n < 1024.0:
        return math.ldexp(1.0, int(n))
    n = np.asarray(n, dtype=np.float64)
    return _plain(np.where(np.isfinite(n), np.ldexp(1.0, np.nan_to_num(n).astype(np.int64)), np.nan))


@taking_numbers
def scaled(x, n):
    """x 2**n for 0.5 <= x < 2 and a whole number -1100 <= n <= 1100, given as a float; rounded once.  NaN if n is."""
    if isinstance(x, float) and isinstance(n, float) and -1100.0 <= n < 1023.0:
        return math.ldexp(x, int(n))
    n = np.asarray(n, dtype=np.float64)
    with np.errstate(over="ignore", under="ignore"):
        return _plain(np.where(np.isfinite(n), np.ldexp(x, np.nan_to_num(n).astype(np.int64)), np.nan))


@taking_numbers
def exponent(x):
    """floor(log2 |x|) as a float, for normal x: the number's own binary exponent."""
    if isinstance(x, float):
        return math.frexp(x)[1] - 1.0
    return _plain(np.frexp(x)[1] - 1.0)


@taking_numbers
def mantissa(x):
    """|x| / 2**exponent(x), in [1, 2), for normal x."""
    if isinstance(x, float):
        return math.frexp(abs(x))[0] * 2.0
    return _plain(np.frexp(np.abs(x))[0] * 2.0)


@taking_numbers
def inverse_root_guess(x):
    """1/sqrt(x) to 3.5 %, for normal positive x: half of the exponent with the sign turned, from the bits.

    C. Lomont, Fast inverse square root (Purdue University, 2003), with the constant for doubles by M. Robertson, A
    brief history of InvSqrt (University of New Brunswick, 2012).
    """
    if isinstance(x, float):
        (bits,) = struct.unpack("<Q", struct.pack("<d", x))
        return struct.unpack("<d", struct.pack("<Q", (INVERSE_ROOT_BITS - (bits >> 1)) % 2**64))[0]
    bits = np.asarray(x, dtype=np.float64).view(np.uint64)
    return _plain((np.uint64(INVERSE_ROOT_BITS) - (bits >> np.uint64(1))).view(np.float64))


INVERSE_ROOT_BITS = 0x5FE6EB50C7B537A9

TABLES = "tables"  # name of the settings' field that holds a model's tables


@taking_numbers
def look_up(tables, place):
    """The number at the index `place` of the model's tables.

    place : a whole number from 0 on, as a float or as an integer of a loop.  Below the first index, the first number;
    above the last index, the last one.  NaN for a NaN.
    """
    if isinstance(place, float | int):
        return float(tables[int(min(max(place, 0.0), len(tables) - 1.0))]) if place == place else math.nan
    place = np.asarray(place, dtype=np.float64)
    inside = np.clip(np.nan_to_num(place), 0.0, len(tables) - 1.0)
    return where(place == place, tables[inside.astype(int)], place)


def look_up_record(tables, place, record):
    """The record whose numbers are in the model's tables one after another, the first at index `place`; see `look_up`.

    record : class of a named tuple of numbers; also make the tables from it: [*Row(start=0.0, length=1.0)]
    """
    return record(*(look_up(tables, place + index) for index in range(len(record._fields))))


def any_lane(mask):
    """True if mask is true in at least one lane.  mask : as in `where`."""
    _refuse_number(mask, "any_lane")
    return bool(np.any(mask))


_TRUTH = np.dtype(bool)


def _is_condition(x):
    return isinstance(x, bool) or getattr(x, "dtype", None) == _TRUTH


def _refuse_number(mask, name):
    if not _is_condition(mask):
        raise ModelError(f"`{name}` wants a condition first, and this is none; compare the number, such as x > 0.5")


def _plain(x):
    """NumPy scalars become Python floats, so that interpreted physics prints and compares simply."""
    return float(x) if np.ndim(x) == 0 and np.asarray(x).dtype != bool else x


def _fma_of_floats(x, y, z):
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(z)):
        return x * y + z
    exact = Fraction(x) * Fraction(y) + Fraction(z)
    if exact == 0:
        return x * y + z  # the sign of zero follows IEEE 754
    try:
        return float(exact)
    except OverflowError:
        return math.inf if exact > 0 else -math.inf


def _fma_of_the_library():
    """The C library's fma, which Python has of its own from 3.13 on only; exact rational arithmetic without it."""
    try:
        function = ctypes.CDLL(None).fma
    except (AttributeError, OSError, TypeError):
        return _fma_of_floats  # the same bits, slowly
    function.argtypes, function.restype = [ctypes.c_double] * 3, ctypes.c_double
    return function


_FMA = _fma_of_the_library()
_exact_fma = np.frompyfunc(_FMA, 3, 1)
