"""Short ways to fly the de-orbit campaign: inputs and results by column name, in declared units."""

import numpy as np

from tests.campaigns.model_flights import ModelFlights

SEED = 20160421
FLIGHTS = ModelFlights("campaigns.deorbit", SEED, rows=3000)
MODEL, NOMINAL = FLIGHTS.model, FLIGHTS.nominal
fly_cases, fly_one, history = FLIGHTS.cases, FLIGHTS.one, FLIGHTS.history


def fly_grid(ve_pct, oe_pct):
    """Columns of all pairs of these errors of the burn, `ve_pct` and `oe_pct` of each pair among them."""
    ve, oe = (axis.ravel() for axis in np.meshgrid(ve_pct, oe_pct, indexing="ij"))
    return {"ve_pct": ve, "oe_pct": oe} | fly_cases(ve_pct=ve, oe_pct=oe)
