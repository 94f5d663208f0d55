"""Short ways to fly the de-orbit campaign: inputs and results by column name, in declared units."""

import numpy as np

from mc_engine.flight.flight import fly, fly_history
from mc_engine.model import load_model

MODEL = load_model("campaigns.deorbit")
NOMINAL = {item.name: item.default for item in (*MODEL.parameters, *MODEL.settings)}
SEED = 20160421


def fly_cases(**inputs):
    """Columns of as many cases as the longest input has values."""
    n_cases = max((np.size(value) for value in inputs.values()), default=1)
    return fly(MODEL, NOMINAL | inputs, np.arange(n_cases), SEED)


def fly_one(**inputs):
    """The row of one case: a number or a word by column name."""
    return {name: column[0] for name, column in fly_cases(**inputs).items()}


def fly_grid(ve_pct, oe_pct):
    """Columns of all pairs of these errors of the burn, `ve_pct` and `oe_pct` of each pair among them."""
    ve, oe = (axis.ravel() for axis in np.meshgrid(ve_pct, oe_pct, indexing="ij"))
    return {"ve_pct": ve, "oe_pct": oe} | fly_cases(ve_pct=ve, oe_pct=oe)


def history(rows=3000, **inputs):
    """Quantities along the flight of one case: every step, up to 3000 steps."""
    return fly_history(MODEL, NOMINAL | inputs, 0, SEED, rows=rows)[1]
