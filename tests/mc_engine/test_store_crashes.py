import os
import signal
import subprocess
import sys

import pandas as pd
import pytest
from small_run import COLUMNS, ENVIRONMENT, MANIFEST, TEXT, block, filled

from mc_engine.errors import StoreError
from mc_engine.store.opening import open_store
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


def test_a_part_is_synced_renamed_and_its_folder_synced_before_its_journal_line(store, monkeypatch):
    done = []
    fsync, replace = os.fsync, os.replace

    def noted_fsync(descriptor):
        done.append(("sync", os.fstat(descriptor).st_ino))
        fsync(descriptor)

    def noted_replace(source, target, **folders):
        done.append(("rename", os.stat(source, dir_fd=folders["src_dir_fd"]).st_ino))
        replace(source, target, **folders)

    with store.lock():
        monkeypatch.setattr(os, "fsync", noted_fsync)
        monkeypatch.setattr(os, "replace", noted_replace)
        store.append(0, 10, block(0, 10))
    part, folder, journal = (
        os.stat(store.path / name).st_ino for name in (store.parts[0].file, "cases", "journal.jsonl")
    )
    assert done == [("sync", part), ("rename", part), ("sync", folder), ("sync", journal)]


KILLED = """
from small_run import ENVIRONMENT, block, created
store = created({run!r})
with store.lock():
    for first in range(40):
        store.append(first, 1, block(first, 1))
        print(first, flush=True)
"""


@pytest.mark.parametrize("after", [0, 3, 11, 26])
def test_a_killed_writer_loses_nothing_it_committed_and_is_taken_over_with_a_note(run, after):
    script = KILLED.format(run=str(run))
    writer = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, env=ENVIRONMENT)
    for line in writer.stdout:
        if int(line) == after:
            break
    os.kill(writer.pid, signal.SIGKILL)
    writer.stdout.close()
    writer.wait()
    store = open_store(run)
    assert store.missing(after + 1) == []
    with store.lock():
        for first, stop in store.missing():
            store.append(first, stop - first, block(first, stop - first))
    assert store.notes("lock-taken-over")[0].facts["from"]["pid"] == writer.pid
    assert damage(store.path) == []
    assert store.cases()["ve_pct"].tolist() == block(0, 40)["ve_pct"].tolist()
    assert len(pd.read_parquet(run / "cases")) == 40
