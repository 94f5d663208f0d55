import tomllib

import pytest

from mc_engine.campaign.reading import Findings, read_sections
from mc_engine.campaign.search import SHIPPED, find_campaign, list_campaigns
from mc_engine.errors import CampaignError


def test_a_shipped_campaign_is_found_by_its_name_from_anywhere(tmp_path, monkeypatch):
    (tmp_path / "deorbit").mkdir()
    (tmp_path / "deorbit" / "campaign.toml").write_text("")
    monkeypatch.chdir(tmp_path)
    assert find_campaign("deorbit") == SHIPPED / "deorbit" / "campaign.toml"
    assert find_campaign("deorbit/map") == SHIPPED / "deorbit" / "map.toml"
    assert find_campaign("./deorbit").resolve() == tmp_path / "deorbit" / "campaign.toml"


def test_a_file_or_a_folder_is_found_by_its_path(tmp_path):
    file = tmp_path / "campaign.toml"
    file.write_text("")
    assert find_campaign(tmp_path) == find_campaign(file) == file


def test_a_campaign_that_is_not_there_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for reference, message in [
        ("deorbt", 'did you mean "deorbit"'),
        ("deorbit/mpa", 'did you mean "deorbit/map"'),
        ("nowhere/campaign.toml", "no such file"),
        ("deorbit/../deorbit/map", "no such path"),
        ("x" * 5000, "no campaign of that name"),
        ("a\0b", "no campaign of that name"),
        ("", "no campaign of that name"),
    ]:
        with pytest.raises(CampaignError, match=message):
            find_campaign(reference)


def test_every_shipped_campaign_has_a_title_and_no_mistake_in_its_words():
    campaigns = {campaign.name: campaign for campaign in list_campaigns()}
    assert {"deorbit", "deorbit/map", "deorbit/map_wide", "deorbit/demonstration"} <= campaigns.keys()
    for campaign in campaigns.values():
        found = Findings()
        read_sections(tomllib.loads(campaign.path.read_text()), found)
        assert found.problems == []
        assert campaign.title
