"""Cases with chosen inputs, all others at the model's own values: for studies that no campaign file describes."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from mc_engine.flight.flight import fly, fly_history
from mc_engine.model import Model, Parameter, Setting

Inputs = Mapping[str, Any]  # numbers, words or arrays by the names of parameters and settings


def chosen_cases(model: Model, inputs: Inputs, *, seed: int = 0) -> dict[str, np.ndarray]:
    """Columns of as many cases as the longest input has values, in declared units.

    ValueError names the inputs that the model does not have.
    """
    n_cases = max((np.size(value) for value in inputs.values()), default=1)
    return fly(model, _complete(model, inputs), np.arange(n_cases), seed)


def chosen_case(model: Model, inputs: Inputs, *, seed: int = 0) -> dict[str, Any]:
    """The row of one case: a number or a word by column name."""
    return {name: column[0] for name, column in chosen_cases(model, inputs, seed=seed).items()}


def chosen_history(model: Model, inputs: Inputs, *, rows: int = 2001, seed: int = 0) -> dict[str, np.ndarray]:
    """`t_s` and the model's outputs along the flight of one case; rows as in `fly_history`."""
    return fly_history(model, _complete(model, inputs), 0, seed, rows=rows)[1]


def _complete(model: Model, inputs: Inputs) -> dict[str, Any]:
    items: tuple[Parameter | Setting, ...] = (*model.parameters, *model.settings)
    nominal = {item.name: item.default for item in items}
    if unknown := sorted(inputs.keys() - nominal.keys()):
        raise ValueError(f"{', '.join(unknown)}: no input of the model")
    return {**nominal, **inputs}
