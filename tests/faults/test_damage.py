"""Cuts and flipped bits in every file of a run directory: all are found and named, repair flies only what it must."""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from stones import call, results, stones

from mc_engine import open_store
from mc_engine.errors import StoreError
from mc_engine.runner import runner
from mc_engine.runner.shards import Shard
from mc_engine.store.verification import damage

RECOMPUTED = ("cases/", "history/", "nominal.parquet")  # what repair can fly again; the rest is told and refused


def files_of(run):
    """All files but the lock, which is empty when nobody writes."""
    paths = sorted(path for path in run.rglob("*") if path.is_file() and path.name != ".lock")
    return {path.relative_to(run).as_posix(): path for path in paths}


def damaged_contents(whole, rng, cuts, flips):
    """The content cut at random places, then with single bits flipped."""
    at = rng.choice(len(whole), min(cuts, len(whole)), replace=False)
    yield from (whole[: int(place)] for place in at)
    for place in rng.choice(8 * len(whole), flips, replace=False):
        flipped = bytearray(whole)
        flipped[place // 8] ^= 1 << int(place % 8)
        yield bytes(flipped)


def check_all_damage_is_named(run, cuts, flips, seed):
    """Damage one file at a time, and let `verify` name it; how often.

    A journal cut between two lines is one of an earlier time: then the files are named that it does not have.
    """
    rng, tried, unseen = np.random.default_rng(seed), 0, []
    for name, path in files_of(run).items():
        whole = path.read_bytes()
        for content in damaged_contents(whole, rng, cuts, flips):
            path.write_bytes(content)
            tried += 1
            earlier = name == "journal.jsonl" and content.endswith(b"\n") and whole.startswith(content)
            if not any(problem.startswith(name) or earlier for problem in damage(run)):
                unseen.append((name, len(content)))
        path.write_bytes(whole)
    assert damage(run) == []
    assert unseen == []
    return tried


@pytest.mark.parametrize(("cuts", "flips"), [(3, 8), pytest.param(50, 200, marks=pytest.mark.slow)])
def test_verify_names_every_file_that_was_cut_or_has_a_flipped_bit(run, cuts, flips, record_property):
    record_property("damages", check_all_damage_is_named(run, cuts, flips, seed=1))


def test_a_torn_last_line_loads_and_a_torn_middle_line_is_refused_with_its_number(run):
    journal = run / "journal.jsonl"
    whole = journal.read_bytes()
    lines = whole.splitlines(keepends=True)
    rng = np.random.default_rng(4)
    for cut in rng.integers(1, len(lines[-1]), 10):
        journal.write_bytes(whole[: -int(cut)])
        assert len(open_store(run).notes()) == len(lines) - 1
        assert [problem for problem in damage(run) if f"line {len(lines)}: torn" in problem]
    for number in range(1, len(lines)):
        torn = lines[number - 1][: int(rng.integers(0, len(lines[number - 1]) - 1))]
        journal.write_bytes(b"".join([*lines[: number - 1], torn, b"\n", *lines[number:]]))
        with pytest.raises(StoreError, match=rf"journal\.jsonl, line {number}: damaged"):
            open_store(run)


def repaired(run, flown):
    """Repair the run; the parts that were written anew.  All results are then those of the unbroken run."""
    before = {path: path.stat().st_mtime_ns for path in (run / "cases").iterdir()}
    store = runner.resume(run, workers=2, repair=True)
    assert damage(store.path) == []
    assert results(run) == {**results(flown.path)}
    return {path.name for path in (run / "cases").iterdir() if before.get(path) != path.stat().st_mtime_ns}


def test_repair_flies_only_what_is_damaged(run, flown):
    rng = np.random.default_rng(5)
    for name, path in files_of(run).items():
        if name.startswith(RECOMPUTED) and path.exists():
            whole = path.read_bytes()
            for content in damaged_contents(whole, rng, 1, 1):
                path.write_bytes(content)
                anew = repaired(run, flown)
                assert anew == ({path.name} if name.startswith("cases/") else set())
                if not path.exists():
                    break  # histories that are flown anew have a new name


def test_parts_whose_journal_lines_are_damaged_are_flown_again(run, flown):
    journal = run / "journal.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    hit = [number for number, line in enumerate(lines) if b'"event":"part"' in line][1:3]
    for number in hit:
        lines[number] = lines[number][:40] + b"?" + lines[number][41:]
    journal.write_bytes(b"".join(lines))
    with pytest.raises(StoreError, match=rf"line {hit[0] + 1}: damaged.*resume --repair"):
        runner.resume(run)
    anew = repaired(run, flown)
    assert len(anew) == 2
    assert open_store(run).notes("mended")[0].facts["lost"] == [number + 1 for number in hit]


@pytest.mark.parametrize("event", ["part-withdrawn", "nominal", "history", "started", "finished"])
def test_no_lost_line_makes_a_case_count_twice(run, flown, event):
    store = open_store(run)
    part = store.parts[2]
    (run / part.file).write_bytes(b"")
    runner.resume(run, repair=True)
    journal = run / "journal.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    number = next(i for i, line in enumerate(lines) if f'"event":"{event}"'.encode() in line)
    lines[number] = b"?\n"
    journal.write_bytes(b"".join(lines))
    repaired(run, flown)
    assert len(open_store(run).cases()) == 200


@pytest.mark.parametrize("folder", ["cases", "history"])
def test_a_folder_that_is_gone_is_named_and_made_anew(run, flown, folder):
    shutil.rmtree(run / folder)
    for verb in ("verify", "status"):
        said = call(verb, run)
        assert said.exit_code == 5
        assert f"{folder}: " in said.stderr
        assert "put back" not in said.stderr
        assert "--repair" in said.stderr or "verify" in said.stderr
    said = call("resume", run, "--no-report")
    assert said.exit_code == 5
    assert f"{folder}: the folder is gone; `mc-engine resume {run} --repair`" in said.stderr
    assert call("resume", run, "--repair", "--no-report").exit_code == 0
    assert damage(run) == []
    assert results(run) == results(flown.path)


def test_a_shard_without_one_of_its_parts_is_no_complete_shard(tmp_path):
    shard = runner.run(stones(tmp_path / "campaign", 200), tmp_path / "shard", workers=1, shard=Shard(2, 2))
    lost = shard.path / shard.parts[0].file
    before = lost.read_bytes()
    lost.unlink()
    said = call("resume", shard.path)
    assert (said.exit_code, said.stdout) == (5, "")
    assert f"{lost}: is gone; `mc-engine resume {shard.path} --repair`" in said.stderr
    assert call("resume", shard.path, "--repair").exit_code == 0
    assert lost.read_bytes() == before
    assert damage(shard.path) == []


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
