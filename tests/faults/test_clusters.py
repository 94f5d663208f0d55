"""Clusters whose workers leave, die beside each other, or never come: the run goes on, or ends and can be resumed."""

import json
import signal
import subprocess
import sys
import time

import dask
import pytest
from distributed import LocalCluster
from trapped import ENVIRONMENT, campaign_folder, files_of, trapped

from mc_engine.errors import RunInterrupted
from mc_engine.runner import runner
from mc_engine.runner.backends import Backend
from mc_engine.runner.dispatch import DRAIN_S

CASES, CHUNK = 400, 50
PATIENCE_S = 2.0
LONGEST_S = 120.0


@pytest.fixture
def cluster(monkeypatch):
    """A cluster of one worker that somebody else began."""
    monkeypatch.setenv("STONES_SLEEP_S", "0.3")  # in its workers
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0") as cluster:
        yield cluster


def after(parts, do):
    """A progress call that does something once so many parts have landed."""
    told = []

    def progress(done, total, failed):
        told.append(done)
        if len(told) == parts + 1:
            do()

    return progress


@pytest.mark.parametrize(
    ("leave", "words"),
    [
        (lambda cluster: cluster.scale(0), "the scheduler has had no worker for 2 s .--patience waits longer."),
        (lambda cluster: cluster.close(), "the scheduler .*gone"),
    ],
)
def test_a_run_whose_workers_all_leave_ends_and_can_be_resumed(cluster, tmp_path, leave, words):
    campaign = trapped(tmp_path / "campaign", CASES)
    backend = Backend("dask", cluster.scheduler_address, patience_s=PATIENCE_S)
    progress = after(2, lambda: leave(cluster))
    begin = time.monotonic()
    again = f"`mc-engine resume {tmp_path / 'run'} --backend dask --scheduler {cluster.scheduler_address} --patience 2`"
    with pytest.raises(RunInterrupted, match=words) as caught:
        runner.run(campaign, tmp_path / "run", chunk=CHUNK, backend=backend, progress=progress)
    assert f"cases are safe, {again} flies the rest" in str(caught.value)
    assert time.monotonic() - begin < LONGEST_S
    whole = runner.run(campaign, tmp_path / "whole", chunk=CHUNK)
    assert files_of(runner.resume(tmp_path / "run").path) == files_of(whole.path)


def waiting(folder, address, *options):
    """A run on the command line whose scheduler has no worker."""
    campaign_folder(folder / "campaign", CASES)
    words = ["run", folder / "campaign", "--out", folder / "run", "--no-report", "--backend", "dask", *options]
    command = [sys.executable, "-m", "mc_engine", *map(str, words), "--scheduler", address]
    process = subprocess.Popen(command, env=ENVIRONMENT, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + LONGEST_S
    journal = folder / "run" / "journal.jsonl"
    while not journal.exists() or '"started"' not in journal.read_text():
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return process


def ended(process, within_s):
    """What it says on stderr, when it has come to its end by itself with exit status 4."""
    begin = time.monotonic()
    try:
        errors = process.communicate(timeout=LONGEST_S)[1]
    finally:
        process.kill()
    assert process.returncode == 4, errors
    assert "Traceback" not in errors
    assert time.monotonic() - begin < within_s
    return errors


def test_a_scheduler_that_is_killed_is_told_in_one_sentence(tmp_path):
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
    file = tmp_path / "scheduler.json"
    scheduler = subprocess.Popen(
        [*command, "--no-dashboard", "--scheduler-file", str(file)], stderr=subprocess.DEVNULL, env=ENVIRONMENT
    )
    try:
        deadline = time.monotonic() + LONGEST_S
        while not file.exists() or not file.read_text():
            assert time.monotonic() < deadline
            time.sleep(0.05)
        process = waiting(tmp_path, json.loads(file.read_text())["address"])
        time.sleep(3.0)  # its task lies with the scheduler
    finally:
        scheduler.kill()
        scheduler.wait()
    *_, told = lines = ended(process, 60.0).splitlines()
    assert "the scheduler" in told
    assert "flies the rest" in told
    assert len(lines) <= 3  # the others are of the preparation


def test_one_signal_ends_a_run_that_has_no_worker(tmp_path):
    with LocalCluster(n_workers=0, dashboard_address="127.0.0.1:0") as cluster:
        process = waiting(tmp_path, cluster.scheduler_address)
        time.sleep(3.0)  # its task lies with the scheduler
        process.send_signal(signal.SIGTERM)
        errors = ended(process, DRAIN_S + 20.0)
    again = f"`mc-engine resume {tmp_path / 'run'} --backend dask --scheduler {cluster.scheduler_address}`"
    assert f"interrupted with 0 of 400 cases; {again} flies the rest" in errors
    assert runner.resume(tmp_path / "run").status_counts() == {"ok": CASES}


def test_signals_end_a_run_on_our_own_cluster_while_its_workers_die(tmp_path):
    """Every case kills its worker: most of the time there is none."""
    campaign_folder(tmp_path / "campaign", CASES, dict.fromkeys(range(CASES), 1))
    words = ["run", tmp_path / "campaign", "--out", tmp_path / "run", "--no-report", "--backend", "dask"]
    command = [sys.executable, "-m", "mc_engine", *map(str, words), "--workers", "1"]
    process = subprocess.Popen(command, env=ENVIRONMENT, stderr=subprocess.PIPE, text=True)
    while not list((tmp_path / "run").glob("cases/.in_flight-*")):
        assert process.poll() is None, process.communicate()[1]
        time.sleep(0.02)
    process.send_signal(signal.SIGTERM)
    assert "flies the rest" in ended(process, DRAIN_S + 30.0)


@pytest.mark.slow
def test_killers_on_workers_with_two_threads_are_found_and_their_neighbours_are_not_blamed(tmp_path):
    killers = [7, 8, 90]
    campaign = trapped(tmp_path / "campaign", 200, dict.fromkeys(killers, 1))
    kept = {"distributed.scheduler.allowed-failures": 0, "distributed.deploy.lost-worker-timeout": "1 hour"}
    with (
        dask.config.set(kept),
        LocalCluster(n_workers=1, threads_per_worker=2, dashboard_address="127.0.0.1:0", silence_logs=50) as cluster,
    ):
        run = runner.run(campaign, tmp_path / "run", backend=Backend("dask", cluster.scheduler_address))
    frame = run.cases()
    assert list(frame["case_id"][frame["status"] == "worker-died"]) == killers
    assert run.status_counts() == {"ok": 197, "worker-died": 3}
