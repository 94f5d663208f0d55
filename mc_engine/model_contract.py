"""What a model must keep, held against it without compiling: each breach a sentence with its place and the fix.

`mc_engine.physics_source` reads, `mc_engine.physics_trial` runs the physics at the start of the nominal case.
`mc_engine.contract_flight` goes on with what only a flight can show.
"""

import json
import os
import subprocess
import sys
import warnings
from typing import Any

import numpy as np

from mc_engine.campaign import Campaign
from mc_engine.errors import EngineError, ModelError
from mc_engine.flight import grid_of, prepare, settings_of
from mc_engine.model import FixedStep
from mc_engine.model_faults import MORE, fault_of
from mc_engine.physics_source import is_shipped, source_faults
from mc_engine.physics_trial import FEW, Breach, run_through
from mc_engine.safe_path import SAFE_PATH

_PATIENCE = 600.0  # s, for all flights and compilation; one case has a limit of its own


def breaches(campaign: Campaign) -> list[str]:
    """Sentences on what is wrong with the campaign's model, as far as it shows without compiling; empty if nothing."""
    return source_faults(campaign.model) or _trial_faults(campaign)


def refuse_breaches(campaign: Campaign) -> None:
    """ModelError with the first breach, before anything of a campaign is flown or written."""
    found = _trial_faults(campaign) if is_shipped(campaign.model) else breaches(campaign)
    if found:
        raise ModelError(f"{found[0]}{MORE}")


def _trial_faults(campaign: Campaign) -> list[str]:
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            p, o = nominal_inputs(campaign)
            run_through(campaign.model, p, o, campaign.seed, finite=True)
    except EngineError as error:
        return [str(error)]
    return []


def flight_faults(campaign: Campaign, file: str) -> list[str]:
    """What `mc_engine.contract_flight` finds in a process of its own, which the model may kill or hang."""
    from mc_engine.repeatability import numbers  # which knows this module

    command = [sys.executable, "-m", "mc_engine.contract_flight", file, json.dumps(numbers(campaign))]
    path = os.pathsep.join(one or os.getcwd() for one in sys.path)  # the same packages as here
    other = {"PYTHONHASHSEED": "1" if os.environ.get("PYTHONHASHSEED") == "0" else "0", "TZ": "UTC-14"}
    environment = {**os.environ, **SAFE_PATH, **other, "PYTHONPATH": path}
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_PATIENCE, env=environment)
    except subprocess.TimeoutExpired:
        return [f"flights of a few cases have not ended after {_PATIENCE:.0f} s; shorten the clock's `until`, look for "
                "a loop without end, or leave them out with `mc-engine check --no-model`"]  # fmt: skip
    if done.returncode or not done.stdout:
        last = (done.stderr.strip().splitlines() or [f"exit status {done.returncode}"])[-1]
        return [f"a flight of a few cases killed its process: {last}"]
    return [str(one) for one in json.loads(done.stdout.splitlines()[-1])]


def nominal_inputs(campaign: Campaign) -> tuple[Any, Any]:
    """(p, o) of a few nominal cases as physics sees them: arrays, and the numbers that all share."""
    model = campaign.model
    try:
        doing = "prepare"
        ready = prepare(model, campaign.nominal, FEW)
        doing = "tables"
        settings = settings_of(model, ready.settings[0], ready.tables)
    except EngineError:
        raise
    except SystemExit:
        raise Breach(f"`{doing}` ends the process; a model only computes") from None
    except Exception as error:
        raise Breach(f"`{doing}`: {fault_of(error, 'the model')}") from None
    if ready.refusals.mask[0]:
        raise Breach(f"the nominal case is refused: {ready.refusals.reason[0]}")
    for name, row in zip(model.kernel_parameters._fields, ready.parameters, strict=True):  # type: ignore[attr-defined]
        if not np.isfinite(row).all():
            raise Breach(f'`prepare` gives {row[0]:g} for "{name}" of the nominal case; it must be a number')
    if isinstance(model.clock, FixedStep):
        grid_of(model.clock, settings)
    return model.kernel_parameters(*ready.parameters), settings
