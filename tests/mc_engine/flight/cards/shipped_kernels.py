"""Every shipped campaign of a compiled model, and the call of its kernel for one case at a time."""

from pathlib import Path

import numpy as np

import campaigns
from mc_engine.campaign.loading import load_campaign
from mc_engine.flight import flight
from mc_engine.studies.lane_speed import campaign_flight

_ROOT = Path(campaigns.__file__).parent
NAMES = tuple(
    str(file.relative_to(_ROOT).with_suffix("")).removesuffix("/campaign")
    for file in sorted(_ROOT.rglob("*.toml"))
    if "[campaign]" in file.read_text()
)
MODELS = tuple(name for name in NAMES if "/" not in name)  # a campaign of each; their variants are slow tests


def shipped(name, **keys):
    """A shipped campaign by its file, without `.toml`, or by its folder."""
    file = _ROOT / f"{name}.toml"
    return load_campaign(file if file.exists() else _ROOT / name / "campaign.toml", **keys)


def kernel_call(name, n_cases):
    """The kernel with its arguments, for some cases of the campaign that fly with the same settings."""
    cases = campaign_flight(shipped(name), n_cases)
    ids = np.arange(cases.n_cases)
    return flight.bound_flight(cases.model, cases.inputs, ids, cases.seed, folder=cases.folder, width=1)[0]
