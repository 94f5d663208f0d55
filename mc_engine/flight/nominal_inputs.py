"""The inputs of the nominal case as the model's physics receives them, checked before anything flies."""

from typing import Any

import numpy as np

from mc_engine.campaign.loading import Campaign
from mc_engine.errors import EngineError
from mc_engine.flight.flight import grid_of, prepare, settings_of
from mc_engine.model.faults import fault_of
from mc_engine.model.fields import FixedStep
from mc_engine.model.trial import FEW, Breach


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
