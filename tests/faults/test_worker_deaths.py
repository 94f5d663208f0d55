"""Workers that die: killed from outside at any instant, by their own cases, by the clock or for want of memory."""

import os
import signal
import threading
import time

import numpy as np
import psutil
import pytest
from trapped import files_of, trapped

from mc_engine import runner
from mc_engine.backends import Backend

SLEEP_S = 0.2  # of every flight: a chunk takes long enough to be hit in the middle
CHUNK = 50


def loky_workers():
    """The worker processes of this process."""
    found = []
    for child in psutil.Process().children():
        try:
            if "popen_loky_posix" in " ".join(child.cmdline()):
                found.append(child)
        except psutil.NoSuchProcess:
            pass
    return found


class Killer:
    """Kills a worker of this process some time after a part has landed, so that the run goes on in between."""

    def __init__(self, seed, kills):
        self.left, self._rng, self._landed = kills, np.random.default_rng(seed), threading.Event()
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def _work(self):
        while self.left:
            self._landed.wait()
            self._landed.clear()
            time.sleep(self._rng.uniform(0.0, 2.0 * SLEEP_S))
            workers = loky_workers()
            os.kill(workers[self._rng.integers(len(workers))].pid, signal.SIGKILL)
            self.left -= 1

    def __call__(self, done, total, failed):
        if done:
            self._landed.set()


def killed_at_random(folder, monkeypatch, seed, kills, cases):
    """A run of two workers that are killed so many times."""
    monkeypatch.setenv("STONES_SLEEP_S", f"{SLEEP_S}")
    killer = Killer(seed, kills)
    campaign = trapped(folder / "campaign", cases)
    store = runner.run(campaign, folder / "run", workers=2, chunk=CHUNK, backend="loky", progress=killer)
    assert killer.left == 0
    return store


def check_kills(folder, monkeypatch, seed, kills, cases):
    store = killed_at_random(folder, monkeypatch, seed, kills, cases)
    monkeypatch.delenv("STONES_SLEEP_S")
    whole = runner.run(trapped(folder / "campaign", cases), folder / "whole", workers=2, chunk=CHUNK)
    assert files_of(store.path) == files_of(whole.path)
    assert store.verify() == []


def test_workers_killed_at_random_instants_lose_nothing_and_repeat_nothing(tmp_path, monkeypatch):
    check_kills(tmp_path, monkeypatch, seed=1, kills=5, cases=1500)


@pytest.mark.slow
def test_a_hundred_kills_of_workers_lose_nothing(tmp_path, monkeypatch):
    check_kills(tmp_path, monkeypatch, seed=2, kills=100, cases=30_000)


def check_isolated(folder, cases, killers):
    """All killers are found, with their inputs; all other rows are those of the same stones without traps."""
    run = runner.run(trapped(folder / "campaign", cases, dict.fromkeys(killers, 1)), folder / "run", workers=2,
                     backend="loky")  # fmt: skip
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
    assert run.verify() == []
    return run


def test_two_cases_that_kill_their_worker_are_isolated_and_fly_when_asked_again(tmp_path, monkeypatch):
    run = check_isolated(tmp_path, 1000, [7, 640])
    parts_before = files_of(run.path)
    monkeypatch.setenv("TRAPS_OFF", "1")
    again = runner.rerun(run.path, workers=1, backend="loky")
    assert again.status_counts() == {"ok": 1000}
    assert again.verify() == []
    frame = again.cases()
    plain = runner.open_store(tmp_path / "plain_run").cases()
    assert frame.drop(columns="trap").equals(plain.drop(columns="trap"))
    kept = {name for name, content in files_of(again.path).items() if parts_before.get(name) == content}
    assert len([name for name in kept if name.startswith("cases/")]) == len(again.parts) - 2
    runner.rerun(run.path, workers=1)  # nothing failed: nothing flies, nothing changes
    assert {name: content for name, content in files_of(again.path).items() if name.startswith("cases/")} == {
        f"cases/{path.name}": path.read_bytes() for path in (run.path / "cases").iterdir()
    }


@pytest.mark.slow
def test_ten_killing_cases_in_ten_thousand_are_isolated(tmp_path):
    killers = np.random.default_rng(3).choice(10_000, 10, replace=False)
    check_isolated(tmp_path, 10_000, [int(case) for case in killers])


def test_a_case_that_takes_too_long_and_one_that_eats_its_memory_are_given_up(tmp_path):
    campaign = trapped(tmp_path / "campaign", 200, {33: 2, 150: 3})
    backend = Backend("loky", case_seconds=3.0, memory_mib=2048)
    run = runner.run(campaign, tmp_path / "run", workers=2, backend=backend)
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


def test_a_thread_cannot_be_limited():
    from mc_engine.errors import EngineError

    with pytest.raises(EngineError, match="a thread cannot be limited in time or memory"):
        Backend("threading", case_seconds=1.0)
