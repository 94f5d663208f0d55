"""Calls a model's `prepare` and explains its errors; it is plain NumPy code, with other rules than physics."""

import inspect
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from mc_engine.errors import ModelError
from mc_engine.model.faults import place_in_model
from mc_engine.model.record import Model, Refusals
from mc_engine.suggestions import hint


def call_prepare(model: Model, inputs: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> Any:
    """What the model's `prepare` returns; ModelError with the line and the fix where it misuses what it is handed.

    inputs, settings : float64[n_cases] by symbol, in SI.  Other errors come through as they are.
    """
    assert model.prepare is not None
    if inspect.iscoroutinefunction(model.prepare):
        code = model.prepare.__code__
        place = f"{Path(code.co_filename).name}, line {code.co_firstlineno}"
        raise ModelError(f"{place}: `prepare` is an async def; write def, the engine waits for nothing")
    # refused cases may divide by zero on their way
    with np.errstate(all="ignore"), _explaining(model):
        return model.prepare(inputs, settings, refusals)


@contextmanager
def _explaining(model: Model) -> Iterator[None]:
    """ModelError with the line, the error and the rules of `prepare` for errors of a wrong use."""
    try:
        yield
    except (TypeError, KeyError, AttributeError, ValueError) as error:
        words = f"{type(error).__name__}: {error}"
        if isinstance(error, AttributeError) and isinstance(error.obj, SimpleNamespace):
            words += hint(str(error.name), vars(error.obj))
        raise ModelError(f"{place_in_model(error) or 'the model'}: `prepare`: {words}; {_rules(model)}") from error


def _rules(model: Model) -> str:
    first = next((parameter.symbol for parameter in model.parameters), "altitude")
    return (
        f"`inputs` and `settings` have attributes in SI, without unit, such as inputs.{first}, and vars(inputs) is a "
        "dictionary of them; each holds the numbers of many cases: use NumPy, np.where(condition, a, b), & and |; "
        'cases are refused by refusals.add(mask, "why")'
    )
