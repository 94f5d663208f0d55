"""Simulators under a campaign file: each kind gives the same numbers, and keeps the promises of a run."""

import json
import re
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from mc_engine import CampaignError, StoreError, load_campaign, open_run, replay, resume, run
from mc_engine.command_line import before_flight
from mc_engine.command_line.commands import app
from mc_engine.flight.simulated import about
from mc_engine.interruption import GIVING_UP
from mc_engine.runner import histories
from mc_engine.runner.importing import import_results
from mc_engine.runner.runner import Backend, extend, rerun
from mc_engine.runner.summary import judgement, nominal_line
from mc_engine.store.run_files import NO_NOMINAL
from tests.mc_engine.flight.falling_ball import CAMPAIGN, PROGRAM, program_campaign, python_campaign

METRICS = ["fall_time_s", "impact_speed_m_s"]


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """The run of each kind, by its name."""
    folder = tmp_path_factory.mktemp("kinds")
    files = {
        "case": python_campaign(folder / "case"),
        "batch": python_campaign(folder / "batch", options="batch=True,"),
        "program": program_campaign(folder / "program"),
    }
    return {kind: run(load_campaign(file), folder / f"run-{kind}", workers=2) for kind, file in files.items()}


@pytest.mark.parametrize("kind", ["batch", "program"])
def test_each_kind_gives_the_same_numbers_and_verdicts(flown, kind):
    ours, theirs = flown["case"].cases(), flown[kind].cases()
    assert list(ours["mass_kg"]) == list(theirs["mass_kg"])  # bit for bit: recorded is flown
    assert np.allclose(ours[METRICS], theirs[METRICS], rtol=1e-12, atol=0.0)
    assert [vars(a)["outcome"] for a in judgement(flown["case"])[0]] == [
        vars(b)["outcome"] for b in judgement(flown[kind])[0]
    ]


@pytest.mark.parametrize("kind", ["case", "batch", "program"])
def test_a_case_is_replayed_with_its_history(flown, kind):
    again = replay(flown[kind].path, 3)
    assert again.equal, again.differences
    assert again.history["speed_m_s"].iloc[-1] == pytest.approx(again.row["impact_speed_m_s"], rel=1e-12)
    assert set(flown[kind].histories()["case_id"]) == {-1, 0, 1}


def test_backends_and_more_cases_change_nothing(tmp_path, flown):
    campaign = load_campaign(python_campaign(tmp_path / "ball", cases=60))
    store = run(campaign, tmp_path / "run", workers=2, backend=Backend("loky"), chunk=16)
    extend(store.path, 100, workers=1)
    assert open_run(tmp_path / "run").store.cases().equals(flown["case"].cases())


def test_check_tells_what_a_simulator_lacks(tmp_path, monkeypatch):
    file = python_campaign(tmp_path / "ball", cases=1, fault="import time\ntime.sleep(0.3)")
    source = file.with_name("sim.py")
    source.write_text(source.read_text().replace('outputs=outputs(speed_m_s="speed"),', ""))
    monkeypatch.setattr(before_flight, "_LONG", 0.1)
    said = CliRunner().invoke(app, ["check", str(file)])
    assert said.exit_code == 0
    assert "has not ended after 0.1 s; Ctrl-C ends it, and `time_limit_s`" in said.stderr
    assert "no time histories are saved, because the simulator declares no outputs" in said.stdout
    assert "not saved, as no declared outputs: the columns speed_m_s of the history" in said.stdout
    assert re.search(r" s a case, 0\.[3-9]\d* s for 1 case on ", said.stdout)  # which no second worker shares


def test_draws_of_a_case_are_its_own(tmp_path):
    fault = "return {'fall_time_s': case.rng.normal(), 'impact_speed_m_s': float(case.seed % 1000003)}"
    campaign = load_campaign(python_campaign(tmp_path / "a", cases=20, fault=fault))
    first = run(campaign, tmp_path / "run-1", workers=1, chunk=20).cases()
    second = run(campaign, tmp_path / "run-2", workers=2, chunk=3).cases()
    assert first.equals(second)
    assert first[METRICS].nunique().tolist() == [20, 20]


def test_start_runs_once_a_worker_and_each_case_has_an_empty_folder(tmp_path):
    fault = "\n".join(
        [
            "assert list(case.folder.iterdir()) == []",
            "(case.folder / 'left').write_text('x')",
            "case.shared.append(case.id)",
            "return {'fall_time_s': float(len(case.shared)), 'impact_speed_m_s': 1.0}",
        ]
    )
    campaign = load_campaign(python_campaign(tmp_path / "a", cases=20, fault=fault, options="start=list,"))
    table = run(campaign, tmp_path / "run", workers=1, chunk=20).cases()
    assert set(table["status"]) == {"ok"}
    assert table["fall_time_s"].is_monotonic_increasing  # one list for all of them


def test_failed_cases_are_flown_again(tmp_path):
    mark = tmp_path / "mended"
    fault = (
        f"import os\nif case.id == 4 and not os.path.exists({str(mark)!r}): raise ValueError('a licence is missing')"
    )
    campaign = load_campaign(python_campaign(tmp_path / "a", cases=8, fault=fault))
    store = run(campaign, tmp_path / "run", workers=1)
    assert store.row(4)["reason"] == "sim.py, line 12: ValueError: a licence is missing"
    inputs = json.loads((tmp_path / "run/simulator/case-0000004/case.json").read_text())
    assert inputs["mass_kg"] == store.row(4)["mass_kg"]
    mark.touch()
    assert rerun(tmp_path / "run").status_counts() == {"ok": 8}


def test_numbers_within_the_tolerance_replay_and_replay_says_so(tmp_path):
    fault = "import time\ninputs = {**inputs, 'mass_kg': inputs['mass_kg'] * (1.0 + 1e-12 * (time.time_ns() % 1000))}"
    for options, equal in (("", False), ("deterministic=False, tolerance=1e-6,", True)):
        name = "tolerant" if options else "strict"
        campaign = load_campaign(python_campaign(tmp_path / name, cases=4, fault=fault, options=options))
        run(campaign, tmp_path / f"run-{name}", workers=1)
        again = replay(tmp_path / f"run-{name}", 1)
        assert (again.equal, again.tolerance) == (equal, 1e-6 if options else None)
    said = CliRunner().invoke(app, ["replay", str(tmp_path / "run-tolerant"), "1"]).stdout
    assert "every stored number is within the tolerance of its simulator, 1e-06 of the number" in said
    assert "same bits" not in said


def test_the_command_line_says_of_simulators_what_is_true_of_them(tmp_path):
    fault = "if case.id == 2: return {'fall_time_s': np.nan, 'impact_speed_m_s': 1.0}"
    file = python_campaign(tmp_path / "ball", cases=4, fault=fault)
    said = CliRunner().invoke(app, ["run", str(file), "--out", str(tmp_path / "run"), "--no-report"])
    assert said.exit_code == 0
    assert "compile" not in said.output
    assert 'not finite   case 2: "fall_time_s" is not a number\n' in said.output
    said = CliRunner().invoke(app, ["extend", str(tmp_path / "run"), "--cases", "6", "--no-report"])
    assert said.exit_code == 0
    assert "compile" not in said.output
    CliRunner().invoke(app, ["export", str(tmp_path / "run"), "--out", str(tmp_path / "ends.csv")])
    assert [*pd.read_csv(tmp_path / "ends.csv")] == ["case_id", "status", *METRICS]


def test_a_run_with_failed_cases_says_why_the_first_of_them_failed(tmp_path):
    file = python_campaign(tmp_path / "ball", cases=4, fault="if case.id > 1: raise ValueError('no air')")
    said = CliRunner().invoke(app, ["run", str(file), "--out", str(tmp_path / "run"), "--no-report"]).output
    assert "failed       case 2: crashed, sim.py, line 11: ValueError: no air\n" in said


def test_an_interrupted_run_counts_the_cases_whose_rows_are_recorded(tmp_path):
    fault = (
        "import os, signal, time\nif case.id == 3: os.kill(int(os.environ['ENGINE']), signal.SIGINT); time.sleep(30)"
    )
    file = python_campaign(tmp_path / "ball", cases=48, fault=fault)
    words = [sys.executable, "-m", "mc_engine"]
    said = interrupted(file, tmp_path / "run")
    assert GIVING_UP in said.splitlines()
    assert "interrupted with 0 of 48 cases and the rows of 3 more; `mc-engine resume" in said
    said = subprocess.run([*words, "status", tmp_path / "run"], capture_output=True, text=True, timeout=60).stdout
    assert "flies them but 3 whose rows are recorded\n" in said


def test_few_long_cases_are_shared_out_among_the_workers(tmp_path):
    wait = [
        "import os, time",
        f"os.close(os.open(f'{tmp_path}/flies-{{case.id}}', os.O_CREAT))",
        f"other, end = f'{tmp_path}/flies-{{1 - case.id}}', time.monotonic() + 30.0",
        "while case.id >= 0 and not os.path.exists(other) and time.monotonic() < end: time.sleep(0.01)",
        "assert case.id < 0 or os.path.exists(other), 'the other case does not fly'",
    ]
    campaign = load_campaign(python_campaign(tmp_path / "ball", cases=2, fault="\n".join(wait)))
    assert set(run(campaign, tmp_path / "run", workers=2).cases()["reason"]) == {""}


def test_the_progress_counts_cases_that_no_part_holds_yet(tmp_path):
    fault = "import time\nif case.id > 0: time.sleep(0.5)\nif case.id == 1: raise ValueError('no air')"
    campaign, seen = load_campaign(python_campaign(tmp_path / "ball", cases=4, fault=fault)), []
    run(campaign, tmp_path / "run", workers=1, chunk=4, progress=lambda *counts: seen.append(counts))
    assert (1, 4, 0) in seen
    assert (3, 4, 1) in seen
    assert seen[-1] == (4, 4, 1)


def test_a_stopped_run_ends_a_case_that_flies_for_its_history(tmp_path):
    """It may hang there as well as in its first flight, and has no time limit."""
    mark = tmp_path / "flown"
    fault = [
        "import os, signal, time",
        f"again = case.id == 0 and os.path.exists({str(mark)!r})",
        "if again: os.kill(int(os.environ['ENGINE']), signal.SIGINT); time.sleep(300)",
        f"if case.id == 0: open({str(mark)!r}, 'w').close()",
    ]
    file = python_campaign(tmp_path / "ball", cases=2, fault="\n".join(fault))
    said = interrupted(file, tmp_path / "run")
    assert GIVING_UP in said.splitlines()
    assert "interrupted with 2 of 2 cases and without the saved time histories; `mc-engine resume" in said


def interrupted(file, out):
    """What a run says on standard error, whose cases know it by the variable ENGINE and send it a signal."""
    begin = "import os, runpy; os.environ['ENGINE'] = str(os.getpid())"
    words = [sys.executable, "-c", f"{begin}; runpy.run_module('mc_engine', run_name='__main__')", "run", file]
    words += ["--workers", "1", "--no-report", "--out", out]
    return subprocess.run(words, capture_output=True, text=True, timeout=60).stderr


def test_a_changed_simulator_is_another_one(tmp_path):
    file = python_campaign(tmp_path / "a", cases=4)
    run(load_campaign(file), tmp_path / "run", workers=1)
    copy = tmp_path / "run/sim.py"
    copy.write_text(copy.read_text().replace("9.81", "9.80"))
    with pytest.raises(Exception, match=r"sim\.py"):
        resume(tmp_path / "run")


MISTAKES = {
    "no program": ('["./fall"', '["./fal"', 'simulator.command: there is no program "./fal"'),
    "not on the path": ('["./fall"', '["falls-nowhere"', 'no program "falls-nowhere" on the PATH'),
    "slots": ("time_limit_s = 60.0", "slots = 0", "simulator.slots: 0 is not allowed; it must be at least 1"),
    "unknown place": ("{folder}", "{foldr}", 'word 3: {foldr} is not known; did you mean "folder"?'),
    "place": ('result = "result.json"', 'result = "{seed}.json"', 'the {seed} of "{seed}.json" is only replaced'),
    "never read": ('result = "result.json"', "", "is never read; give it a `pattern` over stdout"),
    "two things": ("[campaign]", '[campaign]\nsimulator = "sim.py"', "beside the table [simulator]"),
    "template": ("case.txt.j2", "other.j2", 'other.j2: "mas_kg" is no input; did you mean "mass_kg"?'),
    "filter": ("case.txt.j2", "filter.j2", "filter.j2, line 2: No filter named 'runden'."),
    "default": ("low = 0.1", "low = 20.0", "mass_kg: the model's own value 10 is not within"),
    "tolerance": ("time_limit_s", "tolerance = 1e-9\ntime_limit_s", "has a `tolerance`, and `replay` compares bits"),
    "outside": ('"case.txt" =', '"../case.txt" =', 'input.../case.txt: "../case.txt" lies outside the folder of'),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes_are_sentences_with_their_place(tmp_path, mistake):
    old, new, sentence = MISTAKES[mistake]
    (tmp_path / "fall").write_text("#!/bin/sh\n")
    (tmp_path / "case.txt.j2").write_text("{{ mass_kg }}")
    (tmp_path / "other.j2").write_text("{{ mas_kg }}")
    (tmp_path / "filter.j2").write_text("\n{{ mass_kg | runden }}")
    text = CAMPAIGN.format(flies="", cases=4) + PROGRAM
    assert old in text
    (tmp_path / "campaign.toml").write_text(text.replace(old, new))
    with pytest.raises(CampaignError) as error:
        load_campaign(tmp_path / "campaign.toml")
    assert sentence in str(error.value)


def test_a_file_without_a_simulator_is_named(tmp_path):
    file = python_campaign(tmp_path / "a")
    (tmp_path / "a/sim.py").write_text("x = 1\n")
    with pytest.raises(CampaignError, match=r"campaign\.simulator: .* has no SIMULATOR; end it with"):
        load_campaign(file)


def test_results_from_elsewhere_make_the_same_run(tmp_path, flown):
    table = flown["case"].cases().drop(columns=["status", "reason"])
    table.to_parquet(tmp_path / "results.parquet", index=False)
    campaign = load_campaign(python_campaign(tmp_path / "ball"))
    store = import_results(campaign, tmp_path / "results.parquet", tmp_path / "run")
    assert store.cases().equals(flown["case"].cases())
    assert judgement(store)[0] == judgement(flown["case"])[0]
    assert store.manifest["imported"]["file"] == "results.parquet"
    assert nominal_line(store) == NO_NOMINAL  # not as if it had been flown and had failed
    with pytest.raises(StoreError, match=r"imported from results\.parquet; the engine did not fly them"):
        replay(tmp_path / "run", 3)


def test_fewer_results_than_the_campaign_has_cases_are_imported_by_number(tmp_path, flown):
    flown["case"].cases()[:30].to_csv(tmp_path / "results.csv", index=False)
    file, out = python_campaign(tmp_path / "ball"), tmp_path / "run"
    command = ["import", str(tmp_path / "results.csv"), "--campaign", str(file), "--out", str(out), "--no-report"]
    assert CliRunner().invoke(app, command).exit_code == 2
    assert CliRunner().invoke(app, [*command, "--cases", "30"]).exit_code == 0
    said = CliRunner().invoke(app, ["status", str(out)]).stdout
    assert "imported  from results.csv; the engine did not fly these cases" in said
    assert "30 of 30 cases: 30 ok" in said


def test_results_of_other_inputs_are_refused(tmp_path, flown):
    table = flown["case"].cases()
    campaign = load_campaign(python_campaign(tmp_path / "ball"))
    table.loc[7, "mass_kg"] += 1e-3
    table.to_csv(tmp_path / "results.csv", index=False)
    with pytest.raises(CampaignError, match=r"mass_kg: case 7 has .* and the campaign draws .*; 1 case differs"):
        import_results(campaign, tmp_path / "results.csv", tmp_path / "run")
    table.drop(index=50).to_csv(tmp_path / "results.csv", index=False)
    with pytest.raises(CampaignError, match="case_id: case 50 is missing"):
        import_results(campaign, tmp_path / "results.csv", tmp_path / "run")
    table.drop(columns="fall_time_s").to_csv(tmp_path / "results.csv", index=False)
    with pytest.raises(CampaignError, match="fall_time_s: is no column of the table"):
        import_results(campaign, tmp_path / "results.csv", tmp_path / "run")


@pytest.mark.parametrize(
    ("table", "row", "change", "sentence"),
    [
        ("results", 3, {"case_id": -2}, "row 4: -2 is no case of the campaign; it has the cases 0 to 99, and -1"),
        ("results", 3, {"case_id": 2}, "case_id: case 3 is missing"),
        ("results", 101, {"case_id": -2}, "case_id: row 102: -2 is no case of the campaign"),
        ("results", 101, {"case_id": 2}, "case_id: case 2 is there twice; remove one of its rows"),
        ("results", 101, {"case_id": -1}, "case_id: case -1 is there twice"),
        ("history", 0, {"case_id": -2}, r"history.csv: 1 problem\s+case_id: row 1: -2 is no case of the campaign"),
        ("history", 0, {"case_id": 100}, "case_id: row 1: 100 is no case .* remove the row, or .* --cases"),
        ("history", 0, {"case_id": 0.5}, "case_id: row 1: 0.5 is no case of the campaign"),
        ("history", 1, {"t_s": -0.5}, r"t_s: row 2: -0.5 s follows 0 s of case -1; sort the rows of each case by time"),
    ],
)
def test_unknown_cases_and_falling_times_of_imported_tables_are_refused(tmp_path, flown, table, row, change, sentence):
    store = flown["case"]
    nominal = pd.DataFrame([{name: value for name, value in store.nominal().items() if name in store.cases()}])
    results = pd.concat([store.cases(), nominal.assign(case_id=-1)], ignore_index=True)
    tables = {"results": results, "history": store.histories()}
    changed = tables[table].reindex(range(max(len(tables[table]), row + 1))).ffill()
    tables[table] = changed.astype(dict.fromkeys(change, float)).fillna("")
    tables[table].loc[row, [*change]] = [*change.values()]
    for name, frame in tables.items():
        frame.to_csv(tmp_path / f"{name}.csv", index=False)
    campaign = load_campaign(python_campaign(tmp_path / "ball"))
    with pytest.raises(CampaignError, match=sentence):
        import_results(campaign, tmp_path / "results.csv", tmp_path / "run", tmp_path / "history.csv")
    assert not (tmp_path / "run").exists()


def test_words_and_numbers_of_imported_results_are_checked(tmp_path, flown):
    table = flown["case"].cases().astype({"fall_time_s": object})
    campaign = load_campaign(python_campaign(tmp_path / "ball"))
    table.loc[7, "status"] = "crashd"
    table.to_csv(tmp_path / "results.csv", index=False)
    with pytest.raises(CampaignError, match=r'status: row 8: "crashd" is no status of a case; did you mean "crashed"'):
        import_results(campaign, tmp_path / "results.csv", tmp_path / "run")
    table.loc[7, "status"] = "crashed"
    for cell in ("1_0", "\u0663", "soon"):
        table.loc[7, "fall_time_s"] = cell
        table.to_csv(tmp_path / "results.csv", index=False)
        with pytest.raises(CampaignError, match=rf"row 8, column \"fall_time_s\": '{cell}' is not a number"):
            import_results(campaign, tmp_path / "results.csv", tmp_path / "run")
    table.loc[7, "fall_time_s"] = ""
    table.to_csv(tmp_path / "results.csv", index=False)
    store = import_results(campaign, tmp_path / "results.csv", tmp_path / "run")
    assert store.status_counts() == {"ok": 99, "crashed": 1}
    others = table.index != 7
    assert store.cases()["fall_time_s"][others].equals(flown["case"].cases()["fall_time_s"][others])


def test_an_imported_history_of_which_nothing_is_declared_is_refused(tmp_path, flown):
    flown["case"].cases().to_csv(tmp_path / "results.csv", index=False)
    flown["case"].histories().to_csv(tmp_path / "history.csv", index=False)
    file = python_campaign(tmp_path / "ball")
    source = file.with_name("sim.py")
    source.write_text(source.read_text().replace('outputs=outputs(speed_m_s="speed"),', ""))
    with pytest.raises(CampaignError, match=r"history\.csv: .*\n.* declares no outputs, of which a time history could"):
        import_results(load_campaign(file), tmp_path / "results.csv", tmp_path / "run", tmp_path / "history.csv")


def with_nominal(flown, tmp_path, **changes):
    """The run that is imported from the table with its nominal case, which is changed."""
    store = flown["case"]
    row = {name: value for name, value in store.nominal().items() if name in store.cases()}
    table = pd.concat([store.cases(), pd.DataFrame([{**row, "case_id": -1, **changes}])])
    table.to_csv(tmp_path / "results.csv", index=False)
    return import_results(load_campaign(python_campaign(tmp_path / "ball")), tmp_path / "results.csv", tmp_path / "run")


@pytest.mark.parametrize(
    ("changes", "status", "reason"),
    [
        ({}, "ok", ""),
        ({"status": "no-stop", "reason": "too long"}, "no-stop", "too long"),
        ({"fall_time_s": np.nan}, "not-finite", '"fall_time_s" is no finite number in the imported table'),
    ],
)
def test_an_imported_nominal_case_is_judged_like_the_others(tmp_path, flown, changes, status, reason):
    row = with_nominal(flown, tmp_path, **changes).nominal()
    assert (row["status"], row["reason"]) == (status, reason)
    assert np.isfinite(row["fall_time_s"]) == (status == "ok")
    assert row["mass_kg"] == flown["case"].nominal()["mass_kg"]


def test_an_imported_nominal_case_of_other_inputs_is_refused(tmp_path, flown):
    with pytest.raises(CampaignError, match=r"mass_kg: case -1 has 99, and the nominal value of the campaign is "):
        with_nominal(flown, tmp_path, mass_kg=99.0)


def test_the_histories_of_a_batch_simulator_are_shared_out_among_the_workers(tmp_path, monkeypatch):
    folder = tmp_path / "ball"
    file = python_campaign(folder, cases=40, options="batch=True,")
    file.write_text(file.read_text().replace("first = 2", "first = 40"))
    pieces = []
    monkeypatch.setattr(histories, "in_threads", lambda fly, given, workers: pieces.extend(given) or map(fly, given))
    store = run(load_campaign(file), folder / "run", workers=2)
    assert set(store.histories()["case_id"]) == {-1, *range(40)}
    assert max(map(len, pieces)) <= 20  # two workers and more have some to fly


@pytest.mark.parametrize(("number", "words"), [(0.0123, "0.012 s"), (9.96, "10 s"), (124.0, "120 s"), (359.0, "360 s")])
def test_the_time_that_a_campaign_will_take_has_no_exponent(number, words):
    assert about(number, "s") == words
