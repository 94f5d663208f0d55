"""Calls a model's `prepare` and explains its errors; it is plain NumPy code, with other rules than physics."""

import inspect
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from mc_engine.errors import ModelError
from mc_engine.model.faults import place_in_model
from mc_engine.model.fields import Parameter
from mc_engine.model.record import Model, Refusals
from mc_engine.suggestions import hint

MISUSES = (TypeError, KeyError, AttributeError, ValueError)


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
    except MISUSES as error:
        raise ModelError(f"{place_in_model(error) or 'the model'}: {misuse(error, model.parameters)}") from error


def misuse(error: Exception, parameters: Sequence[Parameter]) -> str:
    """The error of a wrong use of what `prepare` is handed, with the rules."""
    words = f"{type(error).__name__}: {error}"
    if isinstance(error, AttributeError) and isinstance(error.obj, SimpleNamespace):
        words += hint(str(error.name), vars(error.obj))
    first = next((parameter.symbol for parameter in parameters), "altitude")
    return (
        f"`prepare`: {words}; "
        f"`inputs` and `settings` have attributes in SI, without unit, such as inputs.{first}, and vars(inputs) is a "
        "dictionary of them; each holds the numbers of many cases: use NumPy, np.where(condition, a, b), & and |; "
        'cases are refused by refusals.add(mask, "why")'
    )
