"""Workers that die: killed from outside at any instant, by their own cases, by the clock or for want of memory."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import psutil
import pytest
from killed_runs import FORKING
from trapped import files_of, trapped

from mc_engine import load_campaign, open_store
from mc_engine.errors import ModelError
from mc_engine.runner import runner
from mc_engine.runner.backends import Backend
from mc_engine.store.verification import damage
from tests.mc_engine.flight.falling_ball import python_campaign

SLEEP_S = 0.2  # of every flight: a chunk takes long enough to be hit in the middle
CHUNK = 50
LONGEST_S = 300.0  # of a command with few cases; a run that waits for ever is ended here
WORKERS = {"loky": "popen_loky_posix", "dask": "spawn_main"}  # words of their command lines

# The command line, with chunks of so many cases, and on a build that is broken where one is named.
COMMAND = """
import runpy, sys
import broken_builds
from mc_engine.runner import sessions

chunk, broken = int(sys.argv[1]), sys.argv[2]
sessions.chunk_size = lambda cases, workers, flyer: chunk
if broken:
    broken_builds.BREAKS[broken](setattr)
sys.argv[:3] = ["mc-engine"]
runpy.run_module("mc_engine", run_name="__main__")
"""


def command(*words, broken="", **environment):
    """The process of a command of the engine."""
    arguments = [sys.executable, "-c", COMMAND, f"{CHUNK}", broken, *map(str, words)]
    return subprocess.Popen(arguments, env={**FORKING, **environment}, stderr=subprocess.PIPE, text=True)


def completed(process, longest_s=LONGEST_S):
    """The process must come to its end by itself, with exit status 0."""
    try:
        errors = process.communicate(timeout=longest_s)[1]
    finally:
        process.kill()
    assert process.returncode == 0, errors
    assert "Traceback" not in errors


def workers_of(process, backend):
    """The worker processes of a command."""
    workers = []
    for child in psutil.Process(process.pid).children():
        try:
            if WORKERS[backend] in " ".join(child.cmdline()):
                workers.append(child)
        except psutil.NoSuchProcess:
            pass
    return workers


def kill_at_random(process, run, backend, seed, kills):
    """Kill a worker of the command some time after a part has landed, so that the run goes on in between.

    Returns how many kills are left when the command ends.
    """
    rng, seen = np.random.default_rng(seed), 0
    while kills and process.poll() is None:
        landed = len(list(run.glob("cases/part-*")))
        if landed == seen:
            time.sleep(0.01)
            continue
        seen = landed
        time.sleep(rng.uniform(0.0, 2.0 * SLEEP_S))
        if workers := workers_of(process, backend):
            os.kill(workers[rng.integers(len(workers))].pid, signal.SIGKILL)
            kills -= 1
    return kills


def check_kills(folder, backend, seed, kills, cases, broken=""):
    campaign, run = trapped(folder / "campaign", cases), folder / "run"
    options = ["--out", run, "--workers", 2, "--backend", backend, "--no-report"]
    process = command("run", folder / "campaign", *options, broken=broken, STONES_SLEEP_S=f"{SLEEP_S}")
    left = kill_at_random(process, run, backend, seed, kills)
    completed(process, longest_s=3600.0)
    assert left == 0
    whole = runner.run(campaign, folder / "whole", workers=2, chunk=CHUNK)
    assert files_of(run) == files_of(whole.path)
    assert damage(run) == []


@pytest.mark.parametrize(
    ("backend", "kills", "cases"),
    [
        ("loky", 1, 400),
        pytest.param("loky", 5, 1500, marks=pytest.mark.slow),
        pytest.param("loky", 100, 30_000, marks=pytest.mark.slow),
        pytest.param("dask", 30, 9_000, marks=pytest.mark.slow),
    ],
)
def test_workers_killed_at_random_instants_lose_nothing_and_repeat_nothing(
    tmp_path, backend, kills, cases, record_property
):
    check_kills(tmp_path, backend, seed=1, kills=kills, cases=cases)
    record_property("kills", kills)
    record_property("cases lost or doubled", f"0 of {cases}")


def check_isolated(folder, cases, killers, backend, broken="", longest_s=LONGEST_S):
    """All killers are found, with their inputs; all other rows are those of the same stones without traps."""
    trapped(folder / "campaign", cases, dict.fromkeys(killers, 1))
    options = ["--out", folder / "run", "--workers", 2, "--backend", backend, "--no-report"]
    completed(command("run", folder / "campaign", *options, broken=broken), longest_s)
    run = open_store(folder / "run")
    plain = runner.run(trapped(folder / "plain", cases), folder / "plain_run", workers=2).cases()
    frame = run.cases()
    assert sorted(frame["case_id"][frame["status"] == "worker-died"]) == sorted(killers)
    died = frame[frame["status"] == "worker-died"]
    assert set(died["reason"]) == {"the process flying this case died"}
    assert died["end_height_m"].isna().all()
    inputs = ["height_m", "speed_m_s"]
    assert frame[inputs].equals(plain[inputs])
    rest = frame["status"] == "ok"
    assert frame[rest].drop(columns="trap").equals(plain[rest].drop(columns="trap"))
    assert damage(run.path) == []
    return run


def rerun(run, backend, **environment):
    """Fly the failed cases of a run again on the command line; the parts of before and of after, by name."""
    before = parts_of(run)
    completed(command("rerun", "--failed", run, "--workers", 2, "--backend", backend, "--no-report", **environment))
    assert damage(run) == []
    return before, parts_of(run)


def parts_of(run):
    return {path.name: path.read_bytes() for path in (run / "cases").iterdir()}


@pytest.mark.parametrize(
    ("backend", "cases", "killers"), [("loky", 400, [7, 260]), pytest.param("dask", 300, [260], marks=pytest.mark.slow)]
)
def test_cases_that_kill_their_worker_are_isolated_and_fly_when_asked_again(
    tmp_path, backend, cases, killers, record_property
):
    run = check_isolated(tmp_path, cases, killers, backend).path
    record_property("killing cases found", f"{len(killers)} of {len(killers)} in {cases}")
    before, after = rerun(run, backend, TRAPS_OFF="1")
    again = open_store(run)
    assert again.status_counts() == {"ok": cases}
    assert again.cases().drop(columns="trap").equals(open_store(tmp_path / "plain_run").cases().drop(columns="trap"))
    assert len(before.items() & after.items()) == len(again.parts) - len(killers)
    runner.rerun(run, workers=1)  # nothing failed: nothing flies, nothing changes
    assert parts_of(run) == after


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["loky", "dask"])
def test_cases_that_kill_whenever_they_fly_keep_their_rows(tmp_path, backend):
    run = check_isolated(tmp_path, 400, [7, 260], backend).path
    before, after = rerun(run, backend)
    assert before == after


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["loky", "dask"])
def test_ten_killing_cases_in_ten_thousand_are_isolated(tmp_path, backend):
    killers = np.random.default_rng(3).choice(10_000, 10, replace=False)
    check_isolated(tmp_path, 10_000, [int(case) for case in killers], backend, longest_s=3600.0)


@pytest.mark.parametrize("backend", ["loky", pytest.param("dask", marks=pytest.mark.slow)])
def test_a_case_that_takes_too_long_and_one_that_eats_its_memory_are_given_up(tmp_path, backend):
    campaign = trapped(tmp_path / "campaign", 200, {33: 2, 150: 3})
    limits = Backend(backend, case_seconds=3.0, memory_mib=2048)
    run = runner.run(campaign, tmp_path / "run", workers=2, backend=limits)
    frame = run.cases()
    assert frame.loc[33, ["status", "reason"]].tolist() == ["time-limit", "took longer than 3 s"]
    assert frame.loc[150, ["status", "reason"]].tolist() == [
        "worker-died",
        "needed more memory than its worker may have",
    ]
    assert run.status_counts() == {"ok": 198, "time-limit": 1, "worker-died": 1}
    plain = runner.run(trapped(tmp_path / "plain", 200), tmp_path / "plain_run").cases()
    rest = frame["status"] == "ok"
    assert frame[rest].drop(columns="trap").equals(plain[rest].drop(columns="trap"))


@pytest.mark.parametrize(
    ("backend", "trap", "seconds", "end"),
    [
        ("loky", 1, None, ["worker-died", "the process flying this case died"]),
        pytest.param("loky", 2, 3.0, ["time-limit", "took longer than 3 s"], marks=pytest.mark.slow),
        pytest.param("dask", 2, 3.0, ["time-limit", "took longer than 3 s"], marks=pytest.mark.slow),
    ],
)
def test_a_nominal_that_dies_or_hangs_leaves_its_row_and_every_case_and_flies_when_asked_again(
    tmp_path, monkeypatch, backend, trap, seconds, end
):
    campaign = trapped(tmp_path / "campaign", 200)
    monkeypatch.setenv("NOMINAL_TRAP", f"{trap}")
    run = runner.run(campaign, tmp_path / "run", workers=2, backend=Backend(backend, case_seconds=seconds))
    nominal = run.nominal()
    assert [nominal["status"], nominal["reason"]] == end
    assert nominal["height_m"] == 100.0
    assert np.isnan(nominal["end_height_m"])
    assert set(run.histories()["case_id"]) == {0, 1}
    assert damage(run.path) == []
    monkeypatch.delenv("NOMINAL_TRAP")
    whole = runner.run(campaign, tmp_path / "whole", workers=2, chunk=CHUNK)
    assert run.cases().equals(whole.cases())
    again = runner.rerun(run.path, workers=1)
    assert (again.path / "nominal.parquet").read_bytes() == (whole.path / "nominal.parquet").read_bytes()
    assert again.histories().equals(whole.histories())


@pytest.mark.parametrize("backend", ["threading", "loky"])
def test_a_model_that_calls_exit_is_told_and_not_waited_for(tmp_path, backend):
    campaign = trapped(tmp_path / "campaign", 100, {70: 4})
    with pytest.raises(ModelError, match="the model ends its process"):
        runner.run(campaign, tmp_path / "run", workers=2, backend=backend)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="elsewhere a function ends its own programs")
def test_a_time_limit_counts_the_flight_alone_and_leaves_neither_programs_nor_folders(tmp_path, monkeypatch):
    fault = "if case.id == 1:\n    import subprocess\n"
    fault += "    subprocess.Popen(['sleep', '4322'], start_new_session=True).wait()"
    file = python_campaign(
        tmp_path / "ball", cases=2, fault=fault, imports="import time", options="start=lambda: time.sleep(3.2),"
    )
    campaign = load_campaign(file)
    (tmp_path / "temporary").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    table = runner.run(campaign, tmp_path / "run", workers=1, backend=Backend("loky", case_seconds=3.0)).cases()
    assert table["status"].tolist() == ["ok", "time-limit"]
    assert ["sleep", "4322"] not in [process.info["cmdline"] for process in psutil.process_iter(["cmdline"])]
    assert list((tmp_path / "temporary").glob("mc-engine-*")) == []
