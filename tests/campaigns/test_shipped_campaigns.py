"""Every shipped campaign can be loaded, and says where its numbers come from."""

from mc_engine import load_campaign
from mc_engine.campaign.search import list_campaigns


def test_every_dispersion_and_requirement_of_a_shipped_campaign_has_its_source():
    campaigns = [load_campaign(shipped.name) for shipped in list_campaigns()]
    unsourced = [
        f"{campaign.name}: {part.name}"
        for campaign in campaigns
        if campaign.design != "table" and campaign.name != "minimal"  # a table names its numbers; a first try has none
        for part in (*campaign.dispersions, *campaign.requirements)
        if not part.source
    ]
    assert len(campaigns) > 30
    assert unsourced == []
