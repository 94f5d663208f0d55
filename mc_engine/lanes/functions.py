"""Arithmetic on a number or on a vector of cases: the functions that physics imports instead of `math`.

Each function here is its own interpreted meaning, on floats and NumPy arrays.  Compiled physics uses the
vector instruction of the same name (see `lowering`), with the same result to the last bit.
"""

import ctypes
import math
from fractions import Fraction

import numpy as np

from mc_engine.errors import ModelError


def sqrt(x):
    """Square root; NaN below zero.  Correctly rounded."""
    with np.errstate(invalid="ignore"):
        return _plain(np.sqrt(x))


def fma(x, y, z):
    """x y + z with one rounding."""
    with np.errstate(all="ignore"):
        return _plain(np.asarray(_exact_fma(x, y, z), dtype=np.float64))


def rint(x):
    """Nearest whole number, halves to even."""
    return _plain(np.rint(x))


def floor(x):
    """Largest whole number not above x."""
    return _plain(np.floor(x))


def minimum(x, y):
    """The smaller of x and y; y where either is not a number."""
    return where(x < y, x, y)


def maximum(x, y):
    """The larger of x and y; y where either is not a number."""
    return where(x > y, x, y)


def copysign(x, y):
    """|x| with the sign of y."""
    return _plain(np.copysign(x, y))


def where(mask, x, y):
    """x where mask holds, y elsewhere.  Both are computed, so their arguments must be in range.

    mask : truth values, as a comparison gives them.  x, y : numbers.  ModelError for others, which kernels refuse, too.
    """
    _refuse_number(mask, "where")
    if _is_condition(x) or _is_condition(y):
        raise ModelError("`where` chooses between numbers; between conditions, write (mask & x) | ((not mask) & y)")
    return _plain(np.where(mask, x, y))


def two_to(n):
    """2**n for a whole number -1022 <= n <= 1023, given as a float."""
    n = np.asarray(n, dtype=np.float64)
    return _plain(np.where(np.isfinite(n), np.ldexp(1.0, np.nan_to_num(n).astype(np.int64)), np.nan))


def exponent(x):
    """floor(log2 |x|) as a float, for normal x: the number's own binary exponent."""
    return _plain(np.frexp(x)[1] - 1.0)


def mantissa(x):
    """|x| / 2**exponent(x), in [1, 2), for normal x."""
    return _plain(np.frexp(np.abs(x))[0] * 2.0)


TABLES = "tables"  # name of the settings' field that holds a model's tables


def look_up(tables, place):
    """The number at `place` of the model's tables: a whole number as a float.

    Below the first place, and where the place is not a number, the first; above the last, the last: a flight that has
    gone astray reads nothing foreign.
    """
    if isinstance(place, float):  # NumPy would take ten times as long, and designs look up hundreds of thousands
        return float(tables[int(min(place, len(tables) - 1.0))]) if place > 0.0 else float(tables[0])
    inside = np.clip(np.nan_to_num(np.asarray(place, dtype=np.float64)), 0.0, len(tables) - 1.0)
    return _plain(tables[inside.astype(int)])


def any_lane(mask):
    """True if mask holds in at least one lane.  mask : as in `where`."""
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


_exact_fma = np.frompyfunc(_fma_of_the_library(), 3, 1)
