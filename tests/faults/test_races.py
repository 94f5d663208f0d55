"""Two processes on one run directory at the same moment: one flies, the other is refused within a second."""

import json
import subprocess
import sys

import numpy as np
import pytest
from killed_runs import FORKING
from stones import assert_as_unbroken, results, stones

from mc_engine import open_store, runner

CASES, CHUNK = 400, 40
LONG = 4000  # cases: no racer is done before the other has begun

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the racers are forked, which Windows cannot")

# Each racer is a fork that waits for its moment; it says what became of it, and how long that took.
SERVER = """
import json, os, sys, time
from pathlib import Path
import broken_builds
from mc_engine import load_campaign, runner
from mc_engine.chunks import fly_nominal
from mc_engine.errors import EngineError

if len(sys.argv) > 3:
    broken_builds.BREAKS[sys.argv[3]](setattr)
campaign, chunk = load_campaign(Path(sys.argv[1]) / "campaign.toml"), int(sys.argv[2])
fly_nominal(campaign)
print(json.dumps("ready"), flush=True)
for line in sys.stdin:
    verb, run, moments = json.loads(line)
    start, racers = time.monotonic() + 0.05, []
    for moment in moments:
        reading, writing = os.pipe()
        if os.fork() == 0:
            while time.monotonic() < start + moment:
                pass
            begin, said = time.monotonic(), ""
            try:
                if verb == "run":
                    runner.run(campaign, Path(run), workers=2, chunk=chunk)
                else:
                    runner.resume(run, workers=2, chunk=chunk)
            except EngineError as error:
                said = str(error)
            os.write(writing, json.dumps([said, time.monotonic() - begin]).encode())
            os._exit(0)
        os.close(writing)
        racers.append(reading)
    outcomes = [os.read(reading, 65536).decode() for reading in racers]
    for reading in racers:
        os.close(reading)
        os.wait()
    print(json.dumps([json.loads(outcome) for outcome in outcomes]), flush=True)
"""


class Races:
    def __init__(self, folder, broken=()):
        command = [sys.executable, "-c", SERVER, str(folder), str(CHUNK), *broken]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self._server = subprocess.Popen(command, env=FORKING, **pipes)
        assert json.loads(self._server.stdout.readline()) == "ready"

    def __call__(self, verb, run, moments):
        """What each racer was told (nothing: it flew) and after how long [s].  moments : when each begins [s]."""
        self._server.stdin.write(json.dumps([verb, str(run), moments]) + "\n")
        self._server.stdin.flush()
        return json.loads(self._server.stdout.readline())

    def close(self):
        self._server.stdin.close()
        self._server.stdout.close()
        self._server.wait(timeout=30.0)


def check_races(folder, count, seed, broken=()):
    """So many races; how long the refused ones waited [s]."""
    campaign = stones(folder / "campaign", CASES)
    whole = results(runner.run(campaign, folder / "whole", workers=2, chunk=CHUNK).path)
    races, rng, waited = Races(folder / "campaign", broken), np.random.default_rng(seed), []
    try:
        for number in range(count):
            run = folder / f"run-{number}"
            outcomes = races("run", run, [0.0, float(rng.choice([0.0, rng.uniform(0.0, 0.1)]))])
            refused = [(said, seconds) for said, seconds in outcomes if said]
            assert len(refused) == 1, outcomes
            assert str(run) in refused[0][0]
            assert_as_unbroken(run, whole)
            assert len(open_store(run).notes("finished")) == 1
            waited.append(refused[0][1])
    finally:
        races.close()
    return waited


def test_of_two_runs_in_one_directory_one_is_refused_and_the_other_is_whole(tmp_path, record_property):
    waited = check_races(tmp_path, 5, seed=1)
    record_property("races", len(waited))
    record_property("seconds till the second was refused", waited)
    assert max(waited) < 1.0


@pytest.mark.slow
def test_a_hundred_races_corrupt_nothing(tmp_path, record_property):
    waited = check_races(tmp_path, 100, seed=2)
    record_property("races", len(waited))
    record_property("seconds till the second was refused", waited)
    assert max(waited) < 1.0


def test_two_that_resume_one_run_do_not_both_write(tmp_path):
    campaign = stones(tmp_path / "campaign", LONG)
    whole = runner.run(campaign, tmp_path / "whole", workers=2, chunk=CHUNK)
    expected, races = results(whole.path), Races(tmp_path / "campaign")
    try:
        for part in list(whole.parts):
            whole.withdraw(part)
        outcomes = races("resume", whole.path, [0.0, 0.0])
    finally:
        races.close()
    refused = [said for said, _ in outcomes if said]
    assert len(refused) == 1, outcomes
    assert "is writing here" in refused[0]
    assert_as_unbroken(whole.path, expected)
