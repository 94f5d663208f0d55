"""A run directory of forty cases with columns of all kinds, for the tests of the store."""

import os
from pathlib import Path

import numpy as np

from mc_engine.status import NO_STOP, OK
from mc_engine.store.store import Column, create_store

# For processes that a test starts: they find the engine and the tests from any working folder.
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[3])}

COLUMNS = [
    Column("ve_pct", "%", "dispersion", "error of the speed change"),
    Column("control", "", "dispersion", "how the thrust is commanded", "word"),
    Column("j2", "", "dispersion", "oblateness on or off", "switch"),
    Column("propellant_kg", "kg", "metric", "propellant used"),
    Column("end_x_km", "km", "state", "last x"),
]
MANIFEST = {
    "format": 1,
    "campaign": {"name": "test", "cases": 40},
    "quantities": [{"name": "force_n", "unit": "N", "description": "thrust"}],
}
TEXT = '[campaign]\nmodel = "μ.py"\n'


def block(first, count):
    """The columns of cases first .. first + count - 1: a function of case_id alone."""
    case = np.arange(first, first + count)
    draws = [np.random.default_rng(number).normal(size=3) for number in case]
    status = np.where(case % 10 == 3, NO_STOP, OK)
    return {
        "status": status,
        "reason": np.where(status == OK, "", "time limit"),
        "ve_pct": np.array([draw[0] for draw in draws]),
        "control": np.where(case % 2 == 0, "pulsed", "off"),
        "j2": case % 3 == 0,
        "propellant_kg": np.where(status == OK, [draw[1] for draw in draws], np.nan),
        "end_x_km": np.array([draw[2] for draw in draws]),
    }


def created(run):
    """A new store in folder `run`."""
    return create_store(run, MANIFEST, TEXT, COLUMNS)


def filled(store):
    """The store with all its cases, in four parts."""
    for first in range(0, 40, 10):
        store.append(first, 10, block(first, 10))
    return store


def row(case):
    """One case as a mapping from column to value."""
    return {name: values[0] for name, values in block(case, 1).items()}
