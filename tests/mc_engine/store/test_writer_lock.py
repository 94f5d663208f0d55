import errno
import json
import os
import subprocess
import sys
import time

import pytest
from small_run import block

from mc_engine import load_campaign
from mc_engine.errors import StoreError
from mc_engine.store.opening import open_store
from mc_engine.store.store import refuse_occupied
from mc_engine.store.verification import damage
from mc_engine.store.writer_lock import WriterLock, described, holder, writer_of_new
from mc_engine.studies.rare_event import estimate_rare_event
from mc_engine.studies.tuning import tune
from tests.mc_engine.studies.apogee_tuning import apogee_campaign


def test_a_second_writer_is_refused_within_a_second_and_told_who_is_first(store):
    with store.lock():
        waited = []
        for _ in range(3):  # other work on the machine may hold one of them up
            begin = time.monotonic()
            with pytest.raises(StoreError, match=rf"{store.path}: process {os.getpid()} on .* is writing here"):
                open_store(store.path).append(0, 10, block(0, 10))
            waited.append(time.monotonic() - begin)
        assert min(waited) < 1.0
        assert holder(store.path)["pid"] == os.getpid()
    assert holder(store.path) is None
    open_store(store.path).append(0, 10, block(0, 10))


def test_a_writer_sees_what_another_committed_since_it_opened(store):
    other = open_store(store.path)
    store.append(0, 10, block(0, 10))
    with pytest.raises(StoreError, match="committed already"):
        other.append(5, 10, block(5, 10))
    other.append(10, 10, block(10, 10))
    assert open_store(store.path).committed() == [(0, 20)]


@pytest.fixture
def no_locks(monkeypatch):
    """A file system without locks."""

    def unsupported(*_):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr("fcntl.flock", unsupported)


def leave_record(store, **facts):
    """The record of a process that is over, as its kill leaves it."""
    gone = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, check=True)
    record = {"pid": int(gone.stdout), "host": os.uname().nodename, "since": "then", **facts}
    (store.path / ".lock").write_text(json.dumps(record))
    return record


@pytest.mark.usefixtures("no_locks")
def test_without_system_locks_a_living_holder_is_respected_and_a_dead_one_replaced(store):
    with store.lock(), pytest.raises(StoreError, match="is writing here"):
        open_store(store.path).note("x")
    record = leave_record(store)
    store.note("x")
    assert store.notes("lock-taken-over")[0].facts["from"] == record
    leave_record(store, pid=os.getpid(), start=1)  # the number was given to another process since
    store.note("x")
    assert len(store.notes("lock-taken-over")) == 2


@pytest.mark.usefixtures("no_locks")
def test_without_system_locks_a_holder_out_of_sight_is_respected_until_its_file_is_deleted(store):
    leave_record(store, host="another")
    with pytest.raises(StoreError, match=rf"on another \(since then\) .* delete {store.path / '.lock'}"):
        store.note("x")
    (store.path / ".lock").unlink()
    store.note("x")


@pytest.mark.usefixtures("no_locks")
def test_without_system_locks_of_two_that_find_a_dead_holder_one_takes_over(store, monkeypatch):
    leave_record(store)
    kill, second = os.kill, WriterLock(store.path)

    def late(pid, number):
        monkeypatch.setattr(os, "kill", kill)
        with pytest.raises(StoreError, match=r"delete .*\.lock\.claim"):
            second.acquire()  # while the first has judged, and not yet written
        kill(pid, number)

    monkeypatch.setattr(os, "kill", late)
    store.note("x")
    assert not (store.path / ".lock.claim").exists()
    assert second.acquire() is None


def test_without_system_locks_a_lock_file_that_its_maker_removes_at_that_moment_is_made_anew(store, monkeypatch):
    def unsupported(*_):
        (store.path / ".lock").unlink(missing_ok=True)
        raise OSError(errno.ENOLCK, "No locks available")

    with monkeypatch.context() as patched:
        patched.setattr("fcntl.flock", unsupported)
        lock = store.lock()
        lock.__enter__()
    with pytest.raises(StoreError, match="is writing here"):
        open_store(store.path).note("x")
    lock.__exit__(None, None, None)


def test_a_writer_without_system_locks_whose_lock_is_deleted_writes_nothing_more(store, no_locks):
    other = open_store(store.path)
    with store.lock():
        store.append(0, 10, block(0, 10))
        (store.path / ".lock").unlink()
        with other.lock():
            before = (store.path / "journal.jsonl").read_bytes()
            for write in (lambda: store.append(10, 10, block(10, 10)), store.sweep, lambda: store.note("x")):
                with pytest.raises(StoreError, match=r"its \.lock was deleted or taken over.*; it has stopped"):
                    write()
            assert (store.path / "journal.jsonl").read_bytes() == before
            other.append(10, 10, block(10, 10))
    assert damage(store.path) == []
    assert open_store(store.path).committed() == [(0, 20)]


def test_a_writer_that_has_lost_its_lock_leaves_the_record_of_the_next_one(store, no_locks, monkeypatch):
    monkeypatch.setattr("mc_engine.store.writer_lock.utc_now", lambda: "2026-01-01T00:00:00Z")  # within one instant
    lost = store.lock()
    lost.__enter__()
    (store.path / ".lock").unlink()
    with open_store(store.path).lock():
        record = (store.path / ".lock").read_bytes()
        lost.__exit__(None, None, None)
        assert (store.path / ".lock").read_bytes() == record != b""


def test_a_living_writer_that_had_no_system_locks_is_respected_by_one_that_has_them(store):
    leave_record(store, pid=os.getppid(), locks=False)
    with pytest.raises(StoreError, match=rf"process {os.getppid()} on .* is writing here"):
        open_store(store.path).append(0, 10, block(0, 10))


def test_a_lock_file_deleted_or_made_anew_in_flight_lets_nobody_in(store):
    with store.lock():
        for make in (lambda: None, (store.path / ".lock").touch):
            (store.path / ".lock").unlink(missing_ok=True)
            make()
            with pytest.raises(StoreError, match="another writer is writing here"):
                open_store(store.path).note("x")
            assert holder(store.path) == {}
        store.append(0, 10, block(0, 10))
    assert holder(store.path) is None
    assert damage(store.path) == []


def test_a_journal_that_grew_under_a_writer_is_left_as_it_is(store):
    with store.lock():
        store.note("x")
        with open(store.path / "journal.jsonl", "ab") as file:
            file.write(b"?")
        with pytest.raises(StoreError, match="another process has written here"):
            store.note("y")
    assert (store.path / "journal.jsonl").read_bytes().endswith(b"}\n?")


def test_a_tuning_and_a_rare_event_have_one_writer(tmp_path):
    searches = [
        lambda: tune(apogee_campaign(), tmp_path, generations=1, workers=1),
        lambda: estimate_rare_event(load_campaign("minimal"), out=tmp_path, cases_per_level=100, workers=1),
    ]
    with writer_of_new(tmp_path, lambda: None):
        for search in searches:
            with pytest.raises(StoreError, match="is writing here"):
                search()


def test_a_new_directory_has_one_writer_and_is_gone_if_nothing_was_put_there(tmp_path):
    asked = []

    def refuse():
        asked.append((tmp_path / "new" / ".lock").exists())
        refuse_occupied(tmp_path / "new")

    def write(inside):
        with writer_of_new(tmp_path / "new", refuse):
            assert asked[-2:] == [False, True]  # again with the lock: another may have been faster
            inside()

    def second():
        with pytest.raises(StoreError, match=rf"process {os.getpid()} on .* is writing here"):
            write(lambda: pytest.fail("two writers"))
        raise KeyError

    with pytest.raises(KeyError):
        write(second)
    assert not (tmp_path / "new").exists()


def test_a_record_of_somebody_elses_making_cannot_steer_the_terminal():
    text = described({"pid": 1, "host": "a\n\x1b[31mforged", "since": "x" * 4096})
    assert text.isprintable()
    assert len(text) < 300
