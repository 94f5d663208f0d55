import os
import sys

import pytest

from mc_engine import durable_file
from mc_engine.durable_file import copy_into, read_file, read_inside, write_durably
from mc_engine.errors import DiskError, StoreError

links = pytest.mark.skipif(sys.platform == "win32", reason="links need rights")


@links
def test_neither_reading_nor_writing_follows_a_link(tmp_path):
    (tmp_path / "outside").write_bytes(b"mine")
    (tmp_path / "run" / "folder").mkdir(parents=True)
    (tmp_path / "run" / "link").symlink_to(tmp_path / "outside")
    (tmp_path / "run" / ".new.tmp").symlink_to(tmp_path / "outside")
    (tmp_path / "run" / "away").symlink_to(tmp_path)
    for read in (lambda: read_file(tmp_path / "run" / "link"), lambda: read_inside(tmp_path / "run", "away/outside")):
        with pytest.raises(StoreError, match="symbolic link"):
            read()
    with pytest.raises(StoreError, match="symbolic link"):
        write_durably(tmp_path / "run" / "new", b"theirs")
    with pytest.raises(StoreError, match="no regular file"):
        read_file(tmp_path / "run" / "folder")
    assert (tmp_path / "outside").read_bytes() == b"mine"
    (tmp_path / "alias").symlink_to(tmp_path / "run")  # the way to the directory is the user's own
    write_durably(tmp_path / "run" / "b", b"b")
    assert read_inside(tmp_path / "alias", "b") == b"b"


@links
@pytest.mark.parametrize("known", [True, False])
def test_on_a_system_with_a_sync_of_the_drive_that_one_is_asked_for_first(tmp_path, monkeypatch, known):
    asked = []

    def control(descriptor, command):
        asked.append(command)
        if not known:
            raise OSError(25, "Inappropriate ioctl for device")

    monkeypatch.setattr(durable_file, "_FULL_SYNC", 51)
    monkeypatch.setattr(durable_file.fcntl, "fcntl", control)
    monkeypatch.setattr(os, "fsync", lambda descriptor: asked.append("fsync"))
    write_durably(tmp_path / "a", b"0")
    assert asked == [51, 51] if known else [51, "fsync", 51, "fsync"]


@pytest.mark.parametrize("broken", ["write", "fsync", "replace"])
def test_a_file_that_cannot_be_written_leaves_the_one_before_and_nothing_beside_it(tmp_path, monkeypatch, broken):
    write_durably(tmp_path / "a", b"before")

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, broken, full)
        with pytest.raises(DiskError, match=r"a: No space left"):
            write_durably(tmp_path / "a", b"after")
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("a", b"before")]


def test_a_copy_of_a_sparse_file_takes_no_more_room_than_the_file(tmp_path):
    with (tmp_path / "sparse").open("wb") as file:
        file.write(b"first")
        file.seek(2**26)
        file.write(b"last")
        file.truncate(2**27 + 1)
    copy_into(tmp_path, "run/copy", tmp_path / "sparse")
    assert (tmp_path / "run/copy").read_bytes() == (tmp_path / "sparse").read_bytes()
    assert 512 * (tmp_path / "run/copy").stat().st_blocks < 2**23
