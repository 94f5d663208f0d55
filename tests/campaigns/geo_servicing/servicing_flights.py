"""Short ways to fly the servicing model: inputs and results by column name, in declared units."""

import numpy as np

from tests.campaigns.model_flights import ModelFlights

FLIGHTS = ModelFlights("campaigns.geo_servicing")
MODEL, NOMINAL = FLIGHTS.model, FLIGHTS.nominal
fly_cases, fly_one, history = FLIGHTS.cases, FLIGHTS.one, FLIGHTS.history
# the source's corrections without errors, gravity 4 x 4, Moon and Sun
PUBLISHED = {"schedule": "published", "feedback": False, "navigation": "perfect", "sunlight": False}
KEPLER = {"gravity_degree": 0.0, "gravity_order": 0.0, "sun_and_moon": False, "sunlight": False}
INSPECTION = {
    "phase": "inspection", "epoch_utc": "2019-12-11T00:00:00", "duration_days": 30.0, "sunlight": False,
    "navigation": "perfect", "assumed_pointing_deg": 1.0 / 6.0,
}  # fmt: skip


def normal(name, n, sigma, seed=2021):
    """n normal deviates that belong to a name."""
    return np.random.default_rng([seed, *name.encode()]).normal(0.0, sigma, n)
