"""The choice of the `Flyer` of a campaign."""

from mc_engine.campaign.loading import Campaign
from mc_engine.flight.flyer import Flyer
from mc_engine.model.simulator import Simulator


def flyer_of(campaign: Campaign) -> Flyer:
    """The `Flyer` of a campaign's cases.  The compiler is loaded only for a compiled model."""
    if isinstance(campaign.model, Simulator):
        from mc_engine.flight.simulated import SimulatorFlyer

        return SimulatorFlyer(campaign)
    from mc_engine.flight.compiled import CompiledFlyer

    return CompiledFlyer(campaign)
