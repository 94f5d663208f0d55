"""Flying until every requirement is decided."""

import os
import signal
from dataclasses import replace

import numpy as np
import pytest

from mc_engine import load_campaign, open_store
from mc_engine.errors import CampaignError, RunInterrupted
from mc_engine.runner import runner
from mc_engine.runner.stopping import carry_on, fly_until_decided, refuse_undecidable, schedule
from mc_engine.runner.summary import analyses_line, judgement

NO_PROGRESS = {"workers": 1}


def minimal(cases=2000, **requirement):
    """The smallest campaign with its requirement changed."""
    campaign = load_campaign("minimal", cases=cases)
    return replace(campaign, requirements=(replace(campaign.requirements[0], **requirement),))


def apogees():
    """All apogees of the smallest campaign are between these."""
    return {"at_most": None, "at_least": 0.0}


def test_flying_ends_where_the_requirement_passes_and_the_manifest_holds_the_schedule(tmp_path):
    store = fly_until_decided(minimal(**apogees(), share=0.95, confidence=0.95), tmp_path / "run", **NO_PROGRESS)
    assert store.n_cases == len(store.cases()) == 74  # no failure shows 0.95 with 0.95 at any time from here on
    assert store.manifest["looks"] == [74, 100, 150, 225, 337, 505, 757, 1135, 1702, 2000]
    assert judgement(store)[0][0].outcome == "pass"
    assert analyses_line(store).startswith("1 interim analysis, the last at 74 of at most 2,000 cases")


def test_flying_ends_where_the_requirement_fails(tmp_path):
    store = fly_until_decided(minimal(at_most=None, at_least=1e9), tmp_path / "run", **NO_PROGRESS)
    assert store.n_cases == store.manifest["looks"][0]
    assert judgement(store)[0][0].outcome == "fail"


def test_flying_ends_with_the_cases_where_nothing_is_decided_and_they_are_those_of_a_run_of_as_many(tmp_path):
    store = fly_until_decided(minimal(cases=160, **apogees(), share=0.9999), tmp_path / "run", **NO_PROGRESS)
    assert [note.facts["cases"] for note in store.notes("extended")] == [150, 160]
    verdict = judgement(store)[0][0]
    assert verdict.outcome == "not demonstrable"
    assert verdict.looked
    whole = runner.run(load_campaign("minimal", cases=160), tmp_path / "whole", workers=1)
    columns = [name for name in store.units if name not in ("status", "reason")]
    assert np.array_equal(store.cases(columns).to_numpy(float), whole.cases(columns).to_numpy(float), equal_nan=True)


@pytest.mark.parametrize("batch", [0, 1])
def test_an_interrupted_run_goes_on_by_its_schedule(tmp_path, batch):
    campaign, begun = minimal(cases=160, **apogees(), share=0.9999), []

    def interrupt(done, total, failed):
        if total not in begun:
            begun.append(total)
            if len(begun) == batch + 1:
                os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(RunInterrupted, match="mc-engine resume"):
        fly_until_decided(campaign, tmp_path / "run", progress=interrupt, **NO_PROGRESS)
    assert open_store(tmp_path / "run").n_cases < 160
    store = carry_on(tmp_path / "run", **NO_PROGRESS)
    assert store.n_cases == len(store.cases()) == 160


def test_a_decided_run_is_not_carried_on_and_one_extended_by_hand_keeps_its_limits(tmp_path):
    campaign = minimal(**apogees(), share=0.9, confidence=0.9)
    first = fly_until_decided(campaign, tmp_path / "run", **NO_PROGRESS)
    assert carry_on(tmp_path / "run", **NO_PROGRESS).n_cases == first.n_cases
    extended = runner.extend(tmp_path / "run", first.n_cases + 20, workers=1)
    told = f"extended to {first.n_cases + 20} cases after a run until verdict of at most 2,000 cases; "
    assert analyses_line(extended).startswith(told)
    before, after = judgement(first)[0][0], judgement(extended)[0][0]
    assert after.looked
    assert after.outcome == "pass"
    assert after.lower > before.lower


def test_a_run_of_fixed_size_that_is_extended_is_judged_as_looked_at(tmp_path):
    store = runner.run(load_campaign("minimal", cases=60), tmp_path / "run", workers=1)
    assert not judgement(store)[0][0].looked
    assert analyses_line(store) == ""
    extended = runner.extend(tmp_path / "run", 90, workers=1)
    assert judgement(extended)[0][0].looked
    assert analyses_line(extended).startswith("extended from 60 to 90 cases")


def test_a_campaign_without_a_requirement_or_with_a_run_upstream_is_refused():
    with pytest.raises(CampaignError, match="there is none to decide"):
        refuse_undecidable(replace(minimal(), requirements=()))
    with pytest.raises(CampaignError, match="as many cases as the run upstream"):
        refuse_undecidable(load_campaign("reentry/from_deorbit"))


def test_the_schedule_has_the_cases_that_decide_all_requirements_if_none_fails():
    campaign = minimal(cases=300, share=0.95, confidence=0.95)
    other = replace(campaign.requirements[0], share=0.97)
    assert schedule(replace(campaign, requirements=(*campaign.requirements, other))) == (100, 125, 150, 225, 300)
