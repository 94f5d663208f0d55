"""A search from the file to its directory, on a front in closed form."""

import signal
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
from apogee_tuning import CHOICE, apogee_and_speed, apogee_campaign

from mc_engine import open_tuning, tune
from mc_engine.campaign.search import SHIPPED
from mc_engine.errors import EngineError, RunInterrupted
from mc_engine.studies.tuning import Generation, dominated_shares, is_stalled
from mc_engine.studies.tuning_folder import infeasibility
from tests.mc_engine.command_line.cart import call, fails_with

UNREACHABLE = '\n[tuning.constraint.high]\nmetric = "apogee_altitude_km"\nat_least = 5000.0\n'


@pytest.fixture(autouse=True)
def search():
    pytest.importorskip("pymoo")


@pytest.fixture(scope="module")
def tuned(tmp_path_factory):
    pytest.importorskip("pymoo")
    return tune(apogee_campaign(), tmp_path_factory.mktemp("tuned") / "out", seed=1, generations=25, population=24)


def test_the_front_is_the_highest_circular_orbit_with_all_sizes_of_the_burn(tuned):
    """For a speed after the burn the apogee grows with the altitude of the burn."""
    front = tuned.front
    assert len(front) > 20
    assert front["altitude_km"].median() > 598.0
    assert front["burn_dv_m_s"].min() < 52.0
    assert front["burn_dv_m_s"].max() > 195.0
    apogee, speed = apogee_and_speed(front["altitude_km"], front["burn_dv_m_s"])
    np.testing.assert_allclose(front["apogee"], apogee, rtol=1e-6)
    np.testing.assert_allclose(front["speed"], speed, rtol=1e-6)


def test_no_candidate_beats_one_of_the_front(tuned):
    every = tuned.evaluations
    for row in tuned.front.itertuples():
        better = (every["apogee"] >= row.apogee) & (every["speed"] <= row.speed)
        assert (every[better][["apogee", "speed"]].to_numpy() == [row.apogee, row.speed]).all()
    assert tuned.front["apogee"].is_monotonic_decreasing  # the best first
    assert tuned.generations["front_size"].iloc[-1] == len(tuned.front)  # of all generations


def test_the_same_seed_finds_the_same_bits_whatever_the_threads_and_another_seed_another_way(tmp_path):
    records = [
        tune(apogee_campaign(), tmp_path / str(k), seed=seed, workers=workers)
        for k, (seed, workers) in enumerate([(3, 1), (3, 2), (4, 1)])
    ]
    first, second, other = (record.path.joinpath("evaluations.parquet").read_bytes() for record in records)
    assert first == second
    assert first != other
    zero = tune(apogee_campaign(), tmp_path / "zero", seed=0, generations=1, population=4)
    assert zero.manifest["tuning"]["seed"] == 0


def test_the_directory_holds_tables_with_units_the_text_and_what_was_searched(tuned):
    path = tuned.path
    assert pd.read_parquet(path / "front.parquet").attrs["units"]["apogee"] == "km"
    assert "[tuning.objective.apogee]" in (path / "tuning.toml").read_text()
    plan = open_tuning(path).manifest["tuning"]
    assert (plan["seed"], plan["population"], plan["flown"], plan["end"]) == (1, 24, 25, "all generations")
    assert tuned.manifest["campaign"]["digest"] == apogee_campaign().digest


def test_without_a_feasible_candidate_the_front_is_empty_and_the_least_violation_is_told(tmp_path):
    record = tune(apogee_campaign(UNREACHABLE), tmp_path / "out")
    assert not record.feasible
    assert not record.evaluations["feasible"].any()
    highest = record.evaluations["high"].max()
    assert record.evaluations["violation"].min() == pytest.approx((5000.0 - highest) / 5000.0)
    assert f"high {highest:.4g} km where at least 5000 is allowed" in infeasibility(record)


def test_a_robust_tuning_leaves_room_for_the_dispersed_burn(tmp_path):
    """The tenth-worst of a hundred burns, uniform in ±10 %, must reach what the nominal one reaches otherwise."""
    choice = CHOICE.replace('goal = "maximise"', 'goal = "maximise"\nquantile = 0.1')
    record = tune(apogee_campaign(choice=choice, cases=100), tmp_path / "out", seed=1)
    nominal, _ = apogee_and_speed(record.front["altitude_km"], record.front["burn_dv_m_s"])
    low, _ = apogee_and_speed(record.front["altitude_km"], 0.9 * record.front["burn_dv_m_s"])
    assert (record.front["apogee"] < nominal).all()
    assert (record.front["apogee"] > low).all()


NARROW = """
[tuning.parameter.burn_dv_m_s]
lower = 199.99999999999997
upper = 200.0

[tuning.objective.apogee]
metric = "apogee_altitude_km"
"""


def test_a_search_without_a_new_candidate_ends_there_and_keeps_what_it_has(tmp_path):
    """Between two neighbouring numbers there are two candidates."""
    record = tune(apogee_campaign(choice=NARROW), tmp_path / "out", seed=1)
    assert record.manifest["tuning"]["end"] == "no new candidate"
    assert record.manifest["tuning"]["flown"] == record.generations["generation"].iloc[-1] + 1 < 6
    assert record.evaluations["burn_dv_m_s"].between(199.99999999999997, 200.0).all()
    assert len(record.front) == 1


KILLED = """
import os, signal, sys
sys.path.insert(0, {root!r})
from pathlib import Path
from mc_engine import tune
from tests.mc_engine.studies.apogee_tuning import apogee_campaign

def progress(done, total, failed):
    if done >= 36:
        os.kill(os.getpid(), signal.SIGKILL)

tune(apogee_campaign(), Path({out!r}), seed=1, workers=1, progress=progress)
"""


def test_a_killed_search_leaves_the_generations_that_were_flown(tmp_path):
    out = tmp_path / "out"
    killed = subprocess.run([sys.executable, "-c", KILLED.format(root=str(SHIPPED.parent), out=str(out))], check=False)
    assert killed.returncode == -signal.SIGKILL
    record = open_tuning(out)
    assert record.manifest["tuning"]["end"] == "not ended"
    assert len(record.evaluations) == 36
    whole = tune(apogee_campaign(), tmp_path / "whole", seed=1, workers=1)
    pd.testing.assert_frame_equal(record.evaluations, whole.evaluations.iloc[:36])
    assert sorted(path.name for path in whole.path.iterdir()) == [
        "evaluations.parquet", "front.parquet", "generations.parquet", "journal.jsonl", "tuning.json",
        "tuning.toml",
    ]  # fmt: skip


def test_ctrl_c_keeps_the_generations_flown(tmp_path):
    def progress(done, total, failed):
        if done >= 24:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(RunInterrupted, match="after 2 of 6 generations"):
        tune(apogee_campaign(), tmp_path / "out", progress=progress)
    record = open_tuning(tmp_path / "out")
    assert record.manifest["tuning"]["end"] == "interrupted"
    assert len(record.evaluations) == 24


@pytest.mark.parametrize("wrong", [{"population": 3}, {"generations": 0}, {"seed": "1"}, {"workers": -1}])
def test_a_number_that_no_search_can_have_is_refused_before_anything_is_written(tmp_path, wrong):
    ((name, value),) = wrong.items()
    with pytest.raises(EngineError, match=f"{name}: {value!r} is not allowed; it must be a whole number from"):
        tune(apogee_campaign(), tmp_path / "out", **wrong)
    assert not (tmp_path / "out").exists()


# ---- when to stop


def generation(front, least=0.0):
    return Generation(np.empty((0, 2)), None, np.array(front, dtype=float).reshape(-1, 2), least)


def test_a_search_stalls_when_neither_front_nor_violation_get_better():
    same = [generation([[1.0, 2.0], [2.0, 1.0]])] * 4
    assert is_stalled(same, 3)
    assert not is_stalled(same, 4)
    assert not is_stalled([*same, generation([[1.0, 2.0], [1.5, 1.5], [2.0, 1.0]])], 3)
    assert not is_stalled([generation([], 3.0), generation([], 2.0)], 1)
    assert is_stalled([generation([], 3.0), generation([], 3.0)], 1)
    assert is_stalled([generation([], np.inf), generation([], np.inf)], 1)
    assert not is_stalled([generation([], 3.0), generation([[1.0, 2.0]])], 1)


def test_a_front_that_dominates_more_has_the_larger_share():
    shares = dominated_shares([np.empty((0, 2)), np.array([[2.0, 2.0]]), np.array([[1.0, 2.0], [2.0, 1.0]])])
    assert shares[0] == 0.0 < shares[1] < shares[2] <= 1.0


# ---- the command line


def test_tune_writes_the_result_and_says_what_it_found(tmp_path):
    (tmp_path / "model.py").write_bytes((SHIPPED / "minimal" / "model.py").read_bytes())
    (tmp_path / "apogee.toml").write_text(apogee_campaign().text)
    result = call("tune", tmp_path / "apogee.toml", "--out", tmp_path / "out", "--generations", 3, "--seed", 2)
    assert result.exit_code == 0, result.output
    assert "36 in 3 generations" in result.stdout
    assert (tmp_path / "out" / "report.html").read_bytes().startswith(b"<!doctype html>")
    assert (tmp_path / "out" / "report.pdf").read_bytes().startswith(b"%PDF")
    assert call("report", tmp_path / "out", "--format", "html").exit_code == 0
    fails_with(2, call("tune", tmp_path / "apogee.toml", "--out", tmp_path / "out"), "is not empty")
    assert call("status", tmp_path / "out").stdout.splitlines()[2:] == result.stdout.splitlines()[1:-2]
    assert "every byte is as it was written" in call("verify", tmp_path / "out").stdout
    (tmp_path / "out" / "tuning.toml").write_text("another question")
    fails_with(5, call("verify", tmp_path / "out"), "tuning.toml: damaged")
    fails_with(5, call("status", tmp_path / "out"), "tuning.toml: damaged")
