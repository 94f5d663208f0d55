"""Short ways to fly the model of a campaign: inputs and results by column name, in declared units."""

import numpy as np

from mc_engine.flight.flight import fly, fly_history
from mc_engine.model import load_model


class ModelFlights:
    """A model with its nominal inputs, flown with one seed, as wide as a run.  rows : of a history."""

    def __init__(self, name, seed=1, rows=2001):
        self.model = load_model(name)
        self.nominal = {item.name: item.default for item in (*self.model.parameters, *self.model.settings)}
        self._seed, self._rows = seed, rows

    def cases(self, width=None, ids=None, **inputs):
        """Columns of as many cases as the longest input has values."""
        n_cases = max((np.size(value) for value in inputs.values()), default=1)
        ids = np.arange(n_cases) if ids is None else ids
        return fly(self.model, self.nominal | inputs, ids, self._seed, width=width)

    def one(self, **inputs):
        """The row of one case: a number or a word by column name."""
        return {name: column[0] for name, column in self.cases(**inputs).items()}

    def history(self, rows=None, **inputs):
        """Quantities along the flight of one case."""
        return fly_history(self.model, self.nominal | inputs, 0, self._seed, rows=rows or self._rows)[1]
