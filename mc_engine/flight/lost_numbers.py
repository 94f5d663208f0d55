"""The first operation of a flight with an infinite or NaN result, as a sentence: file, line, source and operands."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mc_engine.campaign.loading import Campaign
from mc_engine.flight.flight import fly_interpreted
from mc_engine.flight.flyer import NOMINAL_NOISE, Columns
from mc_engine.lanes.number import Origin
from mc_engine.model.faults import is_the_users, origin_sentence, place_in_model
from mc_engine.model.record import Model, compiled_model
from mc_engine.status import NOT_FINITE, OK, STATUS_NAME

if TYPE_CHECKING:
    from mc_engine.flight.interpreted import InterpretedFlight

PATIENCE_S = 60.0  # of a flight to find the line


def may_be_lost(model: Model, flight: Columns) -> bool:
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
    from mc_engine.flight.interpreted import InterpretedFlight, OutOfTime  # which loads the compiler

    flight = InterpretedFlight(model, seconds)
    try:
        _, status, _, _ = fly_interpreted(flight, inputs, case_id, seed)
    except OutOfTime as late:
        return (f"{who}: the flight that looks for the line was given up after {seconds:.0f} s, at t = {late.t:.6g} s; "
                "it was finite until then")  # fmt: skip
    except ArithmeticError as error:  # of two numbers outside of the physics: kernels go on with an infinity
        return f"{who}: the flight that looks for the line cannot go on from {place_in_model(error)}: {error}"
    origin, metric = origin_of(flight, int(status[0]))
    if origin is None:
        return ""
    return f'"{metric}": {origin_sentence(origin, who)}' if metric else origin_sentence(origin, who)


def not_finite(
    campaign: Campaign,
    inputs: Mapping[str, Any],
    ids: np.ndarray,
    flown: Columns,
    nominal: Columns,
) -> list[str]:
    """One sentence with the line of the model if a flight ended not-finite: the nominal one, or the first of these."""
    word = STATUS_NAME[NOT_FINITE]
    bad = np.flatnonzero(flown["status"] == word)
    row, case_id, who = campaign.nominal, NOMINAL_NOISE, "the nominal case"
    if nominal["status"][0] != word:
        if not bad.size:
            return []
        row = {name: value[bad[0]] if np.ndim(value) else value for name, value in inputs.items()}
        case_id, who = int(ids[bad[0]]), f"case {ids[bad[0]]}"
    sentence = first_lost(compiled_model(campaign.model), row, case_id, campaign.seed, who)
    return [f"{sentence}; {bad.size} of the first {ids.size} cases end {word}"] if sentence else []


def origin_of(flight: "InterpretedFlight", status: int) -> tuple[Origin | None, str]:
    """What broke a flight that has ended, and ""; or what made a metric not a number, and its name; or None.

    status : as the flight ended.
    """
    if status == NOT_FINITE:
        return flight.origin, ""
    for metric, value in zip(flight.model.metrics, flight.metrics, strict=False):
        if status == OK and math.isnan(value) and not metric.sometimes and (origin := value.origin) is not None:
            if any(is_the_users(Path(place.file)) for place in origin.places):  # not of an event that did not happen
                return origin, metric.name
    return None, ""
