"""Every shipped campaign can be loaded, and says where its numbers come from."""

from mc_engine import load_campaign
from mc_engine.campaign.search import list_campaigns
from reports.run.history_bands import OUTER, outer_percentile

MAIN = ("deorbit", "flexible_satellite", "geo_injection", "geo_servicing", "reentry")


def test_the_main_campaigns_save_enough_histories_for_the_outermost_percentiles():
    first = [load_campaign(name).retention.first for name in MAIN]
    assert {outer_percentile(n) for n in first} == {OUTER[0]}


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
