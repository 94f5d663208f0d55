"""Short ways to fly the entry model: inputs and results by column name, in declared units."""

import numpy as np

from campaigns.reentry.published.values import TEXTBOOK
from tests.campaigns.model_flights import ModelFlights

FLIGHTS = ModelFlights("campaigns.reentry")
MODEL, NOMINAL = FLIGHTS.model, FLIGHTS.nominal
fly_cases, fly_one, history = FLIGHTS.cases, FLIGHTS.one, FLIGHTS.history

# a flat Earth without gravity, with the textbook atmosphere
IDEAL = TEXTBOOK | {"shape": "flat", "gravity": "none"}


def assert_same_bits_alone(together, picked, width=None, each=(), **inputs):
    """The picked cases have the bits of their rows among the others where each flies alone.

    each : input -> a value for every case;  inputs : what all cases share.
    """
    for case in picked:
        own = {name: values[case] for name, values in dict(each).items()}
        alone = fly_cases(width=width, ids=np.array([case]), **inputs, **own)
        for name, column in together.items():
            assert column[case : case + 1].tolist() == alone[name].tolist() or np.isnan(column[case]), (case, name)
