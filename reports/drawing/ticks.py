"""Round tick values of an axis, and their texts."""

from math import ceil, floor, inf, log10

from reports.text.numbers import SPACE, SUPERSCRIPT, number

MOST_TICKS = 6  # of an axis
STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)


def nice_ticks(low: float, high: float, most: int, *, whole: bool = False, cover: bool = False) -> list[float]:
    """Round values at most `most` steps long: between low and high, whichever is larger, or, to cover them, beyond."""
    low, high = min(low, high), max(low, high)
    rough, step = (high - low) / max(most, 1), 1.0
    if 0.0 < rough < inf:
        power = 10.0 ** floor(log10(rough))
        step = next(power * step for step in STEPS if power * step >= rough * (1.0 - 1e-9))
    step = max(ceil(step), 1) if whole else step
    inner = ceil(low / step - 1e-6), floor(high / step + 1e-6)
    outer = floor(low / step + 1e-9), ceil(high / step - 1e-9)
    first, last = outer if cover else inner
    return [float(f"{k * step:.12g}") for k in range(first, last + 1)]


def log_ticks(low: float, high: float, most: int = 8) -> list[float]:
    """1, 2 and 5 times powers of ten between low and high; of more than `most` of them some powers alone, 1 too."""
    powers = range(floor(log10(low)) - 1, ceil(log10(high)) + 1)
    for digits, every in (((1, 2, 5), 1), *(((1,), every) for every in range(1, len(powers) + 1))):
        places = [float(f"{digit}e{power}") for power in powers if power % every == 0 for digit in digits]
        places = [place for place in places if low * (1 - 1e-9) <= place <= high * (1 + 1e-9)]
        if len(places) <= most:
            break
    return places


def axis_ticks(low: float, high: float, most: int = MOST_TICKS, log: bool = False, whole: bool = False) -> list[float]:
    """Round values of an axis; a logarithmic one of less than a decade gets those of a linear one."""
    return log_ticks(low, high, most) if log and high >= 10.0 * low else nice_ticks(low, high, most, whole=whole)


def numerals(places: list[float], log: bool) -> tuple[list[str], str]:
    """The places as text with the same decimals each, and the power of ten taken out of them ("" or "×10⁶").

    Over a decade of a logarithmic axis each place has digits of its own.
    """
    if log and places[-1] >= 10.0 * places[0]:
        return [number(place, 3).removeprefix("1·") for place in places], ""
    largest = max(map(abs, places), default=0.0)
    power = 3 * floor(log10(largest) / 3.0 + 1e-9) if largest >= 1e6 or 0.0 < largest < 1e-3 else 0
    shown = [float(f"{place / 10.0**power:.12g}") for place in places]
    decimals = max((len(f"{item:.9f}".rstrip("0").partition(".")[2]) for item in shown), default=0)
    groups = SPACE if largest >= 1e4 else ""
    texts = [f"{item + 0.0:,.{decimals}f}".replace("-", "−").replace(",", groups) for item in shown]
    return texts, f"×10{str(power).translate(SUPERSCRIPT)}" if power else ""
