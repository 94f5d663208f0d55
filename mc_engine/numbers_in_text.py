"""The syntax of numbers in tables, messages and on the command line: ASCII digits, sign, point and exponent.

Python itself would also accept 1_0, digits of other scripts, nan and infinity.
"""

import re
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal
from math import floor, isfinite, log10

LARGEST_WHOLE = 2**63 - 1
LEAST_SHARE = 1e-12  # and 1 less it is the most: beyond, 1 - share has too few digits

_SLACK = Decimal("1e-6")  # of a last digit: a number nearer to a printed one differs from it by rounding alone
MOST_GIVEN = 14  # digits of a number that somebody wrote; a double's last ones are rounding, or of a conversion

_WHOLE = re.compile(r"[+-]?[0-9]{1,30}")
_REAL = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,9})?")


def is_whole(text: str) -> bool:
    """True for the text of a whole number that int64 holds."""
    return _WHOLE.fullmatch(text) is not None and abs(int(text)) <= LARGEST_WHOLE


def is_real(text: str) -> bool:
    """True for the text of a number that float64 holds; it may be so large that it is read as infinite."""
    return _REAL.fullmatch(text) is not None


def is_number(text: str) -> bool:
    """True for the text of a number as programs write it, which may be infinite or not a number."""
    return is_real(text) or text.lower().removeprefix("+").removeprefix("-") in ("nan", "inf", "infinity")


def counted(number: int, noun: str) -> str:
    """A whole number with its noun: 1 case, 2,000 cases."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def percent_digits(share: float) -> str:
    """A given fraction in percent, with all its digits: 99.996833 for 0.99996833."""
    return f"{(Decimal(f'{share:.{MOST_GIVEN}g}') * 100).normalize():f}"


def chance_percent(chance: float, decimals: int = 1) -> str:
    """A probability that is neither 0 nor 1, in percent: 31.6, or < 0.1 and > 99.9 where it would round to an end."""
    percent, step = f"{100.0 * chance:.{decimals}f}", 0.1**decimals
    if float(percent) == 0.0:
        return f"< {step:.{decimals}f}"
    return f"> {100.0 - step:.{decimals}f}" if float(percent) == 100.0 else percent


def outward(value: float, decimals: int, up: bool) -> float:
    """`value` to this number of decimals, rounded up or down, so that a printed bound claims no more than was shown."""
    scaled = Decimal(repr(float(value))).scaleb(decimals)
    whole = (scaled - _SLACK if up else scaled + _SLACK).to_integral_value(ROUND_CEILING if up else ROUND_FLOOR)
    return float(whole.scaleb(-decimals)) + 0.0  # not -0


def decimals_of(value: float, digits: int) -> int:
    """The decimals with which a finite number has so many significant digits; negative for large numbers."""
    return digits - 1 - floor(log10(abs(value))) if value else 0


def digits_within(low: float, high: float, least: int = 5) -> int:
    """The significant digits that show a thousandth of a range, as of temperatures from 300.01 to 300.02 K."""
    size, width = max(abs(low), abs(high)), high - low
    if not isfinite(size) or not isfinite(width) or not width > 0.0:
        return least
    return min(max(3 + floor(log10(size)) - floor(log10(width)), least), MOST_GIVEN)
