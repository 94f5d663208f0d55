"""Campaigns of the stone with its traps, and what two runs have in common, for the tests of faults."""

import os
from pathlib import Path

import numpy as np

from mc_engine import load_campaign

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}
HEAD = '[campaign]\nmodel = "tests.faults.traps.model"\ndesign = "table"\ntable = "cases.csv"\nseed = 1\n'
RETENTION = "[retention]\nhistories = { nominal = true, first = 2 }\n"


def campaign_folder(folder, cases, traps=None):
    """A folder with a campaign of so many stones.  traps : case -> trap."""
    rng = np.random.default_rng(5)
    table = np.column_stack([rng.uniform(50.0, 150.0, cases), rng.normal(0.0, 5.0, cases), np.zeros(cases)])
    for case, trap in (traps or {}).items():
        table[case, 2] = trap
    folder.mkdir(exist_ok=True)
    np.savetxt(folder / "cases.csv", table, delimiter=",", header="height_m,speed_m_s,trap", comments="", fmt="%.17g")
    (folder / "campaign.toml").write_text(HEAD + RETENTION)
    return folder


def trapped(folder, cases, traps=None):
    """The campaign itself."""
    return load_campaign(campaign_folder(folder, cases, traps))


def files_of(run):
    """Every file that holds results, with its bytes: parts, nominal, histories."""
    paths = [*(run / "cases").iterdir(), *(run / "history").iterdir(), run / "nominal.parquet"]
    return {path.relative_to(run).as_posix(): path.read_bytes() for path in paths}
