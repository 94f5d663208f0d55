"""Runs whose files are well-formed, checksummed and false: what `verify` names, a repair mends, and readers refuse.

Parts, the nominal case and histories that are not what receipt and manifest say; files longer than any of their kind;
folders and pipes where a file has to be.
"""

import os
import subprocess
import sys
from hashlib import sha256
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from stones import call, copy_of, flown_stones, results, stones

from mc_engine import load_campaign, open_store
from mc_engine.runner import runner
from mc_engine.runner.shards import Shard
from mc_engine.store.journal import encode, scan
from mc_engine.store.parts import parquet_bytes
from mc_engine.store.verification import damage

CASES, CHUNK = 120, 40


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    return flown_stones(tmp_path_factory.mktemp("stones"), CASES, CHUNK)


@pytest.fixture
def run(flown, tmp_path):
    """A copy of the run, to be falsified."""
    return copy_of(flown, tmp_path)


def assert_a_sentence(done, *words):
    """Exit 5, and every line of the message is the run's or the program's own, none of Arrow's."""
    assert isinstance(done.exception, SystemExit), done.exception
    assert done.exit_code == 5, done.output
    for word in words:
        assert word in done.stderr
    assert "__filename" not in done.stderr


def events_of(run):
    return list(scan((run / "journal.jsonl").read_bytes()).entries)


def write_events(run, events):
    lines = [encode(number, entry.at, entry.event, entry.facts) for number, entry in enumerate(events, start=1)]
    (run / "journal.jsonl").write_bytes(b"".join(lines))


def falsify(run, event, change, **facts):
    """Put another table, for which the journal vouches, in place of the first file of this event; its name."""
    events = events_of(run)
    entry = next(entry for entry in events if entry.event == event)
    path = run / entry.facts["file"]
    content = parquet_bytes(change(pq.ParquetFile(path).read(use_threads=False)))
    path.write_bytes(content)
    entry.facts.update(bytes=len(content), sha256=sha256(content).hexdigest(), **facts)
    write_events(run, events)
    return entry.facts["file"]


def twice(name):
    return lambda table: table.append_column(table.schema.field(name), table[name])


def without(name):
    return lambda table: table.drop_columns([name])


def same(table):
    return table


NO_PART = "is no part of this run, it has other rows or columns"
NO_HISTORIES = "its columns are not those of histories"
FALSE = {
    "a column less": ("part", without("impact_speed_m_s"), {}, 'the column "impact_speed_m_s" is missing'),
    "a column twice": ("part", twice("case_id"), {}, NO_PART),
    "a row less": ("part", lambda table: table.slice(1), {}, NO_PART),
    "nominal of no rows": ("nominal", lambda table: table.slice(0, 0), {}, NO_PART),
    "nominal of other columns": ("nominal", lambda table: pa.table({"a": [1]}), {}, 'the column "case_id" is missing'),
    "histories of no case": ("history", without("case_id"), {}, NO_HISTORIES),
    "histories of more": ("history", lambda t: t.append_column("x_m", t["t_s"]), {}, NO_HISTORIES),
}


@pytest.mark.parametrize("case", FALSE)
def test_what_verify_says_a_repair_mends_it_mends(run, flown, case):
    event, change, facts, words = FALSE[case]
    file = falsify(run, event, change, **facts)
    found = damage(run)
    assert len(found) == 1
    assert found[0].startswith(f"{file}: ")
    assert words in found[0]
    done = call("resume", run, "--repair", "--no-report")
    assert done.exit_code == 0, (done.output, done.exception)
    assert damage(run) == []
    assert results(run) == results(flown.path)


# Where the summary of a metric, or the report, would read what is false.
REFUSED = [("summary", "a column less"), ("summary", "a row less")]
REFUSED += [("report", case) for case in ("a column less", "a column twice")]
REFUSED += [("report", f"nominal of {what}") for what in ("no rows", "other columns")]
REFUSED += [("report", f"histories of {what}") for what in ("no case", "more")]


@pytest.mark.parametrize(("verb", "case"), REFUSED)
def test_readers_of_what_is_false_end_in_one_sentence(run, verb, case):
    event, change, facts, words = FALSE[case]
    file = falsify(run, event, change, **facts)
    done = call(verb, run, *(("--format", "md") if verb == "report" else ()))
    assert_a_sentence(done, f"{file}: ", words)
    assert len(done.stderr.strip().splitlines()) == 1


def test_shards_and_runs_that_keep_no_history_verify_clean(tmp_path):
    campaign = stones(tmp_path / "campaign", CASES)
    shard = runner.run(campaign, tmp_path / "shard", workers=1, shard=Shard(1, 2))
    text = (tmp_path / "campaign" / "campaign.toml").read_text().replace("nominal = true, first = 2", "nominal = false")
    (tmp_path / "campaign" / "campaign.toml").write_text(text)
    plain = runner.run(load_campaign(tmp_path / "campaign" / "campaign.toml"), tmp_path / "plain", workers=1)
    assert plain.history_part is None
    assert [damage(shard.path), damage(plain.path)] == [[], []]


# ---- files that no memory takes


@pytest.mark.skipif(sys.platform == "win32", reason="files with holes need rights")
@pytest.mark.parametrize("name", ["journal.jsonl", "manifest.json", "campaign.toml"])
def test_a_file_that_grew_to_a_tebibyte_is_named_and_not_read(run, name):
    os.truncate(run / name, 2**40)
    for verb in (("verify",), ("resume", "--repair"), ("status",)) if name != "campaign.toml" else (("verify",),):
        done = call(verb[0], run, *verb[1:])
        assert_a_sentence(done, f"{name}: damaged, 1,099,511,627,776 bytes where no such file has more than ")
    assert_a_sentence(call("resume", run, "--repair"), name)


@pytest.mark.skipif(sys.platform == "win32", reason="files with holes need rights")
def test_a_companion_and_a_part_cut_off_that_grew_are_not_read(run, flown):
    events = events_of(run)
    events[0].facts["companions"] = {"model.py": "0" * 64}
    (run / "model.py").touch()
    write_events(run, events)
    os.truncate(run / "model.py", 2**40)
    assert damage(run) == ["model.py: damaged, 1,099,511,627,776 bytes where no such file has more than 17,179,869,184"]
    write_events(run, events_of(flown.path))
    (run / "model.py").unlink()
    aside = run / "cases" / f".part-0000000000-0000000039.parquet.00000000.{'0' * 32}.tmp"
    aside.touch()
    os.truncate(aside, 2**40)
    (run / ".lock").write_text('{"pid": 1, "host": "gone"}')
    open_store(run).note("started")  # the dead writer's parts are looked at, and this one is swept away
    assert not aside.exists()


# ---- folders and pipes in a writer's way


def in_the_way(run, name):
    path = run / name
    if path.exists():
        path.unlink()
    path.mkdir()


OBSTACLES = (
    ".lock",
    ".nominal.parquet.tmp",
    "cases/.x.tmp",
    "nominal.parquet",
    "cases/part-0000000900-0000000909.parquet",
    "PART",
)


@pytest.mark.parametrize("name", OBSTACLES)
def test_a_folder_in_a_writers_way_is_named_by_verify_and_by_resume(run, flown, name):
    file = open_store(run).parts[1].file if name == "PART" else name
    in_the_way(run, file)
    done = call("verify", run)
    assert_a_sentence(done, f"{file}: ", f"move {file} out of the run")
    done = call("resume", run, "--repair", "--no-report")
    assert_a_sentence(done, file)
    (run / file).rmdir()
    assert call("resume", run, "--repair", "--no-report").exit_code == 0
    assert damage(run) == []
    assert results(run) == results(flown.path)


@pytest.mark.skipif(sys.platform == "win32", reason="has no pipes with names")
def test_a_pipe_for_a_lock_is_named(run):
    (run / ".lock").unlink()
    os.mkfifo(run / ".lock")
    assert_a_sentence(call("resume", run, "--repair"), ".lock: is no regular file")


# ---- threads

THREADS = """
import os, sys
from mc_engine import open_store
from mc_engine.store.verification import damage
import pyarrow.parquet, numpy, pandas
import mc_engine.store.repair, mc_engine.store.store
before = len(os.listdir("/proc/self/task"))
assert damage(open_store(sys.argv[1]).path) == []
store = open_store(sys.argv[1])
store.cases(), store.cases(["status"]), store.nominal(), store.histories(), store.row(3)
print(before, len(os.listdir("/proc/self/task")))
"""


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="counts threads where Linux lists them")
def test_reading_a_run_leaves_no_thread_behind(run):
    done = subprocess.run([sys.executable, "-c", THREADS, str(run)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    before, after = done.stdout.split()
    assert before == after
