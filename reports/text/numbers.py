"""Numbers and names as text for readers: a suitable number of digits, a true minus sign, units with every name."""

import re
from collections.abc import Callable, Iterable, Sequence
from decimal import Decimal
from functools import partial
from itertools import pairwise
from math import floor, isfinite, log10

from mc_engine.numbers_in_text import MOST_GIVEN, decimals_of, outward, percent_digits
from mc_engine.statistics.summary import nearly_equal
from mc_engine.units import UNITS, unit_suffix

NO_BREAK = "\N{NO-BREAK SPACE}"
SPACE = "\u202f"  # narrow, no-break: groups digits and stands before a unit
MOST_DIGITS = 8  # of one number in a table
MOST_BESIDE = 11  # of one whose spread is told beside it: a Julian date to some seconds
LONGEST_SYMBOL = 3  # letters
LONGEST_LABEL = 44  # letters of an axis label, without its unit
SUPERSCRIPT = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_NEGLIGIBLE = 1e-6  # of a spread
_LEAST_P = 1e-12  # a smaller p-value says no more


def count(number: int) -> str:
    """A whole number with its digits in groups of three: 10 000."""
    return f"{number:,}".replace(",", SPACE).replace("-", "−")


def capitalised(text: str) -> str:
    """With a capital first letter; unlike `str.capitalize` it leaves the others as they are."""
    return text[:1].upper() + text[1:]


def counted(number: int, noun: str) -> str:
    """A whole number with its noun: 1 case, 2 cases."""
    return f"{count(number)} {noun}{'' if number == 1 else 's'}"


def used_of(used: Sequence[int], tried: int) -> str:
    """How many of those tried the metrics of a figure use: 724 to 1 000 of 1 000, or one number for all of them."""
    few, most = min(used), max(used)
    return f"{count(few)}{f' to {count(most)}' * (few != most)} of {count(tried)}"


def first_of(shown: int, known: int, noun: str) -> str:
    """What a figure or a table shows of several: key metrics, or first 8 of 15 key metrics."""
    return noun if shown >= known else f"first {count(shown)} of {count(known)} {noun}"


def number(value: float | None, digits: int = 5, scale: float | None = None, up: bool | None = None) -> str:
    """`value` to `digits` significant digits, or to three digits of `scale` (a spread) if that is finer.

    None is a dash; what is nothing beside the scale is 0.  Very large and very small values are powers of ten.
    up : of a bound, whether it is rounded up or down; other numbers are rounded to nearest.
    """
    if value is None:
        return "–"
    value = float(value)
    if not isfinite(value):
        return "not a number" if value != value else ("∞" if value > 0 else "−∞")
    if value == 0.0 or (up is None and scale is not None and abs(value) < _NEGLIGIBLE * scale):
        return "0"
    coarse = scale is not None and isfinite(scale) and scale >= 1e-4  # a small value needs no digits of its own
    if abs(value) >= 1e7 or (abs(value) < 1e-4 and not coarse):
        decimals = max(digits - 2, 2)
        if scale is not None and isfinite(scale) and scale > 0.0:
            decimals = max(decimals, min(2 + floor(log10(abs(value))) - floor(log10(scale)), MOST_GIVEN - 1))
        value = value if up is None else outward(value, decimals_of(value, decimals + 1), up)
        mantissa, exponent = f"{value:.{decimals}e}".split("e")
        return _power(_trim(mantissa), int(exponent))
    decimals = max(decimals_of(value, digits), 0)
    if scale is not None and isfinite(scale) and scale > 0.0:
        room = max(decimals_of(value, MOST_BESIDE), 0)
        decimals = min(max(2 - floor(log10(scale)), 0), room, MOST_DIGITS)
    value = value if up is None else outward(value, decimals, up)
    text = fixed(value, decimals)
    if not text.strip("0."):
        return "0"
    return _trim(text) if scale is None else text


def limit_number(value: float) -> str:
    """A limit with all digits that it was given, such as those of a Julian date, also in kilometres in place of metres.

    A limit that a conversion gave more digits than anybody wrote, such as 100/3, is told apart from bounds beside it.
    """
    given = len(Decimal(f"{value:.15g}").normalize().as_tuple().digits)  # the last digits of a double are rounding
    return _significant(value, max(given, 5) if given <= MOST_GIVEN else MOST_DIGITS)


def beside_limit(value: float, margin: float | None, up: bool) -> str:
    """A bound that is compared with a limit: in five digits, or as many as show the margin in three.

    up : whether it bounds from above, and is rounded up.
    """
    if not value or not margin or not isfinite(value) or not isfinite(margin):
        return number(value, up=up)
    digits = max(3 + floor(log10(abs(value))) - floor(log10(abs(margin))), 5)
    return number(value, up=up) if digits == 5 else _significant(value, min(digits, MOST_GIVEN), up)


def _significant(value: float, digits: int, up: bool | None = None) -> str:
    """All the digits asked for; `number` has one less beside a power of ten."""
    beside_power = abs(value) >= 1e7 or abs(value) < 1e-4
    return number(value, digits + 1 if beside_power else digits, up=up)


def _power(mantissa: str, exponent: int) -> str:
    return f"{mantissa}·10{str(exponent).translate(SUPERSCRIPT)}".replace("-", "−")


def column_texts(values: Sequence[float | None]) -> list[str]:
    """The numbers of one column of a table: digits follow their spread, and values that differ never print alike.

    Whole numbers have no decimals.
    """
    numbers = [value for value in values if value is not None and isfinite(value)]
    distinct = sorted(set(numbers))
    apart = [b for a, b in pairwise(distinct) if not nearly_equal(a, b)]
    if not apart:  # a number such as a Julian date keeps its fraction
        return [number(value, 4 if value is None or abs(value) < 1e4 else MOST_DIGITS) for value in values]
    largest, spread = max(map(abs, numbers)), distinct[-1] - distinct[0]
    if largest < 1e7 and (spread >= 1e-5 or largest >= 1e-4):
        whole = all(value.is_integer() for value in map(float, numbers))
        decimals = range(0 if whole else min(max(2 - floor(log10(spread)), 0), MOST_DIGITS), 16)
        styles: Iterable[Callable[[float], str]] = (partial(fixed, decimals=digits) for digits in decimals)
    else:
        styles = (partial(number, digits=digits) for digits in range(4, 18))
    for style in styles:
        texts = [number(value) if value is None or not isfinite(value) else style(value) for value in values]
        if len({style(value) for value in numbers}) > len(apart):
            break
    return texts


def fixed(value: float, decimals: int) -> str:
    """A number with so many decimals; what rounds to zero has no sign."""
    text = f"{value:,.{decimals}f}" if abs(value) >= 1e4 else f"{value:.{decimals}f}"
    return text.removeprefix("-" if float(text.replace(",", "")) == 0.0 else " ").replace(",", SPACE).replace("-", "−")


def _trim(text: str) -> str:
    return text.rstrip("0").rstrip(".") if "." in text else text


def interval(lower: float | None, upper: float | None, scale: float | None = None, digits: int = 5) -> str:
    """[lower, upper], each rounded outward; a limit that the cases are too few for is a dash."""
    if lower is None and upper is None:
        return "too few cases"
    return f"[{number(lower, digits, scale, up=False)}, {number(upper, digits, scale, up=True)}]"


def percent(share: float | None, digits: int = 2, up: bool = False) -> str:
    """A share in percent, rounded down, with more digits where it is near 100 % and no more than needed there.

    up : rounded up, as an upper bound and a risk are.
    """
    if share is None:
        return "–"
    unit = 1.0 if up else 0.5  # of the last digit, within which 100 % would be printed
    while 0.0 < 1.0 - share < unit * 10.0 ** -(digits + 2) and digits < 8:
        digits += 1
    return f"{_trim(f'{outward(100.0 * share, digits, up):.{digits}f}')}{SPACE}%"


def given_percent(share: float) -> str:
    """A share that somebody gave, such as one that is required, in percent with all its digits: 99.996833 %."""
    return f"{percent_digits(share)}{SPACE}%"


def percentile(probability: float) -> str:
    """A percentile by its name: 99.865th percentile."""
    text = percent_digits(probability)
    ending = {"1": "st", "2": "nd", "3": "rd"}.get(text[-1], "th") if text[-2:-1] != "1" else "th"
    return f"{text}{ending} percentile"


def p_value(value: float) -> str:
    """A p-value: 0.012, or < 1·10⁻¹²."""
    return number(value, 2) if value >= _LEAST_P else f"<{SPACE}{number(_LEAST_P, 2)}"


def exact(value: float | str | bool) -> str:
    """An input as it was given: all its digits, as few as tell the number, yes and no for switches."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    text = repr(float(value))
    if isfinite(value) and ("e" in text or abs(value) >= 1e7):
        mantissa, exponent = f"{Decimal(text).normalize():e}".split("e")
        return _power(mantissa, int(exponent))
    return text.removesuffix(".0").replace("-", "−")


def spelled(text: str) -> str:
    """The words of a distribution with signs, powers and units as they are printed: 1·10⁻⁵ for 1e-05, m² for m^2.

    No line ends before a unit or a value.
    """
    days = re.sub(r"(?<=\d)(?<!= 1)(?<!up to 1) day\b", " days", text)
    joined = re.sub(r"(?<=\d) (?=[%°µA-Za-z])(?!to\b)", SPACE, days).replace(" = ", f"{NO_BREAK}={NO_BREAK}")
    powers = re.sub(r"(?<![\w.])(-?\d[\d.]*)e([+-]?\d+)(?!\w)", lambda power: _power(power[1], int(power[2])), joined)
    return re.sub(r"(?<!\S)-(?=\d)", "−", _raised(powers))


def with_unit(text: str, unit: str) -> str:
    """A number with its unit behind it: 2.5 kg, 1 day, 10 days."""
    return f"{text}{SPACE}{unit if text == '1' and unit == 'day' else typeset(unit)}" if unit else text


def words(name: str, unit: str) -> str:
    """A column name as words, without its unit suffix: correction_impulse_m_s is "correction impulse"."""
    suffix = unit_suffix(unit) if unit in UNITS else ""
    return (name.removesuffix(suffix) or name).replace("_", " ").strip()


def named(name: str, meaning: str) -> str:
    """A name in words; one that is a mere symbol, such as "ve", with its meaning up to a comma or semicolon.

    A symbol has no word of more than three letters.  A meaning too long for an axis is left out.
    """
    clause = re.split("[,;]", meaning)[0].strip()
    if not clause or any(len(word) > LONGEST_SYMBOL for word in name.split()):
        return name
    text = clause if clause.lower().startswith(name.lower()) else f"{name}: {clause}"
    return text if len(text) <= LONGEST_LABEL else name


def axis_label(text: str, unit: str) -> str:
    """A label with its unit in brackets."""
    return f"{text} [{typeset(unit)}]" if unit else text


def same_lengths(unit: str, other: str) -> bool:
    """Whether both units are one unit of length, so that a figure of both columns can be to scale."""
    return unit == other and unit in UNITS and UNITS[unit].quantity == "length"


def typeset(unit: str) -> str:
    """A unit as it is printed: W/m² for W/m^2, µN for uN, deg/√h for deg/sqrt(h), days for day."""
    if unit == "day":
        return "days"
    rooted = re.sub(r"sqrt\((\w)\)", r"√\1", _raised(unit))
    return re.sub(r"\bu(?=(?:m|s|g|N|T|rad)\b)", "µ", rooted).replace("Ohm", "Ω").replace(" ", SPACE)


def _raised(text: str) -> str:
    return re.sub(r"\^(\d+)(?!\w)", lambda power: power[1].translate(SUPERSCRIPT), text)
