"""Several processes on one run directory at the same moment: one flies, the others are refused within a second."""

import json
import os
import shutil
import subprocess
import sys
import threading
from contextlib import contextmanager

import numpy as np
import pytest
from killed_runs import FORKING
from stones import assert_as_unbroken, results, stones

from mc_engine import open_store
from mc_engine.runner import runner

CASES, CHUNK = 400, 40
LONG = 1600
WITHOUT_LOCKS = """
import errno, fcntl

def refuse(*_):
    raise OSError(errno.ENOLCK, "No locks available")

fcntl.flock = fcntl.lockf = refuse
"""

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the racers are forked, which Windows cannot")

# Each racer is a fork that waits for its moment; it says what became of it, and how long that took.  Who writes does
# not finish before the others have come, however fast it flies: at its first chunk it waits for what becomes of them.
SERVER = """
import json, mmap, os, sys, time
from pathlib import Path
import numpy as np
from mc_engine import load_campaign
from mc_engine.runner import runner
from mc_engine.flight.chunks import fly_cases
from mc_engine.errors import EngineError

campaign, chunk = load_campaign(Path(sys.argv[1]) / "campaign.toml"), int(sys.argv[2])
fly_cases(campaign, np.array([-1]))
print(json.dumps("ready"), flush=True)
for line in sys.stdin:
    verb, run, moments = json.loads(line)
    start, racers, ended = time.monotonic() + 0.05, [], mmap.mmap(-1, len(moments))

    def wait_for_the_others(*_):
        late = time.monotonic() + 10.0
        while sum(ended[:]) < len(moments) - 1 and time.monotonic() < late:
            time.sleep(0.005)

    for number, moment in enumerate(moments):
        reading, writing = os.pipe()
        if os.fork() == 0:
            while time.monotonic() < start + moment:
                pass
            begin, said = time.monotonic(), ""
            try:
                if verb == "run":
                    runner.run(campaign, Path(run), workers=2, chunk=chunk, progress=wait_for_the_others)
                else:
                    repair = verb == "repair"
                    runner.resume(run, workers=2, chunk=chunk, progress=wait_for_the_others, repair=repair)
            except EngineError as error:
                said = str(error)
            except BaseException as error:
                said = repr(error)
            ended[number] = 1
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
    def __init__(self, folder, before=""):
        """before : source that the racers and all that they start run first."""
        command = [sys.executable, "-c", SERVER, str(folder), str(CHUNK)]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        (folder / "sitecustomize.py").write_text(before)
        path = os.pathsep.join([str(folder), FORKING["PYTHONPATH"]])
        self._server = subprocess.Popen(command, env={**FORKING, "PYTHONPATH": path}, **pipes)
        assert json.loads(self._server.stdout.readline()) == "ready"

    def __call__(self, verb, run, moments):
        """What each racer was told (nothing: it flew) and after how long [s].  moments : when each begins [s]."""
        self._server.stdin.write(json.dumps([verb, str(run), moments]) + "\n")
        self._server.stdin.flush()
        return json.loads(self._server.stdout.readline())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self._server.stdin.close()
        self._server.stdout.close()
        self._server.wait(timeout=30.0)


def check_races(folder, count, seed, before=""):
    """So many races; how long the refused ones waited [s]."""
    campaign = stones(folder / "campaign", CASES)
    whole = results(runner.run(campaign, folder / "whole", workers=2, chunk=CHUNK).path)
    races, rng, waited = Races(folder / "campaign", before), np.random.default_rng(seed), []
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


@pytest.mark.parametrize("count", [5, pytest.param(100, marks=pytest.mark.slow)])
def test_of_two_runs_in_one_directory_one_is_refused_and_the_other_is_whole(tmp_path, count, record_property):
    waited = check_races(tmp_path, count, seed=1)
    record_property("races", len(waited))
    record_property("seconds till the second was refused", waited)
    assert max(waited) < 1.0


@pytest.fixture(scope="module")
def long_run(tmp_path_factory):
    """The folder of a campaign, its unbroken run of forty parts, and the bytes of that."""
    folder = tmp_path_factory.mktemp("long")
    whole = runner.run(stones(folder / "campaign", LONG), folder / "whole", workers=2, chunk=CHUNK).path
    return folder / "campaign", whole, results(whole)


def test_two_that_resume_one_run_do_not_both_write(long_run, tmp_path):
    campaign, whole, expected = long_run
    run = interrupted(whole, tmp_path / "run")
    with Races(campaign) as races:
        outcomes = races("resume", run, [0.0, 0.0])
    refused = [said for said, _ in outcomes if said]
    assert len(refused) == 1, outcomes
    assert "is writing here" in refused[0]
    assert_as_unbroken(run, expected)


def interrupted(whole, run, damaged=False):
    """A copy of a run as a kill leaves it that came before the first part: the lock has the record of a dead process.

    damaged : a bit of a line of the journal is flipped, too.
    """
    shutil.copytree(whole, run)
    lines = (run / "journal.jsonl").read_bytes().splitlines(keepends=True)
    begun = next(number for number, line in enumerate(lines) if b'"event":"part"' in line)
    content = bytearray(b"".join(lines[:begun]))
    if damaged:
        content[len(lines[0]) + 20] ^= 1
    (run / "journal.jsonl").write_bytes(content)
    for part in [*(run / "cases").iterdir(), *(run / "history").iterdir()]:
        part.unlink()
    gone = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, check=True)
    (run / ".lock").write_text(json.dumps({"pid": int(gone.stdout), "host": os.uname().nodename, "since": "then"}))
    return run


def check_three_at_once(long_run, folder, count, before="", meanwhile=None):
    """Three racers of each kind, so many times; what the refused ones were told.

    meanwhile : what happens to the directory of a resumed run while they race.
    """
    (campaign, whole, expected), told = long_run, []
    with Races(campaign, before) as races:
        for number in range(count):
            for verb in ("resume",) if meanwhile else ("run", "resume", "repair"):
                run = folder / f"{verb}-{number}"
                if verb != "run":
                    interrupted(whole, run, damaged=verb == "repair")
                with happening(meanwhile, run):
                    outcomes = races(verb, run, [0.0, 0.25, 0.5] if meanwhile else [0.0, 0.0, 0.0])
                refused = [said for said, _ in outcomes if said]
                told += refused
                assert len(refused) == 2, outcomes
                assert all(str(run) in said for said in refused), refused
                assert_as_unbroken(run, expected)
                assert not (run / ".lock.claim").exists()
                assert len(open_store(run).notes("finished")) == 1
                shutil.rmtree(run)
    return told


@contextmanager
def happening(what, run):
    """Has something done to a run again and again, as long as the block lasts."""
    done = threading.Event()
    thread = threading.Thread(target=lambda: [what(run) for _ in iter(lambda: what and done.wait(0.01), True)])
    if what:
        thread.start()
    try:
        yield
    finally:
        done.set()
        if what:
            thread.join()


def delete_lock(run):
    (run / ".lock").unlink(missing_ok=True)


SOME = [1, pytest.param(20, marks=pytest.mark.slow)]


@pytest.mark.parametrize("count", SOME)
def test_of_three_at_once_one_writes_without_locks_of_the_system(long_run, tmp_path, count, record_property):
    told = check_three_at_once(long_run, tmp_path, count, WITHOUT_LOCKS)
    record_property("racers refused", len(told))
    words = ("is writing here", "is about to begin here", "holds a run already")
    assert all(any(word in said for word in words) for said in told), told


@pytest.mark.parametrize("count", SOME)
def test_a_lock_deleted_in_flight_lets_nobody_in(long_run, tmp_path, count, record_property):
    told = check_three_at_once(long_run, tmp_path, count, meanwhile=delete_lock)
    record_property("racers refused", len(told))
    assert all("is writing here" in said for said in told), told
