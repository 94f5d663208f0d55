"""Ctrl-C, SIGTERM and kill -9 of a run with worker processes: what lands, what is said, and who stays behind."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from contextlib import suppress

import numpy as np
import psutil
import pytest
from trapped import ENVIRONMENT, campaign_folder

from mc_engine import open_store, resume
from mc_engine.runner import runner
from mc_engine.store.verification import damage
from tests.mc_engine.flight.falling_ball import noting_campaign

CASES = 3200  # sixteen chunks for two workers
GONE_WITHIN_S = 20.0


def begin(folder, backend, sleep_s, awaited="run/cases/part-*"):
    """A run on the command line, in a process group of its own, in which the awaited file is there."""
    campaign = campaign_folder(folder / "campaign", CASES)
    command = [sys.executable, "-m", "mc_engine", "run", str(campaign), "--out", str(folder / "run"), "--no-report"]
    process = subprocess.Popen(
        [*command, "--workers", "2", "--backend", backend],
        env={**ENVIRONMENT, "STONES_SLEEP_S": f"{sleep_s}", "STONES_ASLEEP": str(folder / "asleep")},
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    deadline = time.monotonic() + 120.0
    while not list(folder.glob(awaited)):
        if process.poll() is not None or time.monotonic() > deadline:
            process.kill()
            raise AssertionError(process.communicate()[1])
        time.sleep(0.05)
    return process


def family(process):
    """The process and all that it began."""
    return [psutil.Process(process.pid), *psutil.Process(process.pid).children(recursive=True)]


def end(process):
    """What the process says on stderr; it must come to its end by itself."""
    try:
        return process.communicate(timeout=90.0)[1]
    finally:
        process.kill()


def assert_gone(processes):
    _, alive = psutil.wait_procs(processes[1:], timeout=GONE_WITHIN_S)
    assert [process for process in alive if process.status() != psutil.STATUS_ZOMBIE] == []


# A terminal's Ctrl-C goes to the whole group, a batch system's SIGTERM often to the first process alone.
@pytest.mark.parametrize(
    ("backend", "send"),
    [
        ("loky", lambda process: os.killpg(process.pid, signal.SIGINT)),
        pytest.param("threading", lambda process: os.killpg(process.pid, signal.SIGTERM), marks=pytest.mark.slow),
        pytest.param("loky", lambda process: os.killpg(process.pid, signal.SIGTERM), marks=pytest.mark.slow),
        pytest.param("dask", lambda process: os.killpg(process.pid, signal.SIGINT), marks=pytest.mark.slow),
        pytest.param("dask", lambda process: os.kill(process.pid, signal.SIGTERM), marks=pytest.mark.slow),
    ],
)
def test_one_signal_lets_what_is_in_flight_land_and_says_how_to_go_on(tmp_path, backend, send, record_property):
    process = begin(tmp_path, backend, 1.0)
    processes = family(process)
    before = set((tmp_path / "run" / "cases").glob("part-*"))
    send(process)
    begun = time.monotonic()
    errors = end(process)
    record_property("seconds to land", time.monotonic() - begun)
    assert process.returncode == 4, errors
    option = "" if backend == "threading" else f" --backend {backend}"
    assert f"`mc-engine resume {tmp_path / 'run'}{option}` flies the rest" in errors
    assert "Traceback" not in errors
    assert_gone(processes)
    store = open_store(tmp_path / "run")
    assert store.missing()
    assert len(store.parts) > len(before)
    assert damage(store.path) == []
    whole = runner.resume(tmp_path / "run")
    assert whole.status_counts() == {"ok": CASES}


@pytest.mark.parametrize(
    "backend", ["loky", *(pytest.param(name, marks=pytest.mark.slow) for name in ("threading", "dask"))]
)
def test_the_second_signal_ends_at_once(tmp_path, backend, record_property):
    process = begin(tmp_path, backend, 12.0, awaited="asleep")
    processes = family(process)
    process.send_signal(signal.SIGINT)
    time.sleep(1.0)
    assert process.poll() is None
    begun = time.monotonic()
    process.send_signal(signal.SIGINT)
    errors = end(process)
    assert process.returncode == 4, errors
    record_property("seconds to the end", took := time.monotonic() - begun)
    assert "Traceback" not in errors
    assert f"`mc-engine resume {tmp_path / 'run'}" in errors
    assert took < 9.0  # the flights under way would take longer
    assert_gone(processes)
    assert open_store(tmp_path / "run").missing()


# The command line, which says when it has begun to hear; before that Python itself begins, which does not.
LISTENING = """
import sys
from mc_engine.interruption import install_handlers
install_handlers()
print("listening", flush=True)
from mc_engine.__main__ import main
sys.argv[0] = "mc-engine"
main()
"""


def whole_run(folder, signal_after_s=None, number=signal.SIGTERM):
    """(exit status, last words, seconds from the signal on, where one is sent) of a run with its reports."""
    shutil.rmtree(folder / "run", ignore_errors=True)
    words = ["run", str(folder / "campaign"), "--out", str(folder / "run")]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    process = subprocess.Popen([sys.executable, "-c", LISTENING, *words], env=ENVIRONMENT, **pipes)
    assert process.stdout.readline() == "listening\n"
    if signal_after_s is not None:
        time.sleep(signal_after_s)
        process.send_signal(number)
    begun = time.monotonic()
    said = end(process).splitlines()
    return process.returncode, said[-1] if said else "", time.monotonic() - begun


@pytest.mark.parametrize("count", [3, pytest.param(100, marks=pytest.mark.slow)])
def test_a_signal_at_any_time_of_a_run_ends_it_with_the_command_that_goes_on(tmp_path, count, record_property):
    campaign_folder(tmp_path / "campaign", CASES)
    whole_run(tmp_path)  # also compiles
    run, (status, _, whole_s) = tmp_path / "run", whole_run(tmp_path)
    assert status == 0
    rng, outcomes, longest = np.random.default_rng(1), Counter(), 0.0
    for i in range(count):
        after_s = (i + rng.uniform()) / count * whole_s
        status, said, took = whole_run(tmp_path, after_s, (signal.SIGINT, signal.SIGTERM)[i % 2])
        if status == 0:  # it was done before
            outcomes["were done before"] += 1
            assert (run / "report.pdf").exists()
            continue
        assert status == 4, (after_s, said)
        longest = max(longest, took)
        assert not list(run.glob(".report*"))
        begun = (run / "journal.jsonl").exists()
        verb = said.split("`mc-engine ")[1].split()[0] if begun else "run"
        assert said.startswith("interrupted")
        assert f"`mc-engine {verb} {run}`" in said if begun else "nothing was begun" in said
        outcomes[f"were told to {verb}"] += 1
    for words, times in sorted(outcomes.items()):
        record_property(words, times)
    record_property("seconds to the end at most", longest)


@pytest.mark.parametrize("backend", ["loky", pytest.param("dask", marks=pytest.mark.slow)])
def test_no_worker_outlives_a_killed_run(tmp_path, backend, record_property):
    process = begin(tmp_path, backend, 1.0)
    processes = family(process)
    assert len(processes) > 2
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stderr.close()
    begun = time.monotonic()
    assert_gone(processes)
    record_property("workers", len(processes) - 1)
    record_property("seconds till all were gone", time.monotonic() - begun)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="elsewhere processes have no guard")
@pytest.mark.parametrize(
    ("kind", "backend"), [("function", "threading"), ("program", "threading"), ("program", "loky")]
)
def test_a_job_that_is_ended_records_no_case_as_crashed(tmp_path, kind, backend):
    """SIGTERM to all processes of a job, as systemd and SLURM send it: the engine has it some instants after cases."""
    starts = tmp_path / "starts"
    file = noting_campaign(kind, tmp_path / "ball", 40, 0.1, starts)
    words = ["run", file, "--out", tmp_path / "run", "--no-report", "--workers", "2", "--backend", backend]
    engine = subprocess.Popen([sys.executable, "-m", "mc_engine", *words], stdout=subprocess.DEVNULL)
    end = time.monotonic() + 60.0
    while time.monotonic() < end and not (starts.exists() and starts.read_text().count("\n") > 8):
        time.sleep(0.01)
    for process in psutil.Process(engine.pid).children(recursive=True)[::-1]:  # the youngest first
        with suppress(psutil.NoSuchProcess):
            process.terminate()
    time.sleep(0.3)
    engine.terminate()
    assert engine.wait(30.0) == 4
    assert set(resume(tmp_path / "run", workers=2).cases()["status"]) == {"ok"}
