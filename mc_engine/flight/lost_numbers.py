"""The first operation of a flight whose result is infinite or NaN, as a sentence: file, line, source and operands."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from mc_engine.flight.flight import fly_interpreted
from mc_engine.model.faults import place_in_model
from mc_engine.model.origins import sentence
from mc_engine.model.record import Model
from mc_engine.status import NOT_FINITE, OK, STATUS_NAME

PATIENCE_S = 60.0  # of a flight to find the line


def may_be_lost(model: Model, flight: Mapping[str, np.ndarray]) -> bool:
    """Whether a flight of one case ended not-finite, or gave a metric that is not a number.  flight : its columns."""
    if flight["status"][0] == STATUS_NAME[OK]:
        return any(not metric.sometimes and bool(np.isnan(flight[metric.name][0])) for metric in model.metrics)
    return bool(flight["status"][0] == STATUS_NAME[NOT_FINITE])


def first_lost(
    model: Model, inputs: Mapping[str, Any], case_id: int, seed: int, who: str, seconds: float = PATIENCE_S
) -> str:
    """The sentence on the number that broke a flight, or made a metric not a number; "" for a flight without.

    By an interpreted flight of the case, which takes some milliseconds a step; it is given up after so many seconds.
    who : the case in words.
    """
    from mc_engine.flight.interpreted import OutOfTime  # which loads the compiler

    try:
        (_, status, _, _), flight = fly_interpreted(model, inputs, case_id, seed, seconds)
    except OutOfTime as late:
        return (f"{who}: the flight that looks for the line was given up after {seconds:.0f} s, at t = {late.t:.6g} s; "
                "it was finite until then")  # fmt: skip
    except ArithmeticError as error:  # of two numbers outside of the physics: kernels go on with an infinity
        return f"{who}: the flight that looks for the line cannot go on from {place_in_model(error)}: {error}"
    if status[0] == NOT_FINITE:
        return sentence(flight.origin, who) if flight.origin is not None else ""
    for metric, value in zip(model.metrics, flight.metrics, strict=False):
        if status[0] == OK and math.isnan(value) and not metric.sometimes and value.origin is not None:
            return f'"{metric.name}": {sentence(value.origin, who)}'
    return ""
