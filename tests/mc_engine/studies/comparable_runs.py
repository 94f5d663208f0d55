"""Run directories that differ in a chosen way, for the tests of comparisons."""

import numpy as np
from scipy.stats import norm

from mc_engine.sampling.streams import uniforms
from mc_engine.status import NO_STOP, OK
from mc_engine.store.store import Column, Store, create_store
from tests.mc_engine.command_line.cart import REQUIREMENT

COLUMNS = [
    Column("ve_pct", "%", "dispersion", "error of the burn"),
    Column("mode", "", "dispersion", "how it flies", "word"),
    Column("propellant_kg", "kg", "metric", "propellant used"),
    Column("range_m", "m", "metric", "how far it came"),
    Column("pulses", "", "metric", "the same in all cases"),
]
TEXT = '[campaign]\nmodel = "model.py"\nseed = 1\n'


def run(
    path, *, n=400, seed=1, shift=0.0, noise=1, limit=3.0, failed=0, text=TEXT, columns=COLUMNS, pulses=3.0, **changes
) -> Store:
    """A run of `n` cases.  shift : of propellant, in kg (sigma is 1.25); noise : seed of what inputs do not decide."""
    case = np.arange(n)
    ve = norm.ppf(uniforms(seed, "ve", case))
    own = norm.ppf(uniforms(noise, "own", case))
    ok = case >= failed
    table = {
        "status": np.where(ok, OK, NO_STOP),
        "reason": np.where(ok, "", "time limit"),
        "ve_pct": ve,
        "mode": np.where(case % 2 == 0, "pulsed", "off"),
        "propellant_kg": np.where(ok, ve + 0.75 * own + shift, np.nan),
        "range_m": np.where(ok, 1e6 - ve**2, np.nan),
        "pulses": np.where(ok, pulses, np.nan),
    }
    manifest = {
        "format": 1,
        "engine": "0.2.0",
        "created_utc": "2026-04-21T10:15:00+00:00",
        "campaign": {"name": "test", "title": "A <b>test</b>", "cases": n, "design": "mc", "seed": seed},
        "model": {"name": "m", "digest": "3b1f" * 16},
        "inputs": [{"name": "ve_pct", "distribution": "normal, 3σ = 3 %", "bounds": "", "nominal": 0.0}],
        "requirements": [{**REQUIREMENT, "name": "fuel", "metric": "propellant_kg", "at_most": limit, "share": 0.9}],
        "provenance": {"python": "3.11.7", "packages": {"numpy": "2.3.0"}, "git": None},
        **changes,
    }
    store = create_store(path, manifest, text, columns)
    store.append(
        0, n, {column.name: table[column.name] for column in columns} | {k: table[k] for k in ("status", "reason")}
    )
    return store
