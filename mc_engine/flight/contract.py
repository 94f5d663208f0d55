"""Checks of a model's contract that need no compilation.  Each breach is one sentence with its location and the fix.

`mc_engine.model.reading` checks the source, and `mc_engine.model.trial` runs the physics at the start of the nominal
case.  `mc_engine.flight.contract_flight` makes the checks that need a flight.
"""

import json
import subprocess
import warnings

import numpy as np

from mc_engine.campaign.loading import Campaign
from mc_engine.errors import EngineError, ModelError
from mc_engine.flight.flyer import Process
from mc_engine.flight.repeatability import model_digests, nominal_inputs
from mc_engine.model.faults import MORE
from mc_engine.model.reading import is_shipped, source_faults
from mc_engine.model.record import compiled_model
from mc_engine.model.trial import run_through

_PATIENCE = 600.0  # s, for all flights and compilation; one case has a limit of its own


def breaches(campaign: Campaign) -> list[str]:
    """One sentence for each error in the campaign's model that is found without compiling; empty if there is none."""
    return source_faults(compiled_model(campaign.model)) or _trial_faults(campaign)


def refuse_breaches(campaign: Campaign) -> None:
    """ModelError with the first breach, before anything of a campaign is flown or written."""
    sentences = _trial_faults(campaign) if is_shipped(compiled_model(campaign.model)) else breaches(campaign)
    if sentences:
        raise ModelError(f"{sentences[0]}{MORE}")


def _trial_faults(campaign: Campaign) -> list[str]:
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            p, o = nominal_inputs(campaign)
            run_through(compiled_model(campaign.model), p, o, campaign.seed, finite=True)
    except EngineError as error:
        return [str(error)]
    return []


def flight_faults(campaign: Campaign, process: Process) -> list[str]:
    """What `process`, one of `mc_engine.flight.contract_flight` that waits, finds in flights of a few cases."""
    try:
        out, errors = process.communicate(json.dumps(model_digests(campaign)), timeout=_PATIENCE)
    except subprocess.TimeoutExpired:
        return [f"flights of a few cases have not ended after {_PATIENCE:.0f} s; shorten the clock's `until`, look for "
                "a loop without end, or leave them out with `mc-engine check --no-model`"]  # fmt: skip
    if process.returncode or not out:
        last = (errors.strip().splitlines() or [f"exit status {process.returncode}"])[-1]
        return [f"a flight of a few cases killed its process: {last}"]
    return [str(sentence) for sentence in json.loads(out.splitlines()[-1])]
