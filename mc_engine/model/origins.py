"""Describes where a number became infinite or NaN: operation, location in the model's source, and operands."""

import math
from pathlib import Path

from mc_engine.lanes.number import Origin
from mc_engine.model.faults import is_the_users, source_place

_FUNCTIONS = {"sqrt": "the square root", "log": "the logarithm", "asin": "the arc sine", "acos": "the arc cosine",
              "tan": "the tangent", "exp": "the exponential"}  # fmt: skip


def sentence(origin: Origin, who: str = "") -> str:
    """What happened, where, and when.  who : the case in words."""
    when = f"t = {origin.t:.6g} s" if math.isfinite(origin.t) else ""
    happened = f"{_what(origin)} ({', '.join(part for part in (when, who) if part)})"
    if not origin.places:
        return happened
    ours = [place for place in origin.places if is_the_users(Path(place.file))] or [origin.places[-1]]
    if ours[0] is not origin.places[0]:
        happened = f"in {origin.places[0]}, {happened}"
    if len(ours) > 1:
        happened += f", called by {ours[-1]}"
    return f"{source_place(*ours[0])}: {happened}"


def _what(origin: Origin) -> str:
    if not origin.arguments:
        return origin.operation
    result = "not a number" if math.isnan(origin.result) else "infinite"
    values = [f"{argument:.6g}" for argument in origin.arguments if isinstance(argument, float | int)]
    if origin.operation in _FUNCTIONS:
        return f"{_FUNCTIONS[origin.operation]} of {values[0]} is {result}"
    if origin.operation.isidentifier():
        return f"{origin.operation}({', '.join(values)}) is {result}"
    return f"{f' {origin.operation} '.join(values)} is {result}"
