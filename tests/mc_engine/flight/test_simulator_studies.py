"""All that a run can be part of, with simulators: shards, clusters, studies, ways to give results, imports."""

import json
import re
import subprocess
import sys
from collections import Counter

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from mc_engine import CampaignError, load_campaign, open_run, open_store, run
from mc_engine.command_line.commands import app
from mc_engine.errors import ModelError, RunInterrupted
from mc_engine.flight import case_process
from mc_engine.flight.program_flight import _document
from mc_engine.runner.backends import Backend
from mc_engine.runner.runner import merge
from mc_engine.runner.shards import Shard
from mc_engine.runner.stopping import fly_until_decided
from mc_engine.runner.summary import judgement
from tests.mc_engine.flight.falling_ball import program_campaign, python_campaign

FILES = {"case": python_campaign, "program": program_campaign}
BATCH = "batch=True,"
TUNING = """
[tuning]
population = 8
generations = 3
[tuning.parameter.drag_area_m2]
lower = 0.01
upper = 0.05
[tuning.objective.speed]
metric = "impact_speed_m_s"
"""


def told(*words, status=0):
    """What a command prints; it must end with this exit status."""
    said = CliRunner().invoke(app, [str(word) for word in words])
    assert said.exit_code == status, said.output
    return said.output


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    return run(load_campaign(python_campaign(folder / "ball", cases=60)), folder / "run", workers=2)


def test_shards_make_the_same_run(tmp_path, flown):
    campaign = load_campaign(python_campaign(tmp_path / "ball", cases=60))
    for k in (1, 2):
        run(campaign, tmp_path / f"shard-{k}", workers=1, shard=Shard(k, 2))
    whole = merge(tmp_path / "merged", [tmp_path / "shard-1", tmp_path / "shard-2"], workers=1)
    assert whole.cases().equals(flown.cases())
    assert whole.histories().equals(flown.histories())


@pytest.mark.parametrize(
    "kind", ["case", *(pytest.param(kind, marks=pytest.mark.slow) for kind in FILES if kind != "case")]
)
def test_a_cluster_makes_the_same_run(tmp_path, flown, kind):
    pytest.importorskip("distributed")
    campaign = load_campaign(FILES[kind](tmp_path / "ball", cases=60))
    table = run(campaign, tmp_path / "run", workers=2, backend=Backend("dask")).cases()
    columns = ["case_id", "status", "mass_kg", "height_m"]
    assert table[columns].equals(flown.cases()[columns])
    assert np.allclose(table["fall_time_s"], flown.cases()["fall_time_s"], rtol=1e-12, atol=0.0)


def test_a_replay_of_a_refused_case_says_why_and_draws_no_empty_picture(tmp_path):
    ball = python_campaign(tmp_path / "ball", cases=3, fault="raise Refuse('the ball is lost')")
    flown = run(load_campaign(ball), tmp_path / "run", workers=1)
    said = told("replay", flown.path, 1)
    assert "case 1 failed: refused, the ball is lost\ncase 1 has no history\n" in said
    assert not (flown.path / "replay").exists()


def test_two_simulators_are_compared_case_by_case(tmp_path, flown):
    other = run(load_campaign(program_campaign(tmp_path / "ball", cases=60)), tmp_path / "run", workers=2)
    said = told("compare", flown.path, other.path)
    assert "paired: 60 cases have the same inputs in both runs" in said
    assert "the same in both runs: fall_time_s, impact_speed_m_s" in said
    lighter = "inputs = {**inputs, 'mass_kg': 0.9 * inputs['mass_kg']}"
    light = python_campaign(tmp_path / "light", cases=60, fault=lighter)
    changed = run(load_campaign(light), tmp_path / "run-light", workers=2)
    told("compare", flown.path, changed.path, status=1)


@pytest.mark.parametrize(
    "options", [pytest.param("", id="case", marks=pytest.mark.slow), pytest.param(BATCH, id="batch")]
)
def test_a_simulator_is_tuned(tmp_path, options):
    pytest.importorskip("pymoo")
    file = python_campaign(tmp_path / "ball", cases=4, options=options)
    file.write_text(file.read_text() + TUNING)
    told("tune", file, "--out", tmp_path / "tuned", "--no-report", "--workers", 2)
    front = pd.read_parquet(tmp_path / "tuned/front.parquet")
    assert front["drag_area_m2"].min() > 0.045  # more drag, less speed


@pytest.mark.parametrize("kind", [pytest.param("case", marks=pytest.mark.slow), "batch"])
def test_a_rare_event_of_a_simulator_is_estimated(tmp_path, kind):
    file = python_campaign(tmp_path / "ball", options=BATCH if kind == "batch" else "")
    file.write_text(file.read_text().replace("at_most = 90.0", "at_most = 80.0"))
    told("rare", file, "--out", tmp_path / "rare", "--cases-per-level", 500, "--no-report", "--workers", 2)
    found = json.loads((tmp_path / "rare/rare.json").read_text())["rare_event"]
    rng = np.random.default_rng(1)
    k = 0.02 * 1.225 / 2.0 / rng.normal(10.0, 0.5, 1_000_000)
    speed = np.sqrt(9.81 / k * -np.expm1(-2.0 * k * rng.uniform(450.0, 550.0, k.size)))
    assert found["lower"] < np.mean(speed > 80.0) < found["upper"]
    assert found["no_number"] == 0


def test_flying_ends_where_the_requirement_of_a_simulator_is_decided(tmp_path):
    campaign = load_campaign(python_campaign(tmp_path / "ball", cases=500))
    store = fly_until_decided(campaign, tmp_path / "run", workers=2)
    assert store.n_cases < 100
    assert judgement(store)[0][0].outcome == "pass"


def program(folder, read, how, cases=8):
    """A campaign of the C program with another table of how its result is read."""
    file = program_campaign(folder, cases=cases)
    text = file.read_text()
    for name, key in (("fall_time_s", "time"), ("impact_speed_m_s", "speed")):
        text = text.replace(f'read = "{key}"', read[name])
    file.write_text(text.replace('result = "result.json"\n', "").replace('echo = "used"\n', how))
    return file


def test_all_wrong_units_of_a_table_are_told_at_once(tmp_path):
    file = program_campaign(tmp_path / "ball")
    text = file.read_text()
    for old, new in (("mass_kg = {", 'mass_kg = { unit = "kgg",'), ("fall_time_s = {", 'fall_time_s = { unit = "m",')):
        assert old in text
        text = text.replace(old, new)
    file.write_text(text)
    with pytest.raises(CampaignError) as error:
        load_campaign(file)
    assert 'simulator.parameter.mass_kg: "mass_kg" has the unit "kgg"; did you mean "kg"?' in str(error.value)
    assert 'simulator.metric.fall_time_s: "fall_time_s" has the unit "m", so that its name must' in str(error.value)


def test_results_are_read_from_a_csv_or_by_patterns_over_stdout(tmp_path, flown):
    shell = {"result.csv": "printf 'time,speed\\n%s,%s\\n' $t $v > result.csv", "": "echo time = $t; echo speed: $v"}
    reads = {
        "result.csv": {"fall_time_s": 'read = "time"', "impact_speed_m_s": 'read = "speed"'},
        "": {"fall_time_s": "pattern = 'time = (\\S+)'", "impact_speed_m_s": "pattern = 'speed: (\\S+)'"},
    }
    number = "sed 's/.*\"%s\": \\([^,]*\\),.*/\\1/' result.json"
    for result, write in shell.items():
        folder = tmp_path / (result or "stdout")
        file = program(folder, reads[result], f'result = "{result}"\n' if result else "")
        lines = ["#!/bin/sh", '"$1" "$2" "$3"', f"t=$({number % 'time'}); v=$({number % 'speed'})", write]
        (folder / "fly.sh").write_text("\n".join(lines))
        (folder / "fly.sh").chmod(0o755)
        file.write_text(file.read_text().replace('["./fall", ', '["./fly.sh", "./fall", '))
        table = run(load_campaign(file), folder / "run", workers=1).cases()
        assert set(table["status"]) == {"ok"}, set(table["reason"])
        assert np.allclose(table["fall_time_s"], flown.cases()["fall_time_s"][:8], rtol=1e-15, atol=0.0)
        assert np.allclose(table["impact_speed_m_s"], flown.cases()["impact_speed_m_s"][:8], rtol=1e-12, atol=0.0)


def test_a_csv_may_end_its_lines_by_a_return_and_one_that_cannot_be_read_is_no_result(tmp_path):
    """Both ended the process of the case, which was said to have crashed."""
    (tmp_path / "returns.csv").write_bytes(b"time,speed\r1.5,2\r")
    assert _document(tmp_path, "returns.csv") == {"time": "1.5", "speed": "2"}
    (tmp_path / "blanks.csv").write_text('"time", "speed"\n1.5, "2"\n')
    assert _document(tmp_path, "blanks.csv") == {"time": "1.5", "speed": "2"}
    (tmp_path / "twice.csv").write_text("time,speed,time\n1,2,3\n")
    assert _document(tmp_path, "twice.csv") == {"time": ["1", "3"], "speed": "2"}  # a list is no number
    (tmp_path / "long.csv").write_text(f"time\n{'1' * 200_000}\n")
    with pytest.raises(ValueError, match="cannot be read: field larger than"):
        _document(tmp_path, "long.csv")
    (tmp_path / "names.csv").write_text("time,speed\n")
    with pytest.raises(ValueError, match="has 1 row of 2 fields; it must have one of names and one of numbers"):
        _document(tmp_path, "names.csv")


@pytest.mark.parametrize(("slots", "most"), [pytest.param(1, 1, marks=pytest.mark.slow), (2, 2)])
def test_no_more_cases_fly_at_a_time_than_there_are_slots(tmp_path, slots, most):
    marks = tmp_path / "marks"
    marks.mkdir()
    lines = [
        "import os, time",
        f"mark = {str(marks)!r} + f'/{{os.getpid()}}'",
        "open(mark, 'w').close()",
        f"many, end, met = 0, time.monotonic() + 60.0, {str(tmp_path / 'met')!r}",
        f"while many < {most} and time.monotonic() < end:  # on a busy machine the other process starts late",
        f"    many = max(many, len(os.listdir({str(marks)!r})))",
        "    if case.id < 0 or os.path.exists(met): break",
        "    time.sleep(0.01)",
        "if case.id >= 0: open(met, 'w').close()",
        "time.sleep(0.05)",
        "os.remove(mark)",
        "return {'fall_time_s': float(many), 'impact_speed_m_s': 1.0}",
    ]
    file = python_campaign(tmp_path / "ball", cases=40, fault="\n".join(lines), options=f"slots={slots},")
    table = run(load_campaign(file), tmp_path / "run", workers=4, chunk=5).cases()
    assert table["fall_time_s"].max() == most


# what "failed" keeps, as where nothing is said, is also looked at in test_simulators.py and tests/faults/test_links.py
@pytest.mark.parametrize(
    ("keep", "kept"), [("all", 12), pytest.param("failed", 1, marks=pytest.mark.slow), ("none", 0)]
)
def test_folders_of_cases_are_kept_as_asked(tmp_path, keep, kept):
    fault = "(case.folder / 'deck.inp').write_text('10')\nif case.id == 7: raise ValueError('no')"
    file = python_campaign(tmp_path / "ball", cases=12, fault=fault, options=f'keep="{keep}",')
    run(load_campaign(file), tmp_path / "run", workers=2)
    counts = Counter(path.name for path in (tmp_path / "run/simulator").rglob("*") if path.is_file())
    assert counts == ({"deck.inp": kept, "case.json": kept} if kept else {})


def test_imported_histories_are_those_of_a_run(tmp_path, flown):
    campaign = python_campaign(tmp_path / "ball", cases=60)
    flown.cases().to_parquet(tmp_path / "results.parquet")
    flown.histories().to_csv(tmp_path / "history.csv", index=False)
    words = ["import", tmp_path / "results.parquet", "--campaign", campaign, "--history", tmp_path / "history.csv"]
    told(*words, "--out", tmp_path / "run", "--no-report")
    assert open_store(tmp_path / "run").histories().equals(flown.histories())
    assert "imported" in open_run(tmp_path / "run").store.manifest
    flown.histories().drop(columns="speed_m_s").to_csv(tmp_path / "history.csv", index=False)
    assert '"history.csv" has no column "speed_m_s"' in told(*words, "--out", tmp_path / "other", status=2)


def test_histories_are_imported_for_a_table_that_describes_only_a_simulator(tmp_path):
    (tmp_path / "campaign.toml").write_text("""
[campaign]
cases = 2
design = "mc"
seed = 3
[simulator.parameter]
mass_kg = { default = 10.0 }
[simulator.metric]
range_km = {}
[simulator.output]
height_m = {}
[dispersion.mass_kg]
dist = "normal"
sigma = 0.5
""")
    file, past = tmp_path / "results.csv", tmp_path / "history.csv"
    told("sample", tmp_path / "campaign.toml", "--out", file)
    pd.read_csv(file).assign(range_km=1.0).to_csv(file, index=False)
    past.write_text("case_id,t_s,height_m\n0,0,1\n0,1,2\n")
    words = ["import", file, "--campaign", tmp_path / "campaign.toml", "--history", past, "--out", tmp_path / "run"]
    told(*words, "--no-report")
    assert open_store(tmp_path / "run").histories()["height_m"].tolist() == [1.0, 2.0]


def test_a_failed_case_of_elsewhere_is_a_row_with_a_status_and_other_columns_are_named(tmp_path, flown):
    campaign, table, file = python_campaign(tmp_path / "ball", cases=60), flown.cases(), tmp_path / "results.csv"
    table.loc[7, ["status", "reason", "fall_time_s", "impact_speed_m_s"]] = ["crashed", "no licence", None, None]
    table.assign(drag_area_m2=1.0).to_csv(file, index=False)
    words = ["import", file, "--campaign", campaign, "--no-report", "--out"]
    named = 'imported     without "drag_area_m2": no dispersed inputs or metrics of the campaign'
    assert named in told(*words, tmp_path / "run")
    assert open_store(tmp_path / "run").row(7)["reason"] == "no licence"
    told("report", tmp_path / "run", "--format", "md")
    report = (tmp_path / "run/report.md").read_text()
    assert "Cases: 60 imported from results.csv, not flown by the engine, 59 completed" in report
    assert "(independent random draws) with 2 dispersed inputs.\n" in report  # no nominal case, as the table has none
    table.drop(index=7).to_csv(file, index=False)
    said = told(*words, tmp_path / "other", status=2)
    assert "case 7 is missing" in said
    assert 'a case that failed needs a row, too, with a status such as "crashed"' in said


def test_a_table_whose_case_id_is_an_index_that_pandas_does_not_write_is_told_the_column(tmp_path, flown):
    campaign = python_campaign(tmp_path / "ball", cases=60)
    flown.cases().drop(columns="case_id").rename_axis("case_id").to_parquet(tmp_path / "results.parquet")
    words = ["import", tmp_path / "results.parquet", "--campaign", campaign, "--out", tmp_path / "run"]
    said = told(*words, status=2)
    assert "case_id: is no column of the table; add it, with the number of each case from 0; `reset_index`" in said


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("fall_time_s", "row 1, column \"fall_time_s\": '[1.0]' is not a number"),
        ("status", 'row 1: "[1.0]" is no status'),
    ],
)
def test_a_column_of_lists_in_a_parquet_table_is_told_with_its_row(tmp_path, flown, name, sentence):
    campaign = python_campaign(tmp_path / "ball", cases=60)
    flown.cases().assign(**{name: [[1.0]] * 60}).to_parquet(tmp_path / "results.parquet")
    words = ["import", tmp_path / "results.parquet", "--campaign", campaign, "--out", tmp_path / "run"]
    assert sentence in told(*words, status=2)


def test_a_table_without_a_number_is_not_blamed_on_the_model(tmp_path, flown):
    campaign = python_campaign(tmp_path / "ball", cases=60)
    metrics = [column.name for column in flown.columns if column.role == "metric"]
    flown.cases().assign(**dict.fromkeys(metrics, np.nan)).to_csv(tmp_path / "results.csv", index=False)
    words = ["import", tmp_path / "results.csv", "--campaign", campaign, "--out", tmp_path / "run", "--no-report"]
    assert "no case completed; the column `reason` of its cases says why" in told(*words)


def test_check_tells_of_files_that_fly_reads_and_a_run_keeps_no_copy_of(tmp_path):
    fault = "inputs['mass_kg'] *= float(open(__file__.replace('sim.py', 'scale.txt')).read())"
    file = python_campaign(tmp_path / "ball", fault=fault)
    (file.parent / "scale.txt").write_text("1.1")
    said = CliRunner().invoke(app, ["check", str(file)])
    assert said.exit_code == 2
    assert "from the copies of its files that a run keeps" in said.output
    assert "ends as crashed" in said.output
    assert "No such file or directory: 'scale.txt'; name files that it reads in `data`" in said.output
    source = file.parent / "sim.py"
    source.write_text(source.read_text().replace("    fly=fly,", '    fly=fly,\n    data=("scale.txt",),'))
    assert CliRunner().invoke(app, ["check", str(file)]).stdout.splitlines()[1].startswith("deterministic")


def test_check_tells_of_declared_outputs_of_which_no_history_comes(tmp_path):
    fault = "return {'fall_time_s': 1.0, 'impact_speed_m_s': 1.0}"
    told = "no time histories are saved, because the nominal case gives none of its declared outputs"
    for folder, lines, expected in (("none", fault, True), ("some", "", False)):
        said = CliRunner().invoke(app, ["check", str(python_campaign(tmp_path / folder, cases=1, fault=lines))])
        assert said.exit_code == 0
        assert (told in said.stdout) == expected


@pytest.mark.parametrize("design", ["mc", "one_at_a_time"])
def test_check_asks_what_moves_a_metric_only_where_case_0_is_not_the_nominal(tmp_path, design):
    file = python_campaign(tmp_path / "ball", fault="return {'fall_time_s': 1.0, 'impact_speed_m_s': 1.0}")
    text = re.sub(r"cases = .*\n|seed = .*\n|first = 2", "", file.read_text())
    file.write_text(text.replace('"mc"', '"mc"\ncases = 4\nseed = 3' if design == "mc" else f'"{design}"'))
    said = CliRunner().invoke(app, ["check", str(file)])
    assert said.exit_code == 0
    assert ("does an input move it?" in said.stdout) == (design == "mc")


def test_a_process_that_waits_flies_no_campaign_whose_table_or_environment_has_changed(tmp_path, monkeypatch):
    text = """
[campaign]
cases = 2
design = "mc"
seed = 3
[simulator]
command = ["sh", "-c", "echo t=1 t=$FALL"]
[simulator.metric]
fall_time_s = { pattern = "t=(.)$" }
"""
    changes = [("", "", 2.0), ("", "", 4.0), ("t=$FALL", "t=7", 7.0), ("t=(.)$", "^t=(.)", 1.0)]
    for place, (old, new, found) in enumerate(changes):
        monkeypatch.setenv("FALL", f"{found:.0f}")
        campaign = load_campaign("echo", text=text.replace(old, new), directory=tmp_path)
        assert set(run(campaign, tmp_path / f"run-{place}", workers=1).cases()["fall_time_s"]) == {found}


@pytest.mark.parametrize("times", [1, 2])
def test_a_process_that_sigterm_ends_while_it_starts_is_started_once_more(tmp_path, times, monkeypatch):
    """As one of a job that is ended; what always ends so is at fault."""
    start, begun = case_process.CaseProcess._start, []

    def start_and_end(process, descriptor):
        begun.append(process)
        if len(begun) > times:
            return start(process, descriptor)
        return subprocess.Popen([sys.executable, "-c", "import os; os.kill(os.getpid(), 15)"])

    monkeypatch.setattr(case_process.CaseProcess, "_start", start_and_end)
    monkeypatch.setattr(case_process, "JOB_S", 0.1)
    campaign = load_campaign(python_campaign(tmp_path / "ball", cases=2))
    if times == 1:
        assert set(run(campaign, tmp_path / "run", workers=1).cases()["status"]) == {"ok"}
    else:
        with pytest.raises(ModelError, match="ended by SIGTERM"):
            run(campaign, tmp_path / "run", workers=1)
    assert len(begun) == 2


def test_a_process_that_cannot_start_after_the_nominal_case_leaves_a_run_that_resumes(tmp_path):
    """The nominal case of a simulator may have taken hours, and a licence may be missing for a moment."""
    busy = tmp_path / "busy"
    imports = f"from pathlib import Path\nif Path({str(busy)!r}).exists(): raise OSError('no licence')\n"
    fault = f"open({str(busy)!r}, 'w').close()\nif np.size(case.id) > 1: import os; os._exit(1)"
    ball = python_campaign(tmp_path / "ball", cases=4, imports=imports, fault=fault, options=BATCH)
    with pytest.raises(RunInterrupted, match=r"no licence; what was committed is safe, `mc-engine resume "):
        run(load_campaign(ball), tmp_path / "run", workers=1)
    busy.unlink()
    assert open_store(tmp_path / "run").nominal()["status"] == "ok"
