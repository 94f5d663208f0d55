import json
import os
import subprocess
import sys
import time

import pytest
from small_run import ENVIRONMENT, block

from mc_engine.errors import StoreError
from mc_engine.store import open_store
from mc_engine.writer_lock import WriterLock, described, holder


def test_a_second_writer_is_refused_within_a_second_and_told_who_is_first(store):
    with store.lock():
        begin = time.monotonic()
        with pytest.raises(StoreError, match=rf"{store.path}: process {os.getpid()} on .* is writing here"):
            open_store(store.path).append(0, 10, block(0, 10))
        assert time.monotonic() - begin < 1.0
        assert holder(store.path)["pid"] == os.getpid()
    assert holder(store.path) is None
    open_store(store.path).append(0, 10, block(0, 10))


def test_a_lock_given_back_leaves_no_note(store):
    store.append(0, 10, block(0, 10))
    store.append(10, 10, block(10, 10))
    assert store.notes("lock-taken-over") == []


def test_the_lock_may_be_taken_inside_itself(store):
    with store.lock(), store.lock():
        store.append(0, 10, block(0, 10))
        assert holder(store.path) is not None
    assert holder(store.path) is None


def test_a_writer_sees_what_another_committed_since_it_opened(store):
    other = open_store(store.path)
    store.append(0, 10, block(0, 10))
    with pytest.raises(StoreError, match="committed already"):
        other.append(5, 10, block(5, 10))
    other.append(10, 10, block(10, 10))
    assert open_store(store.path).committed() == [(0, 20)]


def test_without_system_locks_a_living_holder_is_respected_and_a_dead_one_replaced(store, monkeypatch):
    def unsupported(_):
        raise OSError(38, "Function not implemented")

    monkeypatch.setattr("mc_engine.writer_lock._system_lock", unsupported)
    with store.lock(), pytest.raises(StoreError, match="is writing here"):
        open_store(store.path).note("x")
    gone = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, check=True)
    record = json.loads(json.dumps({"pid": int(gone.stdout), "host": os.uname().nodename, "since": "then"}))
    (store.path / ".lock").write_text(json.dumps(record))
    store.note("x")
    assert store.notes("lock-taken-over")[0].facts["from"] == record
    (store.path / ".lock").write_text(json.dumps({**record, "host": "another"}))
    with pytest.raises(StoreError, match=r"on another \(since then\)"):
        store.note("x")


def test_a_lock_record_of_garbage_is_no_obstacle(store):
    (store.path / ".lock").write_bytes(b"\xff{")
    store.note("x")
    assert store.notes("lock-taken-over")[0].facts["from"] == {}


RACE = """
import os
from small_run import ENVIRONMENT, block, created
from mc_engine.errors import StoreError
print("ready", flush=True)
while not os.path.exists({go!r}):
    pass
try:
    store = created({run!r})
    with store.lock():
        for first in range(0, 40, 10):
            store.append(first, 10, block(first, 10))
except StoreError as error:
    print(error)
"""


def test_two_runs_that_start_in_one_directory_at_one_moment_do_not_mix(tmp_path):
    for race in range(3):
        run = tmp_path / f"run-{race}"
        go = tmp_path / f"go-{race}"
        script = RACE.format(run=str(run), go=str(go))
        options = {"stdout": subprocess.PIPE, "text": True, "env": ENVIRONMENT}
        racers = [subprocess.Popen([sys.executable, "-c", script], **options) for _ in "ab"]
        assert [racer.stdout.readline() for racer in racers] == ["ready\n"] * 2
        go.touch()
        messages = [racer.communicate()[0] for racer in racers]
        assert [racer.returncode for racer in racers] == [0, 0]
        assert sum(bool(message) for message in messages) == 1, messages
        assert str(run) in "".join(messages)
        assert open_store(run).verify() == []
        assert len(open_store(run).cases()) == 40


def test_a_lock_is_empty_when_given_back_and_none_is_lost_by_releasing_twice(run):
    run.mkdir()
    lock = WriterLock(run)
    assert lock.acquire() is None
    assert json.loads((run / ".lock").read_text())["pid"] == os.getpid()
    lock.release()
    lock.release()
    assert (run / ".lock").read_bytes() == b""


def test_a_record_of_somebody_elses_making_cannot_steer_the_terminal():
    text = described({"pid": 1, "host": "a\n\x1b[31mforged", "since": "x" * 4096})
    assert text.isprintable()
    assert len(text) < 300
