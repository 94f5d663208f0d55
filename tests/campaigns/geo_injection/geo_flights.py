"""Short ways to fly the injection model: inputs and results by column name, in declared units."""

import numpy as np

from mc_engine.flight.flight import fly, fly_history
from mc_engine.model import load_model

MODEL = load_model("campaigns.geo_injection")
NOMINAL = {item.name: item.default for item in (*MODEL.parameters, *MODEL.settings)}


def fly_cases(width=None, ids=None, **inputs):
    """Columns of as many cases as the longest input has values."""
    n_cases = max((np.size(value) for value in inputs.values()), default=1)
    return fly(MODEL, NOMINAL | inputs, np.arange(n_cases) if ids is None else ids, 1, width=width)


def fly_one(**inputs):
    """The row of one case: a number or a word by column name."""
    return {name: column[0] for name, column in fly_cases(**inputs).items()}


def history(rows=2001, **inputs):
    """Quantities along the flight of one case."""
    return fly_history(MODEL, NOMINAL | inputs, 0, 1, rows=rows)[1]
