"""The burn programs as files, and the campaign files that fly them."""

from dataclasses import replace

import numpy as np
import pytest
from geo_flights import MODEL, NOMINAL

from campaigns.geo_injection.design import programs as design
from campaigns.geo_injection.design.kept_programs import SEQUENCES
from campaigns.geo_injection.design.program import from_text, to_text
from campaigns.geo_injection.model import sequence_of
from mc_engine.campaign.cases import case_table
from mc_engine.campaign.loading import load_campaign
from mc_engine.campaign.search import list_campaigns
from mc_engine.flight.flight import fly

FILES = sorted(one.name for one in list_campaigns() if one.name.split("/")[0] == "geo_injection")


@pytest.mark.parametrize("name", sorted(SEQUENCES))
def test_a_kept_program_is_what_the_design_gives(name):
    kept = from_text((design.KEPT / f"{name}.toml").read_text(encoding="utf-8"))
    new = design.new_design(SEQUENCES[name])
    assert kept.sequence == SEQUENCES[name]
    assert kept.optimal == new.optimal
    assert kept.start == pytest.approx(new.start, abs=1e-3)
    for ours, theirs in zip(kept.burns, new.burns, strict=True):
        assert (ours.ignition, ours.duration) == pytest.approx((theirs.ignition, theirs.duration), abs=1e-5)
        assert ours.end == pytest.approx(theirs.end, abs=0.1)
        assert ours.error < 2e-6
        for one, other in zip(ours.segments, theirs.segments, strict=True):
            assert one.steering == pytest.approx(other.steering, abs=1e-6)


def test_a_new_sequence_is_designed_once_and_then_read_from_the_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("MC_ENGINE_CACHE", str(tmp_path))
    other = {"initial_inclination": 0.3, "parking_radius": 6.7e6, "final_radius": 4.2e7}
    wanted = replace(SEQUENCES["two_burns_28_5"], **other, thrust=3e4, mass_flow=9.0, mass=2e4)
    first = design.program_for.__wrapped__(wanted)
    assert first.sequence.parking_radius == 6.7e6

    def no_design(sequence):
        raise AssertionError("designed again")

    monkeypatch.setattr(design, "new_design", no_design)
    assert to_text(design.program_for.__wrapped__(wanted)) == to_text(first)


def chosen(**inputs):
    values = NOMINAL | inputs
    return type("Settings", (), {one.symbol: one.code(values[one.name]) for one in MODEL.settings})


@pytest.mark.parametrize("file", FILES)
def test_every_file_flies_its_nominal_case_to_the_final_circle_and_names_its_sources(file):
    campaign = load_campaign(file)
    row = {key: column[0] for key, column in fly(campaign.model, campaign.nominal, np.array([0]), 1).items()}
    assert row["status"] == "ok"
    assert row["correction_dv_m_s"] < 0.05
    assert row["propellant_margin_kg"] > 0.0
    assert all(one.source for one in (*campaign.dispersions, *campaign.requirements))


def test_an_inclination_that_rises_is_the_mirror_image_of_one_that_falls():
    falling = design.new_design(sequence_of(chosen(initial_inclination_deg=20.0, final_inclination_deg=5.0)))
    rising = design.new_design(sequence_of(chosen(initial_inclination_deg=5.0, final_inclination_deg=20.0)))
    assert rising.propellant == pytest.approx(falling.propellant, abs=1e-6)


def test_the_file_of_a_covariance_draws_that_covariance():
    campaign = load_campaign("geo_injection/parking_orbit_errors")
    drawn = case_table(campaign, np.arange(20_000))
    names = [one.name for one in campaign.dispersions]
    found = np.cov([drawn[name] for name in names])
    wanted = np.diag([300.0, 1500.0, 500.0, 1.8, 0.4, 0.6]) ** 2
    wanted[1, 3] = wanted[3, 1] = -2430.0
    wanted[0, 4] = wanted[4, 0] = -108.0
    sigmas = np.sqrt(np.diag(wanted))
    assert found / np.outer(sigmas, sigmas) == pytest.approx(wanted / np.outer(sigmas, sigmas), abs=0.03)
