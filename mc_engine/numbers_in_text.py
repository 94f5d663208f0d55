"""The syntax of numbers in tables, messages and on the command line: ASCII digits, sign, point and exponent.

Python itself would also accept 1_0, digits of other scripts, nan and infinity.
"""

import re
from decimal import Decimal

LARGEST_WHOLE = 2**63 - 1
LEAST_SHARE = 1e-12  # and 1 less it is the most: beyond, 1 - share has too few digits

_GIVEN_DIGITS = 14  # of a share that is printed as it was given; a double's last ones are rounding

_WHOLE = re.compile(r"[+-]?[0-9]{1,30}")
_REAL = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,9})?")


def is_whole(text: str) -> bool:
    """True for the text of a whole number that int64 holds."""
    return _WHOLE.fullmatch(text) is not None and abs(int(text)) <= LARGEST_WHOLE


def is_real(text: str) -> bool:
    """True for the text of a number that float64 holds; it may be so large that it is read as infinite."""
    return _REAL.fullmatch(text) is not None


def percent_digits(share: float) -> str:
    """A share that somebody gave, in percent with all its digits: 99.996833 for 0.99996833."""
    return f"{(Decimal(f'{share:.{_GIVEN_DIGITS}g}') * 100).normalize():f}"
