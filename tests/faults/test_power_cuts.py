"""A power cut at any moment of a run: what was not synced may be gone, in part or in whole, and nothing else is.

The run's operations on its disk are recorded once.  Every prefix of the record is then played back into a new folder
as a disk might hold it after the cut.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from stones import assert_as_unbroken, assert_no_wrong_row, completed, results, stones
from test_full_disks import engine
from watched_disk import Listener, watched_disk

from mc_engine.durable_file import make_folder
from mc_engine.runner import runner
from mc_engine.store.derived_files import derived_files
from mc_engine.store.verification import damage

CASES, CHUNK = 200, 20

# How the cut treats names, and contents, that no sync has made safe.
KINDS = ("all lost", "names kept", "contents kept", "torn", "zeros", "at random")


@dataclass
class Inode:
    """A file: its bytes at the last sync, and what has been done to it since, as bytes after each step."""

    synced: bytes = b""
    since: list[bytes] = field(default_factory=list)

    @property
    def now(self):
        return self.since[-1] if self.since else self.synced

    def after_cut(self, kind, rng):
        if not self.since or kind in ("all lost", "names kept"):
            return self.synced
        before = self.since[-2] if len(self.since) > 1 else self.synced
        torn = self.now[: (len(before) + len(self.now)) // 2]
        zeros = self.now[: len(before)] + bytes(max(len(self.now) - len(before), 0))
        choices = {"contents kept": self.now, "torn": torn, "zeros": zeros}
        if kind == "at random":
            return [self.synced, *self.since, torn, zeros][rng.integers(len(self.since) + 3)]
        return choices[kind]


class Folder:
    """A folder: its names at the last sync, and after each step since."""

    def __init__(self):
        self.synced, self.since = {}, []

    @property
    def now(self):
        return self.since[-1] if self.since else self.synced

    def change(self, **names):
        """Give names to inodes, or take them away (None)."""
        self.since.append({name: inode for name, inode in {**self.now, **names}.items() if inode is not None})

    def after_cut(self, kind, rng):
        if kind == "at random":
            return [self.synced, *self.since][rng.integers(len(self.since) + 1)]
        return self.synced if kind in ("all lost", "contents kept") else self.now


class Recorder(Listener):
    """The record of a run's operations, and of which cases it said were safe."""

    def __init__(self):
        self.operations = []

    def after(self, kind, path, **facts):
        self.operations.append((kind, path, facts))

    def said(self, done, total, failed):
        self.operations.append(("said", None, {"cases": done}))


class Disk:
    """The state of a disk after some operations in the folder of a run, and in the one around it."""

    def __init__(self, run):
        self._run, self._folders, self.said = run, {run.parent: Folder()}, 0

    def play(self, kind, path, facts):
        if kind == "said":
            self.said = facts["cases"]
            return
        if kind == "mkdir":
            self._folders[path] = Folder()
            self._folders[path.parent].change(**{path.name: self._folders[path]})
        elif kind == "sync" and path in self._folders:
            folder = self._folders[path]
            folder.synced, folder.since = folder.now, []
        elif kind == "sync":
            inode = self._inode(path)
            inode.synced, inode.since = inode.now, []
        elif kind == "open":
            if facts["fresh"]:
                self._folders[path.parent].change(**{path.name: Inode()})
        elif kind == "write":
            now, at = self._inode(path).now, facts["at"]
            self._inode(path).since.append(now[:at].ljust(at, b"\0") + facts["data"] + now[at + len(facts["data"]) :])
        elif kind == "truncate":
            self._inode(path).since.append(self._inode(path).now[: facts["size"]].ljust(facts["size"], b"\0"))
        elif kind == "rename":
            inode = self._inode(path)
            self._folders[path.parent].change(**{path.name: None, facts["to"].name: inode})
        elif kind == "unlink":
            self._folders[path.parent].change(**{path.name: None})

    def _inode(self, path):
        return self._folders[path.parent].now[path.name]

    def cut(self, place, kind, rng):
        """Write what the disk holds after a power cut into the folder `place`."""
        self._write(self._folders[self._run.parent], place, kind, rng)
        return place / self._run.name

    def _write(self, folder, place, kind, rng):
        place.mkdir()
        for name, held in folder.after_cut(kind, rng).items():
            if isinstance(held, Folder):
                self._write(held, place / name, kind, rng)
            else:
                (place / name).write_bytes(held.after_cut(kind, rng))


def recorded(folder):
    """A run of ten parts: campaign, operations, bytes and table."""
    campaign = stones(folder / "campaign", CASES)
    recorder, run = Recorder(), folder / "disk" / "whole"
    run.parent.mkdir()
    with watched_disk(run.parent, recorder):
        store = runner.run(campaign, run, workers=2, chunk=CHUNK, progress=recorder.said)
    assert len(store.parts) == 10
    return campaign, recorder.operations, results(run), store.cases(), run


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("stones"))


def check_cuts(folder, record, kind, begin, step, resume_each):
    """Cut after every step-th operation, and complete every so many of these runs; how many cuts there were."""
    campaign, operations, whole, table, run = record
    rng, disk, cuts = np.random.default_rng(KINDS.index(kind)), Disk(run), 0
    for number, operation in enumerate(operations):
        disk.play(*operation)
        if (number - begin) % step:
            continue
        after = disk.cut(folder / f"{number}", kind, rng)
        committed = 0
        if (after / "journal.jsonl").exists():
            committed = len(assert_no_wrong_row(after, table).cases(["case_id"]))
        assert committed >= disk.said, f"operation {number}: {disk.said} cases were said to be safe"
        if cuts % resume_each == 0:
            completed(after, campaign, CHUNK)
            assert_as_unbroken(after, whole)
        cuts += 1
    return cuts


def test_the_record_holds_the_whole_run(record, tmp_path):
    """Played to its end and cut with nothing lost, the record is the run itself."""
    _, operations, whole, _, run = record
    disk = Disk(run)
    for operation in operations:
        disk.play(*operation)
    again = disk.cut(tmp_path / "cut", "all lost", None)
    assert results(again) == whole
    assert damage(again) == []


@pytest.mark.parametrize(("step", "resume_each"), [(11, 4), pytest.param(1, 1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", KINDS)
def test_a_power_cut_costs_no_case_that_was_said_to_be_safe(record, tmp_path, kind, step, resume_each, record_property):
    cuts = check_cuts(Path(tmp_path), record, kind, KINDS.index(kind) % step, step, resume_each)
    record_property("cuts", cuts)
    assert cuts > 10


def test_a_run_cut_short_while_it_was_made_is_begun_anew_in_the_same_folder(record, tmp_path):
    """A moment before the journal has its name."""
    campaign, operations, whole, _, run = record
    disk = Disk(run)
    for operation in operations:
        if operation[2].get("to") == run / "journal.jsonl":
            break
        disk.play(*operation)
    after = disk.cut(tmp_path / "cut", "names kept", None)
    assert {"manifest.json", "campaign.toml"} < {path.name for path in after.iterdir()}
    done = engine("resume", after)
    assert done.returncode == 5
    assert "has no journal.jsonl, and so no committed case; `run` the campaign anew" in done.stderr
    done = engine("run", campaign.directory, "--out", after, "--no-report")
    assert done.returncode == 0, done.stderr
    assert damage(after) == []
    assert results(after)["nominal.parquet"] == whole["nominal.parquet"]


@pytest.mark.parametrize("kind", KINDS)
def test_a_power_cut_leaves_the_reports_of_before_or_those_after(tmp_path, kind):
    """The second writing replaces a file, and the third makes a folder of its own."""
    recorder, run, states = Recorder(), tmp_path / "disk" / "run", [{}]
    run.parent.mkdir()
    with watched_disk(run.parent, recorder):
        make_folder(run)
        for name, content in (("report.html", b"old"), ("report.html", b"new"), ("replay/case-3.parquet", b"PAR1")):
            derived_files(run).write({name: content})
            states.append({**states[-1], name: content})
            recorder.said(len(states) - 1, 0, 0)
    rng, disk = np.random.default_rng(KINDS.index(kind)), Disk(run)
    for number, operation in enumerate(recorder.operations):
        disk.play(*operation)
        after = disk.cut(tmp_path / f"{number}", kind, rng)
        if after.exists():
            assert derived_files(after).read() in states[disk.said : disk.said + 2], number
