"""What a writer leaves that was killed is told by `verify`, and is no damage."""

import json

import numpy as np
import pytest
from small_run import block

from mc_engine import durable_file
from mc_engine.errors import StoreError
from mc_engine.store import journal, parts
from mc_engine.store.case_rows import RowLog
from mc_engine.store.opening import open_store
from mc_engine.store.verification import RESUME, damage
from tests.mc_engine.command_line.cart import call

STRAY = "cases/part-0000000010-0000000019.parquet"


def leave(store, name):
    """A file as the run's own writer makes it, without a line in the journal."""
    if name == STRAY:
        written = parts.write_aside(store.path, store.columns, 10, 10, block(10, 10))
        (store.path / written.temporary).rename(store.path / written.part.file)
    else:
        (store.path / name).write_bytes(b"PAR1")


@pytest.fixture
def killed(store):
    """A run with ten cases whose writer was killed."""
    store.append(0, 10, block(0, 10))
    (store.path / ".lock").write_text(json.dumps({"pid": 1, "host": "gone", "since": "then"}))
    return store


@pytest.mark.parametrize("name", [STRAY, "cases/.part-0000000010-0000000019.parquet.tmp", ".campaign.toml.tmp"])
def test_what_a_kill_leaves_is_told_and_is_no_damage(killed, name):
    leave(killed, name)
    done = call("verify", killed.path)
    assert done.exit_code == 0, done.output
    assert f"{killed.path / name}: " in done.stderr
    assert RESUME in done.stderr
    assert done.stdout == f"{killed.path}: every byte is as it was written\n"
    assert damage(killed.path) == []
    with killed.lock():  # as `resume` does
        assert not (killed.path / name).exists()
    assert call("verify", killed.path).stderr == ""


def test_rows_that_a_killed_simulator_recorded_are_told_to_be_kept(killed):
    log = RowLog(killed.path, 10, 20).of(np.array([12]))
    log.add(0, {"status": "ok", "reason": ""})
    log.close()
    said = call("verify", killed.path).stderr
    assert "simulator/.rows-10-20.tmp: holds rows of complete cases, which are taken over; " in said


@pytest.mark.parametrize("harm", ["none", "flipped", "cut"])
def test_a_part_that_a_killed_worker_wrote_counts_if_every_byte_is_right(killed, harm):
    written = parts.write_aside(killed.path, killed.columns, 10, 10, block(10, 10))
    path = killed.path / written.temporary
    content = bytearray(path.read_bytes())
    if harm == "flipped":  # in the last column, which need not be read to know the part's cases
        content[-12 - int.from_bytes(content[-8:-4], "little")] ^= 1
    path.write_bytes(content[:-1] if harm == "cut" else content)
    with killed.lock():
        assert killed.committed() == [(0, 20 if harm == "none" else 10)]
    assert damage(killed.path) == []


@pytest.mark.parametrize("stopped_at", ["append_synced", "publish_all"])
def test_parts_that_are_published_together_all_count_after_a_kill(killed, monkeypatch, stopped_at):
    written = [parts.write_aside(killed.path, killed.columns, first, 10, block(first, 10)) for first in (30, 10, 20)]

    def kill(*arguments):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(journal if stopped_at == "append_synced" else durable_file, stopped_at, kill)
        with pytest.raises(KeyboardInterrupt), killed.lock():
            killed.publish(*written)
    (killed.path / ".lock").write_text(json.dumps({"pid": 1, "host": "gone", "since": "then"}))
    again = open_store(killed.path)
    assert again.committed() == [(0, 10)]
    with again.lock():
        assert again.committed() == [(0, 40)]
    assert again.cases()["ve_pct"].tolist() == block(0, 40)["ve_pct"].tolist()
    assert damage(killed.path) == []


def test_of_parts_that_overlap_none_is_published(store):
    with store.lock():
        written = [parts.write_aside(store.path, store.columns, first, 10, block(first, 10)) for first in (0, 20, 25)]
        with pytest.raises(StoreError, match="some of the cases 25 to 34 are committed already"):
            store.publish(*written)
        assert store.committed() == []
        store.publish(*written[:2])
    assert [(part.first, part.stop) for part in store.parts] == [(0, 10), (20, 30)]


def test_a_part_without_a_line_is_damage_where_no_writer_was_killed(killed):
    (killed.path / ".lock").write_bytes(b"")
    leave(killed, STRAY)
    assert damage(killed.path) == [f"{STRAY}: has no line in the journal and is not part of the run"]
    assert call("verify", killed.path).exit_code == 5


def test_a_part_whose_line_is_damaged_is_damage_also_after_a_kill(killed):
    killed_journal = killed.path / "journal.jsonl"
    (killed.path / ".lock").write_bytes(b"")
    killed.append(10, 10, block(10, 10))
    killed.append(20, 10, block(20, 10))
    (killed.path / ".lock").write_text(json.dumps({"pid": 1, "host": "gone", "since": "then"}))
    lines = killed_journal.read_bytes().splitlines(keepends=True)
    killed_journal.write_bytes(b"".join([*lines[:-2], lines[-2].replace(b"part", b"part "), lines[-1]]))
    done = call("verify", killed.path)
    assert done.exit_code == 5
    assert f"journal.jsonl, line {len(lines) - 1}: damaged" in done.stderr
    assert f"{STRAY}: has no line in the journal and is not part of the run" in done.stderr
