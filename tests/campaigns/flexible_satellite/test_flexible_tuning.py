"""The three stages of the source's optimisation: fronts against its optima, and the constraint that is out of reach."""

import numpy as np
import pytest
from flexible_flights import FOLDER, TABLE_8, TABLE_9, fly_one

from mc_engine import load_campaign, tune
from mc_engine.studies.candidates import fly_candidates
from mc_engine.studies.tuning_folder import infeasibility

IMPULSE, ATTITUDE = 50.4, 133.8  # recomputed objectives of Table 8's thrusters


def stage(name):
    return load_campaign(FOLDER / f"{name}.toml")


def candidate(campaign, table):
    """The tuned parameters as a table has them, the others nominal: float64[1, parameters]."""
    return np.array([[table.get(one.name, campaign.nominal[one.name]) for one in campaign.tuning.parameters]])


def search(name, path, **sizes):
    pytest.importorskip("pymoo")
    return tune(stage(name), path, **sizes)


def beats(front):
    """Candidates of the front that are no worse than Table 8 in both objectives."""
    return front[(front["impulse"] <= IMPULSE) & (front["attitude"] <= ATTITUDE)]


def test_the_published_optima_lie_within_the_bounds_and_have_the_stated_objectives():
    for name, table in (("stage_2", TABLE_8), ("stage_3", TABLE_9)):
        campaign = stage(name)
        choice = candidate(campaign, table)
        for item, value in zip(campaign.tuning.parameters, choice[0], strict=True):
            assert item.lower <= value <= item.upper
        ours = fly_candidates(campaign, campaign.tuning, choice).objectives[0]
        assert ours == pytest.approx(list(campaign.tuning.published[-1].values.values()), rel=0.005)
        flown = fly_one(**table)
        assert ours.tolist() == [flown["control_effort_n_m_s"], flown["attitude_effort_s"]]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_front_of_the_second_stage_has_a_point_no_worse_than_table_8(seed, tmp_path):
    record = search("stage_2_unconstrained", tmp_path / "out", seed=seed, population=40, generations=3)
    assert len(beats(record.front))


def test_with_the_gains_of_table_1_no_thrusters_meet_the_attitude_of_table_5(tmp_path):
    record = search("stage_2", tmp_path / "out", seed=1, population=40, generations=4)
    assert not record.feasible
    assert record.evaluations["end_attitude"].min() > 0.015
    assert (record.evaluations["end_modes"] < 0.005).all()
    assert "no feasible point among 160 candidates; the least violation found is" in infeasibility(record)
    assert "where at most 0.005 is allowed" in infeasibility(record)


def test_a_robust_candidate_is_judged_by_the_dispersed_craft():
    campaign = stage("stage_3_robust")
    choice = candidate(campaign, TABLE_9)
    robust = fly_candidates(campaign, campaign.tuning, choice)
    nominal = fly_one(**TABLE_9)
    assert robust.objectives[0, 0] > nominal["control_effort_n_m_s"]
    assert robust.objectives[0, 0] < 1.2 * nominal["control_effort_n_m_s"]
    assert robust.objectives[0, 1] > nominal["attitude_effort_s"]
    assert robust.failed[0] == 0


def test_candidates_that_are_alike_meet_the_same_noise():
    text = FOLDER.joinpath("stage_3_robust.toml").read_text(encoding="utf-8")
    noisy = 'actuator = "ideal"\nduration_s = 5.0\nrate_noise_rad_s = 1e-3\nattitude_noise_rad = 1e-3'
    text = text.replace('actuator = "pwpf"', noisy).replace("cases = 32", "cases = 8")
    campaign = load_campaign("noisy.toml", text=text, directory=FOLDER)
    choice = candidate(campaign, TABLE_9)
    three = fly_candidates(campaign, campaign.tuning, np.repeat(choice, 3, axis=0))
    assert three.objectives[0].tolist() == three.objectives[1].tolist() == three.objectives[2].tolist()
    alone = fly_candidates(campaign, campaign.tuning, choice)
    assert alone.objectives[0].tolist() == three.objectives[0].tolist()
    calm = load_campaign("calm.toml", text=text.replace("1e-3", "0.0"), directory=FOLDER)
    assert fly_candidates(calm, calm.tuning, choice).objectives[0, 0] != alone.objectives[0, 0]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_thrusters_and_gains_together_beat_tables_8_and_9_within_table_5(seed, tmp_path):
    record = search("stage_3", tmp_path / "out", seed=seed)
    better = beats(record.front)
    assert len(better)
    assert (better["end_attitude"] <= 0.005).all()
    assert ((better["impulse"] <= 42.6) & (better["attitude"] <= 113.8)).any()
