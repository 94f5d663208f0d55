"""The flights beside a run: indices against closed forms, resumed to the same bytes, and never among the cases."""

import shutil
import signal
from pathlib import Path

import numpy as np
import pytest

from mc_engine import load_campaign, open_store
from mc_engine.campaign.sensitivity_design import companion, noise_ids
from mc_engine.errors import CampaignError, RunInterrupted, StoreError
from mc_engine.runner import runner
from mc_engine.statistics.pick_freeze import layout_of, pick_freeze
from mc_engine.status import MOST_CASES
from mc_engine.store.verification import REPAIR, damage, damages

MODEL = Path(__file__).parent / "contributions" / "model.py"
HEAD = '[campaign]\nmodel = "model.py"\ncases = 100\ndesign = "mc"\nseed = 3\n'
INPUTS = "".join(
    f'[dispersion.{name}]\ndist = "uniform"\nlower = 0.0\nupper = 1.0\n' for name in ("x1", "x2", "x3", "x4", "ticket")
)


GROUPED = "[sensitivity]\ncases = 64\n[sensitivity.group]\n"


def campaign(folder, more="", head=HEAD):
    shutil.copy(MODEL, folder)
    (folder / "campaign.toml").write_text(head + INPUTS + more)
    return load_campaign(folder / "campaign.toml")


def indices(run):
    store = open_store(run / "sensitivity")
    layout = layout_of(store.manifest["sensitivity"])
    cases = store.cases()
    metrics = {column.name: cases[column.name].to_numpy() for column in store.columns if column.role == "metric"}
    return pick_freeze(layout, cases["case_id"].to_numpy(), metrics)


def effects(run):
    found = indices(run)
    return {
        metric: {group: (found.first[g, k], found.total[g, k]) for g, group in enumerate(found.groups)}
        for k, metric in enumerate(found.metrics)
    }


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    folder = tmp_path_factory.mktemp("contributions")
    runner.run(campaign(folder, "[sensitivity]\ncases = 8192\n"), folder / "run")
    return folder / "run"


def test_indices_of_ishigami_and_of_sobols_g_lie_within_a_hundredth(flown):
    found = effects(flown)
    # Ishigami & Homma (1990), a = 7, b = 0.1: Saltelli et al., Global Sensitivity Analysis: The Primer, p. 196
    for name, first, total in (("x1", 0.3139, 0.5576), ("x2", 0.4424, 0.4424), ("x3", 0.0, 0.2437), ("x4", 0.0, 0.0)):
        assert found["ishigami"][name] == pytest.approx((first, total), abs=0.01), name
    # Sobol', Math. Comput. Simul. 55 (2001), 271-280: V_i = 1/(3 (1 + a_i)^2), a = 0, 1, 4.5, 9
    partial = 1.0 / (3.0 * (1.0 + np.array([0.0, 1.0, 4.5, 9.0])) ** 2)
    whole = np.prod(1.0 + partial)
    for name, own in zip(("x1", "x2", "x3", "x4"), partial, strict=True):
        exact = own / (whole - 1.0), own * whole / (1.0 + own) / (whole - 1.0)
        assert found["sobol_g"][name] == pytest.approx(exact, abs=0.01), name


def test_noise_in_flight_and_parameters_that_name_a_draw_are_one_group_of_their_own(flown):
    found = effects(flown)
    assert list(found["noise"]) == ["x1", "x2", "x3", "x4", "random draws"]
    for metric in ("noise", "raffle"):
        assert found[metric]["random draws"] == pytest.approx((1.0, 1.0), abs=0.02)
        for name in ("x1", "x2", "x3", "x4"):
            assert found[metric][name] == pytest.approx((0.0, 0.0), abs=1e-12)
    # variances 1/12, 1/12, 4/12 and 1
    exact = {"x1": 1.0 / 18.0, "x2": 1.0 / 18.0, "x3": 4.0 / 18.0, "x4": 0.0, "random draws": 12.0 / 18.0}
    assert {name: total for name, (_, total) in found["line"].items()} == pytest.approx(exact, abs=0.02)


def test_the_variance_falls_as_much_as_closed_forms_say_where_a_draw_is_held_at_its_nominal_value(flown):
    found = indices(flown)
    draws = found.groups.index("random draws")
    fall, error = (dict(zip(found.metrics, row[draws], strict=True)) for row in (found.fall, found.fall_error))
    # x (1 + t) with x, t uniform on [0, 1]: variance 31/144, with t = 0 it is 1/12; the total index of t is 4/31
    assert fall["scaled"] == pytest.approx(19.0 / 31.0, abs=min(3.0 * error["scaled"], 0.02))
    assert found.total[draws, found.metrics.index("scaled")] == pytest.approx(4.0 / 31.0, abs=0.01)
    assert fall["raffle"] == pytest.approx(1.0, abs=1e-12)  # t alone
    assert (fall["noise"], fall["line"]) == (0.0, 0.0)  # noise made in flight stays as drawn
    assert np.isnan(np.delete(found.fall, draws, axis=0)).all()


def test_the_cases_are_the_same_with_and_without_them(flown, tmp_path):
    runner.run(campaign(tmp_path), tmp_path / "run")
    assert not (tmp_path / "run" / "sensitivity").exists()
    assert open_store(tmp_path / "run").cases().equals(open_store(flown).cases())


def test_flights_broken_off_are_resumed_to_the_same_bytes(tmp_path):
    asked = campaign(tmp_path, "[sensitivity]\ncases = 512\n[sensitivity.group]\nodd = ['x1', 'x3']\n")
    runner.run(asked, tmp_path / "whole", chunk=64)

    sent, totals = [], set()

    def stop(done, total, failed):
        totals.add(total)
        if done > 1000 and not sent:
            sent.append(done)
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(RunInterrupted, match="resume"):
        runner.run(asked, tmp_path / "run", progress=stop)
    assert open_store(tmp_path / "run" / "sensitivity").missing()
    runner.resume(tmp_path / "run", progress=stop)
    assert totals == {asked.cases + 512 * (4 + 4)}  # from the first call on
    ours, theirs = (open_store(tmp_path / name / "sensitivity").cases() for name in ("run", "whole"))
    assert len(ours) == 512 * (4 + 4)  # groups: odd, x2, x4 and the random draws, which have two rows more
    assert ours.equals(theirs)
    assert runner.replay(tmp_path / "run" / "sensitivity", 1001).equal


def test_flights_of_another_campaign_are_not_taken_for_those_of_a_run(tmp_path):
    for seed in ("3", "4"):
        (tmp_path / seed).mkdir()
        asked = campaign(tmp_path / seed, "[sensitivity]\ncases = 32\n", HEAD.replace("seed = 3", f"seed = {seed}"))
        runner.run(asked, tmp_path / seed / "run")
    shutil.rmtree(tmp_path / "3" / "run" / "sensitivity")
    shutil.copytree(tmp_path / "4" / "run" / "sensitivity", tmp_path / "3" / "run" / "sensitivity")
    with pytest.raises(StoreError, match="sensitivity: holds flights of another campaign; remove it, and `resume`"):
        runner.resume(tmp_path / "3" / "run")


def test_a_damaged_line_about_the_flights_beside_a_run_is_repaired_with_the_run(tmp_path):
    run = tmp_path / "run"
    whole = runner.run(campaign(tmp_path, "[sensitivity]\ncases = 32\n"), run, workers=1).path / "sensitivity"
    table, journal = open_store(whole).cases(), whole / "journal.jsonl"
    journal.write_bytes(journal.read_bytes().replace(b'"event":"part"', b'"event":"paRt"', 1))
    with pytest.raises(StoreError, match="line 4: damaged"):
        runner.resume(run)
    runner.resume(run, repair=True)
    assert damage(run) == []
    assert open_store(whole).cases().equals(table)


@pytest.mark.parametrize("file", ["", "thesis.txt"], ids=["a file", "a folder with a file"])
def test_what_took_the_place_of_the_flights_beside_a_run_is_damage_and_no_interruption(tmp_path, file):
    run = tmp_path / "run"
    place = runner.run(campaign(tmp_path, "[sensitivity]\ncases = 32\n"), run, workers=1).path / "sensitivity"
    shutil.rmtree(place)
    (place / file).parent.mkdir(exist_ok=True)
    (place / file).touch()
    assert damage(run) == ["sensitivity: is no folder with a run"]
    with pytest.raises(StoreError, match=r"sensitivity: (Not a directory|is not empty and holds no run; empty it)"):
        runner.resume(run)  # `resume` of a run that was interrupted would say so without end


def test_an_empty_folder_in_place_of_the_flights_beside_a_run_is_mended_by_resume(tmp_path):
    run = tmp_path / "run"
    place = runner.run(campaign(tmp_path, "[sensitivity]\ncases = 32\n"), run, workers=1).path / "sensitivity"
    shutil.rmtree(place)
    place.mkdir()
    assert [item.mended_by for item in damages(run)] == [REPAIR]
    runner.resume(run, repair=True)
    assert damage(run) == []


def test_inputs_that_are_correlated_are_one_group(tmp_path):
    pairs = "".join(f"[[correlation]]\nbetween = ['{a}', '{b}']\nrank = 0.5\n" for a, b in (("x1", "x3"), ("x4", "x1")))
    groups = campaign(tmp_path, pairs + "[sensitivity]\ncases = 64\n").sensitivity.groups
    assert [members for members in groups.values()] == [("x1", "x3", "x4"), ("x2",), ("ticket",)]


def test_noise_in_flight_is_shared_by_rows_of_one_block_and_by_no_case_of_the_run(tmp_path):
    beside = companion(campaign(tmp_path, "[sensitivity]\ncases = 64\n"))
    noise = noise_ids(beside, np.arange(beside.cases)).reshape(64, -1)
    assert noise.min() > MOST_CASES
    assert len(np.unique(noise)) == sum(len(np.unique(block)) for block in noise) == 3 * 64


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        ("[sensitivity]\ncases = 1\n", "sensitivity.cases: 1 is not allowed"),
        ("[sensitivity]\ncases = 64\n[sensitivity.group]\na = ['x9']\n", '"x9" is not dispersed; known are "x1"'),
        ("[sensitivity]\ncases = 64\n[sensitivity.group]\na = ['ticket']\n", "names a random draw"),
        ("[sensitivity]\ncases = 64\n[sensitivity.group]\na = ['x1']\nb = ['x1']\n", 'is in the group "a" already'),
        (GROUPED + "x3 = ['x1', 'x2']\n", "sensitivity.group.x3: is the name of a dispersion outside the group"),
        (GROUPED + "ticket = ['x1']\n", "is the name of a dispersion outside the group"),
        (GROUPED + "'random draws' = ['x1']\n", "sensitivity.group.random draws: is what the engine calls a group"),
        (GROUPED + "'cases of a' = ['x1']\n", "is what the engine calls a group of its own"),
        (GROUPED + "' a' = ['x1']\n", "begins or ends with a blank"),
        (GROUPED + '"a\\nb" = ["x1"]\n', "is no name; use letters"),
        (GROUPED + "a = []\n", "sensitivity.group.a: has no members"),
        (GROUPED + "x1 = ['x1', 'x2']\nb = ['x1']\n", '"x1" is in the group "x1" already'),
        ("[sensitivity]\ncases = 10000000\n", None),
    ],
)
def test_what_cannot_be_computed_is_told_with_its_place(tmp_path, more, sentence):
    if sentence is None:
        assert campaign(tmp_path, more).sensitivity.flights == 90_000_000
        return
    with pytest.raises(CampaignError, match="sensitivity") as error:
        campaign(tmp_path, more)
    assert sentence in str(error.value)
