"""The choice of what flies a campaign's cases."""

from mc_engine.campaign.loading import Campaign
from mc_engine.flight.flyer import Flyer
from mc_engine.model.simulator import Simulator


def flyer_of(campaign: Campaign) -> Flyer:
    """What flies the cases of a campaign.  The compiler is loaded for a compiled model only."""
    if isinstance(campaign.model, Simulator):
        from mc_engine.flight.simulated import SimulatorFlyer

        return SimulatorFlyer(campaign)
    from mc_engine.flight.compiled import CompiledFlyer

    return CompiledFlyer(campaign)
