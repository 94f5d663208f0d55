"""The burn programs as files, and the campaign files that fly them."""

import re
from dataclasses import replace

import numpy as np
import pytest
from geo_sequences import FLOW

from campaigns.geo_injection.design import program as design
from campaigns.geo_injection.design.kept_programs import SEQUENCES, sequence_with
from campaigns.geo_injection.design.program import from_text, to_text
from mc_engine.campaign.cases import case_table
from mc_engine.campaign.loading import load_campaign
from mc_engine.campaign.search import list_campaigns
from mc_engine.flight.flight import fly

FILES = sorted(one.name for one in list_campaigns() if one.name.split("/")[0] == "geo_injection")


def test_the_source_flies_from_200_km_to_the_geostationary_circle_with_22_tonnes_and_20_kilonewtons():
    """Radii and mass of its eq. (12); thrust and flow follow from its tables 2 to 8."""
    flown = SEQUENCES["two_burns_28_5"]
    assert (flown.parking_radius, flown.final_radius) == (6_578_137.0, 42_164_137.0)
    assert (flown.mass, flown.thrust, flown.mass_flow) == (22_170.0, 20_000.0, 6.14)


# designed anew by continuous integration; the others where a program or the design is changed
SAMPLED = ("two_burns_28_5", "three_burns_28_5", "two_burns_28_5_staged", "three_burns_28_5_staged")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in SAMPLED else pytest.mark.slow) for name in sorted(SEQUENCES)]
)
def test_a_kept_program_is_what_the_design_gives(name):
    kept = from_text((design.KEPT / f"{name}.toml").read_text(encoding="utf-8"))
    new = design.new_design(SEQUENCES[name])
    assert kept.sequence == SEQUENCES[name]
    assert kept.optimal == new.optimal
    assert kept.start == pytest.approx(new.start, abs=1e-3)
    for ours, theirs in zip(kept.burns, new.burns, strict=True):
        times = theirs.ignition_s, theirs.duration_s
        assert (ours.ignition_s, ours.duration_s) == pytest.approx(times, abs=1e-5)
        assert ours.end == pytest.approx(theirs.end, abs=0.1)
        assert ours.direction_error_rad < 2e-6
        for one, other in zip(ours.segments, theirs.segments, strict=True):
            for axis in "xyz":
                assert getattr(one, axis) == pytest.approx(getattr(other, axis), abs=1e-6)


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


KEPT_TEXT = (design.KEPT / "two_burns_28_5.toml").read_text(encoding="utf-8")
BEFORE_BURNS = KEPT_TEXT.partition("[[burn]]")[0]
BROKEN = {
    "one burn instead of a list": BEFORE_BURNS + "[burn]\nsegment = 1\n",
    "burns that are words": 'burn = ["x"]\n' + BEFORE_BURNS,
    "a coefficient lost": re.sub(r"^z = \[[^,]*, ", "z = [", KEPT_TEXT, count=1, flags=re.MULTILINE),
    "a word for a truth value": KEPT_TEXT.replace("optimal = true", 'optimal = "no"'),
}


@pytest.mark.parametrize("text", BROKEN.values(), ids=BROKEN)
def test_a_broken_file_is_no_program_and_keeps_no_other_from_being_found(text, tmp_path, monkeypatch):
    assert text != KEPT_TEXT
    (tmp_path / "a_broken.toml").write_text(text, encoding="utf-8")
    (tmp_path / "sound.toml").write_text(KEPT_TEXT, encoding="utf-8")
    monkeypatch.setattr(design, "KEPT", tmp_path)
    assert to_text(design.program_for.__wrapped__(SEQUENCES["two_burns_28_5"])) == KEPT_TEXT
    with pytest.raises((ValueError, KeyError, TypeError)):
        from_text(text)


@pytest.mark.parametrize("file", FILES)
def test_every_file_flies_its_nominal_case_to_the_final_circle_and_names_its_sources(file):
    campaign = load_campaign(file)
    row = {key: column[0] for key, column in fly(campaign.model, campaign.nominal, np.array([0]), 1).items()}
    assert row["status"] == "ok"
    assert row["correction_dv_m_s"] < 0.05
    assert row["propellant_margin_kg"] > 0.0
    assert all(one.source for one in (*campaign.dispersions, *campaign.requirements))


def test_an_inclination_that_rises_is_the_mirror_image_of_one_that_falls():
    falling, rising = (
        design.new_design(sequence_with(initial_inclination_deg=initial, final_inclination_deg=25.0 - initial))
        for initial in (20.0, 5.0)
    )
    used_kg = [FLOW * sum(burn.duration_s for burn in program.burns) for program in (falling, rising)]
    assert used_kg[1] == pytest.approx(used_kg[0], abs=1e-6)


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
