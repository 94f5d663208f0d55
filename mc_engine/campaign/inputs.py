"""Checks of single values against the model's inputs, and how values are written in messages."""

from math import isclose

from mc_engine.campaign.reading import Findings, shown
from mc_engine.dates import EXAMPLE, date_text, modified_julian_date
from mc_engine.model.fields import Parameter, Setting
from mc_engine.sampling.distributions import Scalar
from mc_engine.suggestions import hint, listed

_ROUNDING = 1e-15  # 35 cm is 0.35000000000000003 m


def check_value(value: Scalar, item: Parameter | Setting, findings: Findings, key: str) -> Scalar | None:
    """`value` as `item` takes it, or None with the mistake noted: not a number, out of range, a word not known."""
    if isinstance(item, Setting) and item.choices:
        if isinstance(value, str) and value in item.choices:
            return value
        if isinstance(value, str):
            findings.add(key, f"{shown(value)} is not known{hint(value, item.choices)}")
        else:
            findings.add(key, f"{shown(value)} is not one of {listed(item.choices)}")
        return None
    if isinstance(item, Setting) and isinstance(item.default, bool):
        if isinstance(value, bool):
            return value
        findings.add(key, f"{shown(value)} is neither true nor false")
        return None
    if isinstance(item, Setting) and item.date:
        return _checked_date(value, item, findings, key)
    if isinstance(value, bool | str):
        findings.add(key, f"{shown(value)} is not a number; {item.name} is {described(item)}")
        return None
    if not item.low <= value <= item.high:
        findings.add(key, f"{number(value)} is not allowed; the model accepts {accepted_range(item)}")
        return None
    if isinstance(item, Setting) and item.whole and value != int(value):
        findings.add(key, f"{number(value)} is not a whole number; {item.name} is {described(item)}")
        return None
    return float(value)


def _checked_date(value: Scalar, item: Setting, findings: Findings, key: str) -> str | None:
    """The date as text; a number counts as a modified Julian date."""
    try:
        date = modified_julian_date(value) if isinstance(value, str) else float(value)
    except (ValueError, OverflowError):
        date = float("nan")
    if isinstance(value, bool) or date != date:
        findings.add(key, f"{shown(value)} is not a date; write it in UTC as {EXAMPLE}")
        return None
    if not item.low <= date <= item.high:
        findings.add(key, f"{shown(value)} is not allowed; the model accepts {accepted_range(item)}")
        return None
    return date_text(date)


def within_rounding(value: float, item: Parameter | Setting) -> float:
    """`value`, or the end of the range of `item` where only the rounding of a unit's conversion keeps it off."""
    return _near_end(value, item, 0.0)


def about(centre: float, reach: float, item: Parameter | Setting) -> tuple[float, float]:
    """centre - reach and centre + reach, at the ends of the range of `item` where only rounding keeps them off."""
    size = abs(centre)
    return _near_end(centre - reach, item, size), _near_end(centre + reach, item, size)


def _near_end(value: float, item: Parameter | Setting, size: float) -> float:
    ends = (item.low, item.high)
    return next((end for end in ends if isclose(value, end, rel_tol=_ROUNDING, abs_tol=_ROUNDING * size)), value)


def accepted_range(item: Parameter | Setting) -> str:
    """The range of numbers, or dates, that the input accepts, with its unit."""
    if isinstance(item, Setting) and item.date:
        return f"{date_text(item.low)} to {date_text(item.high)}"
    unit = f" {item.unit}" if item.unit else ""
    if item.low > float("-inf") and item.high < float("inf"):
        return f"{number(item.low)} to {number(item.high)}{unit}"
    if item.low > float("-inf"):
        return f"{number(item.low)}{unit} and above"
    if item.high < float("inf"):
        return f"{number(item.high)}{unit} and below"
    return "any finite number"


def described(item: Parameter | Setting) -> str:
    """What the input is, with its unit."""
    return f"{item.description} [{item.unit}]" if item.unit else item.description


def number(value: float) -> str:
    """A number as text: no trailing zeros, ten digits at most."""
    return f"{value:.10g}"
