import os
import shutil

import pandas as pd
import pytest
from small_run import COLUMNS, MANIFEST, TEXT, block, created, filled, row

from mc_engine.errors import DiskError, StoreError
from mc_engine.store import journal
from mc_engine.store.opening import open_store
from mc_engine.store.parts import revised_name, write_aside
from mc_engine.store.store import create_store
from mc_engine.store.verification import damage


def fail_at(monkeypatch, n, target):
    """Make the n-th call of os.<target> fail with a full disk; the list returned has an item once it did."""
    genuine = getattr(os, target)
    calls, failed = iter(range(10**6)), []

    def failing(*arguments, **options):
        if next(calls) == n:
            failed.append(n)
            raise OSError(28, "No space left on device")
        return genuine(*arguments, **options)

    monkeypatch.setattr(os, target, failing)
    return failed


@pytest.mark.parametrize("target", ["fsync", "replace", "write"])
def test_whichever_system_call_fails_the_error_names_a_path_and_the_run_can_go_on(tmp_path, monkeypatch, target):
    for n in range(100):
        run = create_store(tmp_path / f"run-{n}", MANIFEST, TEXT, COLUMNS).path
        with monkeypatch.context() as patch:
            failed = fail_at(patch, n, target)
            message = ""
            try:
                filled(open_store(run))
            except StoreError as error:
                message = str(error)
        assert bool(message) == bool(failed)
        assert not failed or (str(run) in message and "No space left" in message)
        store = open_store(run)
        for first, stop in store.missing():
            store.append(first, stop - first, block(first, stop - first))
        assert damage(store.path) == []
        assert store.cases()["ve_pct"].tolist() == block(0, 40)["ve_pct"].tolist()
        assert len(pd.read_parquet(run / "cases")) == 40
        if not failed:
            break
    assert not failed
    assert n >= 4  # at least once a part


def worker_writes(store, first=20, file=None, count=10):
    return write_aside(store.path, store.columns, first, count, block(first, count), file)


def replaced(store):
    with store.lock():
        before = store.parts[0]
        store.replace(before, worker_writes(store, 0, revised_name(before.file)))


WRITERS = {
    "append": lambda store: store.append(20, 10, block(20, 10)),
    "replace": replaced,
    "withdraw": lambda store: store.withdraw(store.parts[0]),
    "nominal": lambda store: store.write_nominal(row(8)),
    "histories": lambda store: store.write_histories({"case_id": [4], "t_s": [0.0], "force_n": [2.0]}),
}


def contents(run):
    """What a reader finds: names of the files with their contents."""
    parts = open_store(run)._counted.all_parts()
    return {part.file: (run / part.file).read_bytes() for part in parts}


def killed_in(monkeypatch, n, write, *what):
    """Run `write` in a process that is killed at its n-th call of the disk; True if it came that far."""
    dead = []
    with monkeypatch.context() as patch:
        calls = iter(range(10**6))

        def dying(genuine):
            def call(*arguments, **options):
                if dead or next(calls) == n:
                    dead.append(n)
                    raise KeyboardInterrupt
                return genuine(*arguments, **options)

            return call

        for name in ("write", "fsync", "replace", "unlink", "ftruncate"):
            patch.setattr(os, name, dying(getattr(os, name)))
        try:
            write(*what)
        except KeyboardInterrupt:
            pass
    return bool(dead)


@pytest.fixture
def begun(tmp_path):
    """A run with two parts, a nominal case and a history."""
    store = created(tmp_path / "begun")
    for first in (0, 10):
        store.append(first, 10, block(first, 10))
    store.write_nominal(row(7))
    store.write_histories({"case_id": [3], "t_s": [0.0], "force_n": [1.0]})
    return store.path


@pytest.mark.parametrize("writer", WRITERS)
def test_a_kill_at_any_call_leaves_what_was_before_or_after(begun, monkeypatch, writer):
    done = shutil.copytree(begun, begun.with_name("done"))
    WRITERS[writer](open_store(done))
    before, after, n, found = contents(begun), contents(done), 0, []
    without = {name: content for name, content in before.items() if name != "nominal.parquet"}
    while True:
        run = shutil.copytree(begun, begun.with_name(f"run-{n}"))
        store = open_store(run)
        if not killed_in(monkeypatch, n, WRITERS[writer], store):
            break
        assert damage(run) == [], n
        with open_store(run).lock():  # as `resume` does
            pass
        assert damage(run) == []
        found.append(contents(run))
        assert found[-1] in [before, after, without], n
        n += 1
    assert contents(run) == after
    assert before in found


def test_a_part_that_a_worker_has_written_survives_a_kill_at_any_call(begun, monkeypatch):
    done = shutil.copytree(begun, begun.with_name("done"))
    WRITERS["append"](open_store(done))
    killed, n = True, 0
    while killed:
        store = open_store(shutil.copytree(begun, begun.with_name(f"run-{n}")))
        with store.lock():
            written = worker_writes(store)
            killed = killed_in(monkeypatch, n, store.publish, written)
            left = shutil.copytree(store.path, begun.with_name(f"left-{n}"))
        with open_store(left).lock():  # as `resume` does
            pass
        assert damage(left) == []
        assert contents(left) == contents(done), n
        n += 1
    assert n > 4


def test_a_line_that_may_be_on_the_disk_keeps_its_part(store, monkeypatch):
    genuine = journal.append_synced

    def written_and_not_synced(*arguments):
        genuine(*arguments)
        raise DiskError("journal.jsonl: Input/output error")

    with store.lock():
        with monkeypatch.context() as patch:
            patch.setattr(journal, "append_synced", written_and_not_synced)
            with pytest.raises(DiskError):
                store.append(0, 10, block(0, 10))
        store.sweep()
        store.append(10, 10, block(10, 10))
    assert damage(store.path) == []
    assert len(open_store(store.path).cases()) == 20
