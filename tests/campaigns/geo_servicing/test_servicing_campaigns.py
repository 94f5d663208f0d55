"""The campaign files: each flies, says where its numbers come from, and does what it is there to show."""

import numpy as np
import pytest

from mc_engine.campaign.loading import load_campaign
from mc_engine.campaign.search import list_campaigns
from mc_engine.flight.flight import fly

NAMES = sorted(one.name for one in list_campaigns() if one.name.split("/")[0] == "geo_servicing")


def rows(name, n=1, seed=3, **inputs):
    """Cases of a file with its dispersions drawn afresh; the nominal case for n = 1."""
    campaign, rng = load_campaign(name), np.random.default_rng(seed)
    chosen = dict(campaign.nominal) | inputs
    if n > 1:
        chosen |= {one.name: one.distribution.ppf(rng.random(n)) for one in campaign.dispersions}
    return fly(campaign.model, chosen, np.arange(n), campaign.seed or 1)


@pytest.mark.parametrize("name", NAMES)
def test_the_nominal_case_of_each_file_flies_to_its_end(name):
    assert rows(name)["status"][0] == "ok"


def test_the_inspection_campaign_stays_within_the_ranges_of_the_source():
    row = rows("geo_servicing/inspection", 200)
    assert row["steady"].mean() >= 0.9
    assert row["min_range_m"].min() > 10.0


def test_craft_that_drift_freely_fall_towards_the_two_stable_longitudes():
    """Thirty days.  The osculating period at the start makes all drift east by some 0.8 deg; beside that, west of
    75 and 255 deg the drift grows, east of them it shrinks.
    """
    campaign = load_campaign("geo_servicing/free")
    longitudes = np.array([30.0, 120.0, -150.0, -60.0])
    inputs = dict(campaign.nominal) | {"initial_longitude_error_deg": longitudes}
    gained = fly(campaign.model, inputs, np.arange(4), 1)["final_longitude_deviation_deg"] - longitudes
    gained = gained - 360.0 * np.rint(gained / 360.0)
    assert gained[0] > gained[1]
    assert gained[2] > gained[3]
    assert (gained[[0, 2]] - gained[[1, 3]] > 0.5).all()


@pytest.mark.parametrize(
    "written", ['"2019-12-11T00:00:00"', "2019-12-11T00:00:00", '"2019-12-11T03:00+03:00"', "58828.0"]
)
def test_the_epoch_is_a_date_in_utc(written, tmp_path):
    head = '[campaign]\nmodel = "campaigns.geo_servicing"\ndesign = "one_at_a_time"\n'
    body = f"[parameters]\nepoch_utc = {written}\n[dispersion.epoch_error_days]\nvalues = [0.0, 0.5]\n"
    (tmp_path / "dated.toml").write_text(head + body)
    campaign = load_campaign(tmp_path / "dated.toml")
    assert campaign.nominal["epoch_utc"] == "2019-12-11T00:00:00"
    epoch = next(one for one in campaign.model.settings if one.name == "epoch_utc")
    assert epoch.code(campaign.nominal["epoch_utc"]) == 58828.0
