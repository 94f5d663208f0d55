"""The call of a model's `prepare`, and what its mistakes mean: it has other rules than physics, being plain NumPy."""

import inspect
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from mc_engine.errors import ModelError
from mc_engine.model import Model, Refusals
from mc_engine.model_faults import place_in_model
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
    try:
        yield
    except (TypeError, KeyError, AttributeError, ValueError) as error:
        if words := _meaning(error, model):
            raise ModelError(f"{place_in_model(error) or 'the model'}: `prepare`: {words}") from error
        raise


def _meaning(error: Exception, model: Model) -> str:
    """What an error says of the use of inputs, settings and refusals, or of arrays; "" for any other."""
    text, handed = str(error), getattr(error, "obj", None)
    if isinstance(error, KeyError):
        name = error.args[0] if error.args else None
        return _no_input(name, model, [one.symbol for one in model.parameters]) if isinstance(name, str) else ""
    if isinstance(handed, SimpleNamespace) and isinstance(error, AttributeError):
        return _no_input(str(error.name), model, list(vars(handed)))
    if "SimpleNamespace" in text:
        first = next((one.symbol for one in model.parameters), "altitude")
        return f"inputs and settings are attributes, as in inputs.{first}; vars(inputs) is a dictionary of them all"
    if isinstance(handed, Refusals) or "Refusals" in text:
        return 'cases are refused by refusals.add(mask, "why they cannot start")'
    if "truth value of an array" in text:
        return "`if`, `and`, `or` or `not` on the numbers of many cases; use np.where(condition, a, b), and & | ~"
    if "only length-1 arrays" in text or "only 0-dimensional arrays" in text or "must be real number, not" in text:
        return "a function of `math`, or int() or float(), on the numbers of many cases; take it from NumPy"
    return ""


def _no_input(name: str, model: Model, known: list[str]) -> str:
    """There is none of this name among those that were handed over: of another kind, or without its unit.

    known : the names that there are.
    """
    for place, items in (("inputs", model.parameters), ("settings", model.settings)):
        for one in items:
            if name in (one.symbol, one.name):
                unit = ", without its unit and in SI" if name != one.symbol else ""
                return f'there is no "{name}" here; it is {place}.{one.symbol}{unit}'
    return f'there is no "{name}" here{hint(name, known)}'
