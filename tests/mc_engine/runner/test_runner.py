"""Promises of the runner, on the smallest campaign."""

import json
import os
import shutil
import signal
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import mc_engine
from mc_engine import load_campaign, open_store
from mc_engine.campaign.cases import case_table, full_inputs
from mc_engine.campaign.search import SHIPPED
from mc_engine.campaign.sections import HistoriesSection
from mc_engine.errors import CampaignError, EngineError, ModelError, RunInterrupted, StoreError
from mc_engine.flight.compiled import CompiledFlyer
from mc_engine.flight.flight import fly
from mc_engine.model import FixedStep
from mc_engine.runner import manifest, runner
from mc_engine.runner.histories import integration_changes, write_histories
from mc_engine.runner.shards import Shard
from mc_engine.store.verification import damage


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """2000 cases of the smallest campaign, flown by two threads."""
    return runner.run(load_campaign("minimal", cases=2000), tmp_path_factory.mktemp("flown") / "run", workers=2)


def table_bytes(store):
    """All columns of all cases as bytes, numbers with every bit."""
    frame = store.cases()
    return {name: frame[name].to_numpy().tobytes() if frame[name].dtype.kind in "fi" else list(frame[name])
            for name in frame}  # fmt: skip


@pytest.mark.parametrize(("workers", "chunk"), [(1, 64), (2, 1), (2, 7), (1, 1000)])
def test_the_table_is_the_same_whatever_the_chunks_and_threads(flown, tmp_path, workers, chunk):
    cases = {1: 60, 7: 300}.get(chunk, 2000)
    again = runner.run(load_campaign("minimal", cases=cases), tmp_path / "run", workers=workers, chunk=chunk)
    ours, first = table_bytes(again), flown.cases().head(cases)
    assert len(again.cases()) == cases
    for name, content in ours.items():
        column = first[name].to_numpy()
        assert content == (column.tobytes() if column.dtype.kind in "fi" else list(column)), name


def test_1000_cases_extended_to_2000_are_a_fresh_2000(flown, tmp_path):
    runner.run(load_campaign("minimal", cases=1000), tmp_path / "run")
    extended = runner.extend(tmp_path / "run", 2000)
    assert table_bytes(extended) == table_bytes(flown)
    assert extended.n_cases == 2000


def pitched(design, more="", **options):
    """The smallest model with one dispersion."""
    text = f'[campaign]\nmodel = "model.py"\ncases = 12\ndesign = "{design}"\nseed = 1\n'
    text += '[dispersion.pitch_error_deg]\ndist = "uniform"\nhalf_range = 1.0\n'
    return load_campaign("pitched", text=text + more, directory=SHIPPED / "minimal", **options)


def test_shards_with_a_damaged_part_are_not_merged_and_leave_no_run(tmp_path):
    shards = [tmp_path / str(number) for number in (1, 2)]
    for number, shard in enumerate(shards, start=1):
        runner.run(pitched("mc"), shard, workers=1, shard=Shard(number, 2))
    (part,) = (shards[1] / "cases").iterdir()
    part.write_bytes(part.read_bytes()[:-1])
    with pytest.raises(StoreError, match=rf"{part}: damaged"):
        runner.merge(tmp_path / "whole", shards)
    assert not (tmp_path / "whole").exists()


def test_a_latin_hypercube_of_another_size_than_the_files_is_replayed_and_resumed(tmp_path):
    runner.run(pitched("lhs", cases=7), tmp_path / "run", workers=1)
    assert runner.replay(tmp_path / "run", 3).equal
    assert len(runner.resume(tmp_path / "run", workers=1).cases()) == 7


def test_histories_are_those_of_cases_that_the_run_has_and_none_are_stored_of_a_run_that_is_stopped(tmp_path):
    campaign = pitched("mc", "[retention]\nhistories = { cases = [3, 9] }\n", cases=5)
    store = runner.run(campaign, tmp_path / "run", workers=1)
    kept = store.history_part
    assert set(store.histories()["case_id"]) == {-1, 3}
    more = replace(campaign, retention=HistoriesSection(first=2))
    assert not write_histories(store, more, 1, lambda: True)
    assert open_store(tmp_path / "run").history_part == kept


def test_a_shard_has_its_own_cases_without_histories_and_flights_for_contributions(tmp_path):
    """Which follow when all shards are merged."""
    store = runner.run(load_campaign("minimal", cases=12), tmp_path / "run", workers=1, shard=Shard(2, 3))
    assert (store.committed(), store.missing(), store.n_cases, store.history_part) == ([(4, 8)], [], 12, None)
    assert not (tmp_path / "run" / "sensitivity").exists()


def test_a_design_in_blocks_is_extended_by_whole_blocks(tmp_path):
    runner.run(pitched("saltelli"), tmp_path / "run", workers=1)
    with pytest.raises(CampaignError, match="cases: 13 "):
        runner.extend(tmp_path / "run", 13)
    assert open_store(tmp_path / "run").n_cases == 12


def test_an_interrupted_run_is_completed_to_the_same_table(tmp_path):
    campaign = load_campaign("minimal", cases=4000)
    sent, before = [], signal.getsignal(signal.SIGINT)

    def interrupt(done, total, failed):
        if done >= 500 and not sent:
            sent.append(done)
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(RunInterrupted, match=r"mc-engine resume .*run"):
        runner.run(campaign, tmp_path / "run", progress=interrupt, chunk=50)
    cut = open_store(tmp_path / "run")
    assert 500 <= len(cut.cases()) < 4000
    assert signal.getsignal(signal.SIGINT) is before
    whole = runner.resume(tmp_path / "run")
    assert table_bytes(whole) == table_bytes(runner.run(campaign, tmp_path / "fresh"))
    assert damage(whole.path) == []


def test_replays_have_the_bits_of_the_run_and_a_history_that_ends_with_the_case(flown):
    rng = np.random.default_rng(3)
    for case in rng.integers(0, 2000, 20):
        replay = runner.replay(flown.path, int(case))
        assert replay.equal, replay.differences
        assert replay.history["t_s"].iloc[-1] == replay.row["end_time_s"]
        assert replay.history["altitude_km"].iloc[-1] == pytest.approx(replay.row["apogee_altitude_km"], rel=1e-13)


def test_changed_sources_refuse_to_continue_a_run(flown, tmp_path):
    moved = tmp_path / "edited"
    shutil.copytree(flown.path, moved)
    model = moved / "model.py"
    model.write_text(model.read_text().replace("burn_dv * (1.0", "burn_dv * (1.1"))
    for act in (lambda: runner.resume(moved), lambda: runner.replay(moved, 0), lambda: runner.extend(moved, 3000)):
        with pytest.raises(StoreError, match=r"flown by other sources|model\.py: damaged or edited"):
            act()


OTHERS = {
    "model": ("mc_engine.runner.flown_campaign.flyer_of", lambda _: SimpleNamespace(digest=lambda: "another")),
    "sampling": ("mc_engine.runner.manifest.sampling_digest", lambda: "another"),
    "seed contract": ("mc_engine.sampling.streams.SEED_CONTRACT", 99),
    "columns": ("mc_engine.runner.manifest.columns_of", lambda _: []),
    "campaign": (
        "mc_engine.runner.flown_campaign.load_campaign",
        lambda *names, **options: replace(load_campaign(*names, **options), digest="another"),
    ),
}


@pytest.mark.parametrize("other", OTHERS)
def test_a_run_of_other_sources_is_neither_continued_nor_replayed(flown, monkeypatch, other):
    monkeypatch.setattr(*OTHERS[other])
    words = (
        "a file of the campaign was edited" if other == "campaign" else "was flown by other sources of engine or model"
    )
    for act in (runner.resume, lambda path: runner.replay(path, 0), lambda path: runner.extend(path, 3000)):
        with pytest.raises(StoreError, match=words):
            act(flown.path)
    assert damage(flown.path) == []


def unreadable(*_, **__):
    raise ModelError("model.py, line 3: a record of an older version")


@pytest.mark.parametrize("load", [load_campaign, unreadable], ids=["model readable", "model unreadable"])
def test_the_version_that_flew_a_run_is_named(flown, monkeypatch, load):
    monkeypatch.setattr(manifest, "sampling_digest", lambda: "another")
    monkeypatch.setattr(manifest, "engine_version", lambda: "9.1")
    monkeypatch.setattr("mc_engine.runner.flown_campaign.load_campaign", load)
    present = flown.manifest["engine"]
    for act in (runner.resume, lambda path: runner.replay(path, 0), lambda path: runner.extend(path, 3000)):
        with pytest.raises(StoreError, match=f"was flown by mc-engine {present}, and this is 9.1; use that version"):
            act(flown.path)


@pytest.mark.parametrize("folder", ["sampling", "campaign"])
def test_the_sources_that_draw_inputs_are_in_the_digest_of_sampling(tmp_path, monkeypatch, folder):
    engine = Path(manifest.__file__).parents[1]
    for name in ("sampling", "campaign"):
        shutil.copytree(engine / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    before = manifest.sampling_digest()
    monkeypatch.setattr(manifest, "__file__", str(tmp_path / "runner" / "manifest.py"))
    assert manifest.sampling_digest() == before
    (tmp_path / folder / "__init__.py").write_text("# changed")
    assert manifest.sampling_digest() != before


def test_the_git_state_of_a_run_is_that_of_the_whole_engine(monkeypatch):
    """It was that of the folder `runner`, which an uncommitted change of the integrators left without a mark."""
    monkeypatch.setattr(manifest, "git_state", lambda folder: folder)
    assert manifest.environment()["git"] == Path(mc_engine.__file__).parent


def test_histories_hold_the_nominal_and_the_first_cases(flown):
    histories = flown.histories()
    assert sorted(histories["case_id"].unique()) == [-1, 0, 1, 2]
    assert flown.nominal()["apogee_altitude_km"] == pytest.approx(
        histories.loc[histories["case_id"] == -1, "altitude_km"].iloc[-1], rel=1e-13
    )


def test_the_nominal_is_committed_before_any_other_case_begins(flown):
    events = [entry.event for entry in flown.notes()]
    assert events[:4] == ["created", "started", "nominal", "part"]
    assert events.count("nominal") == 1


def test_a_run_ends_with_how_much_half_of_the_step_changes_its_first_cases(flown):
    campaign, first = load_campaign("minimal", cases=2000), np.arange(16)
    inputs = full_inputs(campaign, case_table(campaign, first))
    halved = fly(campaign.model, inputs, first, campaign.seed, clock=FixedStep(step=5.0, until=10_000.0))
    facts = flown.notes()[-1].facts["integration"]
    assert (facts["by"], facts["used"], facts["tried"]) == ("half of the step", 16, 16)
    table = flown.cases()
    for metric in campaign.model.metrics:
        assert facts["changes"][metric.name] == abs(halved[metric.name] - table[metric.name][:16]).max() > 0.0
    assert not open_store(flown.path / "sensitivity").notes()[-1].facts["integration"]


def test_a_case_whose_metric_is_there_with_one_step_alone_is_not_used(flown, monkeypatch):
    given = CompiledFlyer.fly_finer

    def without(self, inputs, noise, flight_s):
        by, columns = given(self, inputs, noise, flight_s)
        columns["apogee_time_s"][3] = np.nan
        columns["top_speed_m_s"][3] = 1e9
        return by, columns

    monkeypatch.setattr(CompiledFlyer, "fly_finer", without)
    facts = integration_changes(flown, load_campaign("minimal", cases=2000))
    assert (facts["used"], facts["tried"]) == (15, 16)
    assert facts["changes"]["top_speed_m_s"] < 1.0


def test_the_worst_cases_keep_their_histories(tmp_path):
    text = load_campaign("minimal").text.replace(
        "histories = { nominal = true, first = 3 }",
        'histories = { nominal = false, worst = { metric = "apogee_altitude_km", count = 2, side = "smallest" } }',
    )
    folder = load_campaign("minimal").directory
    store = runner.run(load_campaign("small", text=text, directory=folder, cases=300), tmp_path / "run")
    lowest = store.cases().nsmallest(2, "apogee_altitude_km")["case_id"]
    assert list(dict.fromkeys(store.histories()["case_id"])) == list(lowest)


def test_the_worst_cases_of_a_requirement_with_two_limits_have_the_smallest_margin(tmp_path):
    """As measured from the nearer limit, whichever end that is."""
    small = load_campaign("minimal")
    text = small.text.replace(
        "histories = { nominal = true, first = 3 }",
        'histories = { nominal = false, worst = { metric = "apogee_altitude_km", count = 4 } }',
    )
    text += '[requirement.band]\nmetric = "apogee_altitude_km"\nat_least = 780.0\nat_most = 9000.0\n'
    store = runner.run(load_campaign("small", text=text, directory=small.directory, cases=300), tmp_path / "run")
    altitude = store.cases().set_index("case_id")["apogee_altitude_km"]
    margin = np.minimum(9000.0 - altitude, altitude - 780.0)
    assert list(dict.fromkeys(store.histories()["case_id"])) == list(margin.nsmallest(4).index)
    assert margin.nsmallest(4).index[0] == altitude.idxmin()


def test_a_failed_case_keeps_its_row_and_its_inputs_and_the_others_are_untouched(flown, tmp_path):
    """A burn that leaves the Earth for good never meets an apogee: no-stop, and NaN metrics, in that row alone."""
    (tmp_path / "cases.csv").write_text("magnitude_error_pct,pitch_error_deg\n0,0\n4000,0\n1,0.5\n")
    shutil.copy(load_campaign("minimal").directory / "model.py", tmp_path)
    (tmp_path / "campaign.toml").write_text('[campaign]\nmodel = "model.py"\ndesign = "table"\ntable = "cases.csv"\n')
    store = runner.run(load_campaign(tmp_path), tmp_path / "run")
    frame = store.cases()
    assert list(frame["status"]) == ["ok", "no-stop", "ok"]
    assert frame["magnitude_error_pct"].iloc[1] == 4000.0
    assert np.isnan(frame["apogee_altitude_km"].iloc[1])
    assert np.isfinite(frame.filter(like="end_").iloc[1].to_numpy(dtype=float)).all()
    assert frame["apogee_altitude_km"].iloc[[0, 2]].notna().all()


def test_the_campaign_as_run_and_its_files_stand_in_the_run_directory(flown):
    assert (flown.path / "campaign.toml").read_text() == load_campaign("minimal").text
    assert (flown.path / "model.py").read_bytes() == (load_campaign("minimal").directory / "model.py").read_bytes()
    manifest = json.loads((flown.path / "manifest.json").read_text())
    assert manifest["campaign"]["cases"] == 2000
    text = json.dumps(manifest)
    assert str(flown.path.parent) not in text
    assert os.path.expanduser("~") + "/" not in text
    assert {note.event for note in flown.notes()} >= {"started", "finished"}


@pytest.mark.parametrize("wrong", [{"progress": True}, {"workers": 0}, {"workers": "2"}, {"chunk": -5}])
def test_arguments_that_nothing_can_be_flown_with_are_refused_before_a_run_is_made(wrong, tmp_path):
    with pytest.raises(EngineError, match=f"^{next(iter(wrong))}: {next(iter(wrong.values()))!r} is "):
        runner.run(load_campaign("minimal", cases=2), tmp_path / "run", **wrong)
    assert not (tmp_path / "run").exists()


def test_a_model_that_breaks_while_preparing_is_named_with_its_cases_and_leaves_no_run(tmp_path):
    source = (load_campaign("minimal").directory / "model.py").read_text()
    source = source.replace("initial=initial,", "prepare=prepare, initial=initial,")
    broken = "def prepare(i, o, refusals):\n    return {**vars(i), 'altitude': 1 / (i.altitude.size < 4)}\n\n\n"
    source = source.replace("MODEL = model(", f"{broken}MODEL = model(")
    (tmp_path / "model.py").write_text(source)
    (tmp_path / "campaign.toml").write_text(load_campaign("minimal").text)
    (tmp_path / "mine").mkdir()
    (tmp_path / "link").symlink_to("mine")
    for out in ("run", "link"):
        with pytest.raises(ModelError, match=r"cases \d+ to \d+ cannot be flown: model.py, line \d+: ZeroDivision"):
            runner.run(load_campaign(tmp_path, cases=100), tmp_path / out, progress=note_beside(tmp_path / out))
    assert not (tmp_path / "run").exists()  # so that the same command flies the corrected model
    assert [file.name for file in (tmp_path / "link").iterdir()] == ["notes.txt"]


def note_beside(folder):
    """Progress that leaves a file of the user in a run directory behind a link."""
    return lambda *_: folder.is_symlink() and (folder / "notes.txt").write_text("worth keeping")
