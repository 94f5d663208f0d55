"""Round tick values of an axis, and their texts."""

from itertools import pairwise
from math import ceil, floor, isfinite, log10

from reports.text.numbers import SPACE, number

STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
_SUPERSCRIPT = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def nice_step(low: float, high: float, most: int, whole: bool = False) -> float:
    """The smallest round step that divides low to high into at most so many parts."""
    rough = (high - low) / max(most, 1)
    if not rough > 0.0 or not isfinite(rough):
        return 1.0
    power = 10.0 ** floor(log10(rough))
    step = next(power * step for step in STEPS if power * step >= rough * (1.0 - 1e-9))
    return float(max(ceil(step), 1)) if whole else step


def nice_ticks(low: float, high: float, most: int = 6, whole: bool = False) -> list[float]:
    """Round tick values between low and high, whichever is larger, with at most `most` steps."""
    low, high = min(low, high), max(low, high)
    step = nice_step(low, high, most, whole)
    first, last = ceil(low / step - 1e-6), floor(high / step + 1e-6)
    return [float(f"{k * step:.12g}") for k in range(first, last + 1)]


def covering(low: float, high: float, most: int) -> list[float]:
    """Round values that cover low to high: the first is at most low, the last at least high."""
    step = nice_step(low, high, most)
    return [float(f"{k * step:.12g}") for k in range(floor(low / step + 1e-9), ceil(high / step - 1e-9) + 1)]


def log_ticks(low: float, high: float, most: int = 8) -> list[float]:
    """1, 2 and 5 times powers of ten between low and high; of more than `most` of them the powers alone, or fewer."""
    powers = range(floor(log10(low)) - 1, ceil(log10(high)) + 1)
    places = [float(f"{step}e{power}") for power in powers for step in (1, 2, 5)]
    places = [place for place in places if low * (1 - 1e-9) <= place <= high * (1 + 1e-9)]
    if len(places) > most:
        places = [place for place in places if f"{place:e}"[0] == "1"]
        places = places[:: ceil(len(places) / most)]
    return places


def numerals(places: list[float]) -> tuple[list[str], str]:
    """The places as text with the same decimals each, and the power of ten taken out of them ("" or "×10⁶")."""
    largest = max((abs(place) for place in places), default=0.0)
    power = 0
    if largest >= 1e6 or 0.0 < largest < 1e-3:
        power = 3 * floor(log10(largest) / 3.0 + 1e-9)
    shown = [place / 10.0**power for place in places]
    gaps = [b - a for a, b in pairwise(shown)]
    decimals = 0
    while decimals < 9 and any(abs(item - round(item, decimals)) > 1e-4 * (gaps[0] if gaps else 1.0) for item in shown):
        decimals += 1
    texts = [
        f"{item + 0.0:,.{decimals}f}".replace("-", "−").replace(",", SPACE if largest >= 1e4 else "") for item in shown
    ]
    return texts, f"×10{str(power).translate(_SUPERSCRIPT)}" if power else ""


def log_numerals(places: list[float]) -> list[str]:
    """Places of a logarithmic axis as text; powers of ten that are far from 1 as such."""
    return [
        number(place, 3).removeprefix("1·") if number(place, 3).startswith("1·") else number(place, 3)
        for place in places
    ]
