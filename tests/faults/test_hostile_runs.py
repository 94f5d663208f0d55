"""Run directories as a stranger could send them: every checksum holds, and what they say no engine has written.

Nothing outside of the directory is opened or removed, every verb answers with a sentence and the line, and what can
be flown again is flown again to the same bytes.
"""

import json
import os
import shutil
import sys
import time
from hashlib import sha256
from pathlib import Path
from zlib import crc32

import pyarrow.parquet as pq
import pytest
from stones import call, copy_of, flown_stones, results, stones

from mc_engine import open_store
from mc_engine.errors import StoreError
from mc_engine.runner import runner
from mc_engine.runner.shards import Shard
from mc_engine.store.journal import encode, scan
from mc_engine.store.verification import damage, damages

CASES, CHUNK = 200, 40
READERS = (("verify",), ("status",), ("summary",), ("resume", "--no-report"))


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    return flown_stones(tmp_path_factory.mktemp("stones"), CASES, CHUNK)


@pytest.fixture
def run(flown, tmp_path):
    """A copy of the run, to be tampered with."""
    return copy_of(flown, tmp_path)


@pytest.fixture
def victim(tmp_path):
    """Someone's file outside of the run."""
    (tmp_path / "victim").mkdir()
    (tmp_path / "victim" / "file.txt").write_text("mine")
    return tmp_path / "victim" / "file.txt"


def written(run, events):
    """Write a journal of these events, every checksum of which holds."""
    lines = [encode(number, entry.at, entry.event, entry.facts) for number, entry in enumerate(events, start=1)]
    (run / "journal.jsonl").write_bytes(b"".join(lines))


def tampered(run, event, **facts):
    """Change facts of the second line with this event, or of the only one; the line's number."""
    events = list(scan((run / "journal.jsonl").read_bytes()).entries)
    at = [i for i, entry in enumerate(events) if entry.event == event][:2][-1]
    events[at].facts.update(facts)
    for name in [name for name, value in facts.items() if value is ...]:
        del events[at].facts[name]
    written(run, events)
    return at + 1


def added(run, event, **facts):
    """Put one more line at the end; its number."""
    content = (run / "journal.jsonl").read_bytes()
    number = len(scan(content).entries) + 1
    (run / "journal.jsonl").write_bytes(content + encode(number, "2026-01-01T00:00:00.000Z", event, facts))
    return number


def assert_a_sentence(done, *words):
    assert done.exit_code == 5, done.output
    assert isinstance(done.exception, SystemExit), done.exception
    for word in words:
        assert word in done.stderr


OUTSIDE = ("../victim/file.txt", "cases/../../victim/file.txt", "ABSOLUTE", "/dev/zero", "cases/PART-1.parquet")


@pytest.mark.parametrize("file", OUTSIDE)
@pytest.mark.parametrize("event", ["part", "history", "nominal"])
def test_repair_neither_opens_nor_removes_a_file_that_is_no_part(run, flown, victim, event, file):
    number = tampered(run, event, file=str(victim) if file == "ABSOLUTE" else file)
    assert any(f"line {number}: damaged" in problem for problem in damage(run))
    assert_a_sentence(call("resume", run, "--no-report"), f"journal.jsonl, line {number}: damaged")
    done = call("resume", run, "--repair", "--no-report")
    assert done.exit_code == 0, done.output
    assert victim.read_text() == "mine"
    assert damage(run) == []
    assert results(run) == results(flown.path)


def test_no_file_outside_is_removed_for_a_line_that_withdraws_or_replaces_it(run, victim):
    for event, facts in (("part-withdrawn", {"file": "../victim/file.txt"}), ("part-replaced", {"replaces": ".."})):
        added(run, event, **facts)
    assert call("resume", run, "--repair", "--no-report").exit_code == 0
    assert victim.read_text() == "mine"


NONSENSE = [
    ("part", {"rows": -5}),
    ("part", {"rows": "x"}),
    ("part", {"rows": 10**12}),
    ("part", {"rows": True}),
    ("part", {"first": -100}),
    ("part", {"first": None}),
    ("part", {"first": 7}),
    ("part", {"file": 5}),
    ("part", {"file": "cases/part-0000000040-0000000079.parquet\0"}),
    ("part", {"status": {"ok": -5}}),
    ("part", {"status": []}),
    ("part", {"sha256": "0"}),
    ("part", {"bytes": ...}),
    ("part", {"colour": "red"}),
    ("history", {"file": "history/part-x.parquet"}),
    ("started", {"chunk": 0}),
]


@pytest.mark.parametrize(("event", "facts"), NONSENSE, ids=str)
def test_a_line_that_no_engine_can_have_written_is_damage_with_its_number(run, flown, event, facts):
    number = tampered(run, event, **facts)
    place = f"journal.jsonl, line {number}: damaged"
    for verb, *options in READERS:
        assert_a_sentence(call(verb, run, *options), place)
    runner.resume(run, workers=2, repair=True)
    assert damage(run) == []
    assert results(run) == results(flown.path)


@pytest.mark.parametrize(
    ("event", "facts"),
    [("extended", {"cases": cases}) for cases in (10**18, "x", None)]
    + [("created", {}), ("part-withdrawn", {}), ("part", {})],
    ids=str,
)
def test_a_line_more_that_no_engine_can_have_written_is_damage_with_its_number(run, flown, event, facts):
    number = added(run, event, **facts)
    assert_a_sentence(call("verify", run), f"journal.jsonl, line {number}: damaged")
    assert_a_sentence(call("resume", run), f"journal.jsonl, line {number}: damaged")
    runner.resume(run, repair=True)
    assert results(run) == results(flown.path)


def test_a_part_told_twice_does_not_count_twice(run, flown):
    added(run, "part", **vars(open_store(run).parts[1]))
    assert open_store(run).parts == flown.parts
    assert call("summary", run).exit_code == 0


def test_deep_nesting_is_damage(run):
    lines = (run / "journal.jsonl").read_bytes().splitlines(keepends=True)
    body = b'{"n":2,"at":"x","event":"y","z":' + b"[" * 10**5
    lines[1] = body + b',"crc":"%08x"}\n' % crc32(body)
    (run / "journal.jsonl").write_bytes(b"".join(lines))
    for verb, *options in READERS:
        assert_a_sentence(call(verb, run, *options), "journal.jsonl, line 2: damaged")


def with_manifest(run, content):
    """The run with another manifest, for which the journal vouches."""
    (run / "manifest.json").write_bytes(content)
    tampered(run, "created", manifest=sha256(content).hexdigest())


def changed(run, **keys):
    return json.dumps({**json.loads((run / "manifest.json").read_bytes()), **keys}).encode()


@pytest.mark.parametrize(
    "keys",
    [
        {"columns": 5},
        {"columns": []},
        {"columns": [{"name": "case_id"}]},
        {"campaign": {}},
        {"campaign": {"name": "x", "cases": 10**18}},
        {"quantities": 3},
        {"shard": {"first": "x"}},
        {"requirements": ["x"]},
        {"looks": [None]},
        None,
    ],
    ids=str,
)
def test_a_manifest_that_no_engine_can_have_written_is_refused_in_a_sentence(run, keys):
    with_manifest(run, b"[" * 200_000 if keys is None else changed(run, **keys))
    for verb, *options in READERS:
        assert_a_sentence(call(verb, run, *options), "manifest.json: ")


@pytest.mark.skipif(sys.platform == "win32", reason="neither pipes nor links without rights")
@pytest.mark.parametrize("name", ["manifest.json", "campaign.toml", "journal.jsonl", "nominal.parquet", "PART"])
@pytest.mark.parametrize("kind", ["pipe", "link", "device"])
def test_what_is_no_file_of_the_run_is_named_within_a_second(run, tmp_path, name, kind):
    path = run / (open_store(run).parts[1].file if name == "PART" else name)
    outside = tmp_path / "outside"
    path.rename(outside)
    if kind == "pipe":
        os.mkfifo(path)
    else:
        path.symlink_to(outside if kind == "link" else "/dev/zero")
    begin = time.monotonic()
    assert any(problem.startswith(path.relative_to(run).as_posix()) for problem in damage(run))
    assert time.monotonic() - begin < 1.0


def test_a_part_that_grew_is_not_read_to_its_end(run):
    """Two tebibytes, of which the disk holds a few kibibytes."""
    file = open_store(run).parts[1].file
    size = (run / file).stat().st_size
    os.truncate(run / file, 2**41)
    assert damage(run) == [f"{file}: damaged, more than the {size} bytes that were written"]


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
           "cases/_metadata", "cases/.hidden.parquet", "history/more.parquet", "cases/part-0-9.parquet",
           "cases/part-0000000900-0000000909.parquet", "history/part-00007.parquet")  # fmt: skip


@pytest.mark.parametrize("name", FOREIGN)
def test_verify_names_every_file_among_the_parts_that_does_not_count(run, name):
    part = open_store(run).parts[0].file
    (run / name).parent.mkdir(exist_ok=True)
    shutil.copy(run / part, run / name)
    named = "cases/sub" if "/sub/" in name else name
    assert [problem.split(":")[0] for problem in damage(run)] == [named]
    done = call("verify", run)
    assert done.exit_code == 5
    assert ("move " in done.stderr) == (damages(run)[0].mended_by.startswith("move"))


def test_verify_names_a_nominal_case_whose_line_is_gone(run):
    content = (run / "journal.jsonl").read_bytes()
    written(run, [entry for entry in scan(content).entries if entry.event != "nominal"])
    assert damage(run) == ["nominal.parquet: has no line in the journal and is not part of the run"]


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


def bytes_of(run):
    paths = [*(run / "cases").iterdir(), *(run / "history").iterdir(), run / "nominal.parquet"]
    return {path.relative_to(run).as_posix(): path.read_bytes() for path in paths}


def assert_repaired_in_place(run, lost):
    """What is gone is flown again under its name to its bytes; nothing else is touched."""
    before = bytes_of(run)
    stamps = {file: (run / file).stat().st_mtime_ns for file in before}
    for file in lost:
        (run / file).unlink()
    runner.resume(run, workers=2, repair=True)
    assert bytes_of(run) == before
    assert {file for file in before if (run / file).stat().st_mtime_ns != stamps[file]} == set(lost)
    assert damage(run) == []


def test_repair_of_a_merged_run_gives_the_parts_back_and_flies_nothing_else(tmp_path):
    campaign = stones(tmp_path / "campaign", CASES)
    for number in (1, 2):
        runner.run(campaign, tmp_path / f"s{number}", workers=1, shard=Shard(number, 2))
    merged = runner.merge(tmp_path / "merged", [tmp_path / "s1", tmp_path / "s2"], chunk=70)
    files = [part.file for part in merged.parts]
    assert_repaired_in_place(merged.path, files[1:2])
    assert_repaired_in_place(merged.path, files)


def test_repair_of_an_extended_run_gives_the_parts_back_and_flies_nothing_else(run):
    runner.extend(run, 290, workers=2, chunk=35)
    files = [part.file for part in open_store(run).parts]
    assert len(files) == 8
    assert_repaired_in_place(run, files[4:6])  # either side of the seam
    assert_repaired_in_place(run, files)


def test_a_lost_line_of_an_extended_run_costs_its_part_alone(run):
    runner.extend(run, 290, workers=2, chunk=35)
    before, part = bytes_of(run), open_store(run).parts[6]
    content = (run / "journal.jsonl").read_bytes()
    (run / "journal.jsonl").write_bytes(content.replace(part.file.encode(), b"?" * len(part.file)))
    runner.resume(run, workers=2, repair=True)
    assert bytes_of(run) == before


def test_a_repair_of_the_histories_alone_flies_no_case(run, flown):
    before = {file: (run / file).stat().st_mtime_ns for file in bytes_of(run) if not file.startswith("history")}
    history = run / open_store(run).history_part.file
    history.write_bytes(history.read_bytes()[:-1])
    runner.resume(run, workers=2, repair=True)
    assert {file: (run / file).stat().st_mtime_ns for file in before} == before
    assert results(run) == results(flown.path)


def test_a_merge_that_fails_leaves_nothing_in_the_way_of_the_next(tmp_path):
    campaign = stones(tmp_path / "campaign", CASES)
    shards = [runner.run(campaign, tmp_path / f"s{n}", workers=1, shard=Shard(n, 2)).path for n in (1, 2)]
    part = shards[1] / open_store(shards[1]).parts[-1].file
    part.write_bytes(part.read_bytes()[:-1])
    with pytest.raises(StoreError, match=part.name):
        runner.merge(tmp_path / "merged", shards)
    assert not (tmp_path / "merged").exists()
    runner.resume(shards[1], repair=True)
    assert len(runner.merge(tmp_path / "merged", shards).cases()) == CASES


def test_a_fetch_that_fails_leaves_nothing_in_the_way_of_the_next(run, tmp_path):
    pytest.importorskip("fsspec")
    from mc_engine.store.object_store import fetch, publish

    away, back = tmp_path / "away", tmp_path / "back"
    publish(run, f"file://{away}")
    part = away / open_store(run).parts[2].file
    whole = part.read_bytes()
    part.write_bytes(whole[:-1])
    with pytest.raises(StoreError, match=part.name):
        fetch(f"file://{away}", back)
    assert not [path for path in tmp_path.iterdir() if "back" in path.name]
    part.write_bytes(whole)
    assert damage(fetch(f"file://{away}", back)) == []


def test_names_of_unfinished_parts_leave_room_in_a_path_of_windows(run, monkeypatch):
    from mc_engine.store import parts

    store = open_store(run)
    arrays = {name: column.to_numpy() for name, column in store.cases().iloc[:CHUNK].items()}
    written = parts.write_aside(run, store.columns, 0, CHUNK, arrays)
    assert len(Path(written.temporary).name) <= 90
    assert pq.read_metadata(run / written.temporary).num_rows == CHUNK
