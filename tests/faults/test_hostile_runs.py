"""Run directories in which names lead outside, files or folders are foreign, or parts are gone.

Nothing outside is opened or removed, and what can be flown again is flown again to the same bytes.
"""

import shutil
import sys

import pytest
from stones import call, results, stones
from trapped import files_of

from mc_engine import open_store
from mc_engine.runner import runner
from mc_engine.runner.shards import Shard
from mc_engine.store.journal import encode, scan
from mc_engine.store.verification import damage, damages


@pytest.fixture
def victim(tmp_path):
    """Someone's file outside of the run."""
    (tmp_path / "victim").mkdir()
    (tmp_path / "victim" / "file.txt").write_text("mine")
    return tmp_path / "victim" / "file.txt"


def renamed(run, event, file):
    """Rename the file of the last line with this event, with checksums that hold; the number of the line."""
    entries = list(scan((run / "journal.jsonl").read_bytes()).entries)
    number = [entry.number for entry in entries if entry.event == event][-1]
    entries[number - 1].facts["file"] = file
    lines = [encode(entry.number, entry.at, entry.event, entry.facts) for entry in entries]
    (run / "journal.jsonl").write_bytes(b"".join(lines))
    return number


def assert_a_sentence(done, *words):
    assert done.exit_code == 5, done.output
    assert isinstance(done.exception, SystemExit), done.exception
    for word in words:
        assert word in done.stderr


OUTSIDE = ("../victim/file.txt", "cases/../../victim/file.txt", "ABSOLUTE", "/dev/zero", "cases/PART-1.parquet")


@pytest.mark.parametrize("event", ["part", "history", "nominal"])
def test_repair_neither_opens_nor_removes_a_file_that_is_no_part(flown, tmp_path, victim, event):
    for place, file in enumerate(OUTSIDE):
        run = shutil.copytree(flown.path, tmp_path / f"run-{place}")
        number = renamed(run, event, str(victim) if file == "ABSOLUTE" else file)
        assert any(f"line {number}: damaged" in problem for problem in damage(run)), file
        assert_a_sentence(call("resume", run, "--no-report"), f"journal.jsonl, line {number}: damaged")
        done = call("resume", run, "--repair", "--no-report")
        assert done.exit_code == 0, (file, done.output)
        assert victim.read_text() == "mine"
        assert damage(run) == []
        assert results(run) == results(flown.path)


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights")
def test_links_out_of_the_run_are_not_written_through(run, victim, tmp_path):
    (run / ".lock").unlink()
    (run / ".lock").symlink_to(victim)
    assert_a_sentence(call("resume", run, "--repair"), ".lock: is a symbolic link")
    assert victim.read_text() == "mine"
    (run / ".lock").unlink()
    for name in (".receipt.tmp", ".part-0000000000-0000000039.parquet.tmp"):
        (run / "cases" / name).symlink_to(victim)
    open_store(run).withdraw(open_store(run).parts[0])
    assert victim.read_text() == "mine"
    shutil.move(run / "cases", tmp_path / "cases")
    (run / "cases").symlink_to(tmp_path / "cases")
    assert_a_sentence(call("resume", run, "--repair"), "cases: is a symbolic link")
    assert_a_sentence(call("verify", run), "cases: is no folder of this run's own")


FOREIGN = ("cases/junk.parquet", "cases/sub/part-1.parquet", "cases/PART-0000000000-0000000009.parquet", "cases/x.txt",
           "history/more.parquet", "cases/part-0-9.parquet", "cases/part-0000000900-0000000909.parquet")  # fmt: skip


def test_verify_names_every_file_among_the_parts_that_does_not_count(run):
    part = open_store(run).parts[0].file
    for name in FOREIGN:
        (run / name).parent.mkdir(exist_ok=True)
        shutil.copy(run / part, run / name)
        named = "cases/sub" if "/sub/" in name else name
        assert [problem.split(":")[0] for problem in damage(run)] == [named]
        done = call("verify", run)
        assert done.exit_code == 5
        assert ("move " in done.stderr) == (damages(run)[0].mended_by.startswith("move")), name
        shutil.rmtree(run / named) if named == "cases/sub" else (run / name).unlink()


OBSTACLES = (".lock", ".nominal.parquet.tmp", "nominal.parquet", "cases/part-0000000040-0000000079.parquet")


@pytest.mark.parametrize("name", OBSTACLES)
def test_a_folder_in_a_writers_way_is_named_by_verify_and_by_resume(run, flown, name):
    (run / name).unlink(missing_ok=True)
    (run / name).mkdir()
    assert_a_sentence(call("verify", run), f"{name}: ", f"move {name} out of the run")
    assert_a_sentence(call("resume", run, "--repair", "--no-report"), name)
    (run / name).rmdir()
    assert call("resume", run, "--repair", "--no-report").exit_code == 0
    assert damage(run) == []
    assert results(run) == results(flown.path)


def test_every_cut_of_the_journal_between_two_lines_is_noticed(run):
    journal = run / "journal.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    for kept in range(len(lines)):
        journal.write_bytes(b"".join(lines[:kept]))
        assert damage(run), kept
    journal.write_bytes(b"".join(lines))
    assert damage(run) == []


# ---- what cannot be flown again, and what need not be


@pytest.mark.parametrize("name", ["campaign.toml", "manifest.json"])
def test_verify_does_not_promise_a_repair_where_the_campaign_itself_is_damaged(run, name):
    (run / name).write_bytes((run / name).read_bytes() + b"\n")
    done = call("verify", run)
    assert_a_sentence(done, f"put back the original of {name}")
    assert "--repair" not in done.stderr


def assert_repaired_in_place(run, lost):
    """What is gone is flown again under its name to its bytes; nothing else is touched."""
    before = files_of(run)
    stamps = {file: (run / file).stat().st_mtime_ns for file in before}
    for file in lost:
        (run / file).unlink()
    runner.resume(run, workers=2, repair=True)
    assert files_of(run) == before
    assert {file for file in before if (run / file).stat().st_mtime_ns != stamps[file]} == set(lost)
    assert damage(run) == []


def test_repair_of_a_merged_run_gives_the_parts_back_and_flies_nothing_else(tmp_path):
    campaign = stones(tmp_path / "campaign", 200)
    for number in (1, 2):
        runner.run(campaign, tmp_path / f"s{number}", workers=1, shard=Shard(number, 2))
    merged = runner.merge(tmp_path / "merged", [tmp_path / "s1", tmp_path / "s2"], chunk=70)
    files = [part.file for part in merged.parts]
    assert_repaired_in_place(merged.path, files[1:2])
    assert_repaired_in_place(merged.path, files)
