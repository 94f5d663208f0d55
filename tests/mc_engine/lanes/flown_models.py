"""The small models of this folder and a short way to fly them."""

from pathlib import Path

import numpy as np

from mc_engine.flight.flight import fly
from mc_engine.model import load_model

FOLDER = Path(__file__).resolve().parent / "models"
CORNERS = load_model("corners.py", FOLDER)
OSCILLATOR = load_model("oscillator.py", FOLDER)
RAIL = load_model("rail.py", FOLDER)


def inputs_of(model, inputs):
    """These inputs by column name, the model's defaults for the others."""
    return {item.name: item.default for item in (*model.parameters, *model.settings)} | inputs


def flown(model, width=8, case_ids=None, seed=1, **inputs):
    """Columns of cases with these inputs, the model's defaults for the others."""
    columns = inputs_of(model, inputs)
    n = max(np.size(value) for value in columns.values())
    ids = np.arange(n) if case_ids is None else np.asarray(case_ids)
    return fly(model, columns, ids, seed, folder=FOLDER, width=width)


def same_bytes(one, other):
    """Nothing where two sets of columns agree in every byte; else a failed assertion naming the columns."""
    assert list(one) == list(other)
    different = [
        name
        for name in one
        if (
            list(one[name]) != list(other[name])
            if one[name].dtype == object
            else one[name].tobytes() != other[name].tobytes()
        )
    ]
    assert different == []
