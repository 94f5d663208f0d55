"""Short ways to fly the servicing model: inputs and results by column name, in declared units."""

import numpy as np

from campaigns.geo_servicing.dynamics import State
from mc_engine.flight.flight import prepare
from tests.campaigns.model_flights import ModelFlights

FLIGHTS = ModelFlights("campaigns.geo_servicing")
MODEL, NOMINAL = FLIGHTS.model, FLIGHTS.nominal
fly_cases, fly_one, history = FLIGHTS.cases, FLIGHTS.one, FLIGHTS.history
# the source's coasts [s], burns [s] and their signs
SOURCE_BURNS = ((123_753.6, 7_726.3, 1.0), (37_692.0, 4_569.1, 1.0), (24_264.7, 1_290.3, -1.0))
KEPLER = {"gravity_degree": 0.0, "gravity_order": 0.0, "sun_and_moon": False, "sunlight": False}
INSPECTION = {
    "phase": "inspection", "epoch_utc": "2019-12-11T00:00:00", "duration_days": 30.0, "sunlight": False,
    "navigation": "perfect", "assumed_pointing_deg": 1.0 / 6.0,
}  # fmt: skip


def first_states(**inputs):
    """(state with mass of the servicing module, state of the target) as the kernel gets them, SI."""
    numbers = prepare(MODEL, NOMINAL | inputs, 1).parameters[:, 0]
    named = dict(zip(MODEL.kernel_parameters._fields, numbers, strict=True))
    first = [named[name] for name in State._fields[:13]]
    return np.array(first[:7]), np.array(first[7:])


def normal(name, n, sigma, seed=2021):
    """n normal deviates that belong to a name."""
    return np.random.default_rng([seed, *name.encode()]).normal(0.0, sigma, n)
