"""Preparation of cases for the kernel: inputs in SI, the kernel parameters from the model's `prepare`, refused cases.

`prepare` is plain NumPy code with other rules than physics, so its errors are explained here.
"""

import inspect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from mc_engine.errors import ModelError
from mc_engine.lanes.functions import TABLES
from mc_engine.model.faults import place_in_model
from mc_engine.model.fields import Parameter
from mc_engine.model.reading import place_of
from mc_engine.model.record import Model, Refusals
from mc_engine.suggestions import hint

MISUSES = (TypeError, KeyError, AttributeError, ValueError)


@dataclass
class Prepared:
    """Cases ready for the kernel: SI parameter rows, setting codes, and which cases were refused and why."""

    parameters: np.ndarray  # float64[n_kernel_parameters, n]
    settings: np.ndarray  # float64[n, n_settings]; of a model without settings one column of zeros
    refusals: Refusals
    tables: np.ndarray  # float64[...], what `prepare` adds to the model's tables, one case's numbers after another's


def prepare(model: Model, inputs: Mapping[str, Any], n_cases: int) -> Prepared:
    """SI parameters for the kernel.

    inputs : every parameter and setting of the model by column name, in declared units; a value counts for
        all cases, an array [n_cases] gives one each.
    """
    si = SimpleNamespace()
    refusals = Refusals.none(n_cases)
    for parameter in model.parameters:
        given = np.asarray(inputs[parameter.name], dtype=np.float64)
        if not _all_fit(parameter, given):
            _refuse_unfit(parameter, np.broadcast_to(given, n_cases), refusals)
        column = given * parameter.si_factor
        repeat = model.prepare is not None and column.shape != (n_cases,)  # else one number may count for all cases
        setattr(si, parameter.symbol, np.full(n_cases, column) if repeat else column)
    settings = np.zeros((n_cases, max(1, len(model.settings))))
    for i, setting in enumerate(model.settings):
        given = inputs[setting.name]  # one value for all cases, or one each
        settings[:, i] = setting.code(given) if np.ndim(given) == 0 else [setting.code(value) for value in given]
    columns: Mapping[str, np.ndarray] = vars(si)
    if model.prepare is not None:
        words = SimpleNamespace(**{setting.symbol: settings[:, i] for i, setting in enumerate(model.settings)})
        columns = call_prepare(model, si, words, refusals)
    if not isinstance(columns, Mapping):
        raise ModelError(f"{_design(model)} gives {type(columns).__name__}; it must return a dictionary of arrays by "
                         "the fields of kernel_parameters")  # fmt: skip
    names = model.kernel_parameters._fields  # type: ignore[attr-defined]
    rows = np.empty((len(names), n_cases))
    for row, name in zip(rows, names, strict=True):
        row[:] = _parameter_row(model, columns, name, n_cases)
    tables = np.asarray(columns.get(TABLES, np.empty(0)), dtype=np.float64).ravel()
    return Prepared(rows, settings, refusals, tables)


def _all_fit(parameter: Parameter, given: np.ndarray) -> bool:
    """Whether all values are finite and within the parameter's bounds: as a rule, and told much faster than which."""
    if not given.size:
        return True
    least, most = float(given.min()), float(given.max())  # not a number if one is, which compares with nothing
    return -np.inf < least and most < np.inf and parameter.low <= least and most <= parameter.high


def _refuse_unfit(parameter: Parameter, column: np.ndarray, refusals: Refusals) -> None:
    refusals.add(np.isnan(column), f"{parameter.name} is not a number")
    refusals.add(np.isinf(column), f"{parameter.name} is infinite")
    outside = ~((column >= parameter.low) & (column <= parameter.high))
    bounds = f"{parameter.low:g} to {parameter.high:g} {parameter.unit}".rstrip()
    refusals.add(outside, f"{parameter.name} is outside {bounds}")


def _parameter_row(model: Model, columns: Mapping[str, Any], name: str, n_cases: int) -> np.ndarray:
    """One kernel parameter of all cases, or one number for all; ModelError if the design does not give it."""
    if name not in columns:
        source = (
            f"{_design(model)} does not give it" if model.prepare else "no parameter has this name without its unit"
        )
        raise ModelError(f'kernel_parameters has the field "{name}", but {source}{hint(name, columns)}')
    try:
        column = np.asarray(columns[name])
    except ValueError:  # of rows that differ in length
        column = np.asarray(None)
    # one number counts for all cases; an array of one would do so by mistake
    if column.dtype.kind in "biuf" and column.shape in ((), (n_cases,)):
        return column
    raise ModelError(f'{_design(model)} gives "{name}" as {_described(columns[name], column)}; it must be a number for '
                     f"each of {n_cases} cases")  # fmt: skip


def _described(value: Any, column: np.ndarray) -> str:
    """What is wrong with a column."""
    if column.dtype.kind == "c":
        return "complex numbers"
    if column.ndim == 0:
        return type(value).__name__
    return f"shape {column.shape}" if column.dtype.kind in "biuf" else f"an array of {column.dtype.name}"


def _design(model: Model) -> str:
    return f"{place_of(model.prepare)}: `prepare`" if model.prepare else "the model"


def call_prepare(model: Model, inputs: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> Any:
    """The result of the model's `prepare`; ModelError with the line and the fix if it misuses its arguments.

    inputs, settings : float64[n_cases] by symbol, in SI.  Other errors come through as they are.
    """
    assert model.prepare is not None
    if inspect.iscoroutinefunction(model.prepare):
        raise ModelError(
            f"{place_of(model.prepare)}: `prepare` is an async def; write def, the engine waits for nothing"
        )
    try:
        with np.errstate(all="ignore"):  # refused cases may divide by zero on their way
            return model.prepare(inputs, settings, refusals)
    except MISUSES as error:
        raise ModelError(f"{place_in_model(error) or 'the model'}: {misuse(error, model.parameters)}") from error


def misuse(error: Exception, parameters: Sequence[Parameter]) -> str:
    """The error for a wrong use of the arguments of `prepare`, with the rules."""
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
