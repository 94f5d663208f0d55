"""Short ways to fly the injection model: inputs and results by column name, in declared units."""

from tests.campaigns.model_flights import ModelFlights

FLIGHTS = ModelFlights("campaigns.geo_injection", width=None)
MODEL, NOMINAL = FLIGHTS.model, FLIGHTS.nominal
fly_cases, fly_one, history = FLIGHTS.cases, FLIGHTS.one, FLIGHTS.history
