"""Short ways to fly the servicing model: inputs and results by column name, in declared units."""

import numpy as np

from mc_engine.flight.flight import fly, fly_history
from mc_engine.model import load_model

MODEL = load_model("campaigns.geo_servicing")
NOMINAL = {item.name: item.default for item in (*MODEL.parameters, *MODEL.settings)}
# the source's corrections without errors, gravity 4 x 4, Moon and Sun
PUBLISHED = {"schedule": "published", "feedback": False, "navigation": "perfect", "sunlight": False}
KEPLER = {"gravity_degree": 0.0, "gravity_order": 0.0, "sun_and_moon": False, "sunlight": False}
INSPECTION = {
    "phase": "inspection", "epoch_utc": "2019-12-11T00:00:00", "duration_days": 30.0, "sunlight": False,
    "navigation": "perfect", "assumed_pointing_deg": 1.0 / 6.0,
}  # fmt: skip


def fly_cases(width=8, ids=None, **inputs):
    """Columns of as many cases as the longest input has values, or as there are ids."""
    n_cases = max((np.size(value) for value in inputs.values()), default=1)
    ids = np.arange(n_cases) if ids is None else ids
    return fly(MODEL, NOMINAL | inputs, ids, 1, width=width)


def fly_one(**inputs):
    """The row of one case: a number or a word by column name."""
    return {name: column[0] for name, column in fly_cases(**inputs).items()}


def history(rows=2001, **inputs):
    """Quantities along the flight of one case."""
    return fly_history(MODEL, NOMINAL | inputs, 0, 1, rows=rows)[1]


def normal(name, n, sigma, seed=2021):
    """n normal deviates that belong to a name."""
    return np.random.default_rng([seed, *name.encode()]).normal(0.0, sigma, n)
