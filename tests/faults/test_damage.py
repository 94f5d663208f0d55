"""Cuts and flipped bits in every file of a run directory: all are found and named, repair flies only what it must."""

import shutil

import numpy as np
import pytest
from stones import call, copy_of, flown_stones, results, stones

from mc_engine import open_store
from mc_engine.errors import StoreError
from mc_engine.runner import runner
from mc_engine.store.journal import encode, scan
from mc_engine.store.repair import mend_journal
from mc_engine.store.verification import damage

CASES, CHUNK = 200, 40
RECOMPUTED = ("cases/", "history/", "nominal.parquet")  # what repair can fly again; the rest is told and refused


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    return flown_stones(tmp_path_factory.mktemp("stones"), CASES, CHUNK)


@pytest.fixture
def run(flown, tmp_path):
    """A copy of the run, to be damaged."""
    return copy_of(flown, tmp_path)


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
    """Damage one file at a time; how often, and how often `verify` did not name it."""
    rng, tried, unseen = np.random.default_rng(seed), 0, []
    for name, path in files_of(run).items():
        whole = path.read_bytes()
        for content in damaged_contents(whole, rng, cuts, flips):
            path.write_bytes(content)
            tried += 1
            if not any(problem.startswith(name) for problem in damage(run)):
                unseen.append((name, len(content)))
        path.write_bytes(whole)
    assert damage(run) == []
    assert unseen == []
    return tried


def test_verify_names_every_file_that_was_cut_or_has_a_flipped_bit(run, record_property):
    record_property("damages", check_all_damage_is_named(run, cuts=3, flips=8, seed=1))


@pytest.mark.slow
def test_verify_names_all_of_fifty_cuts_and_two_hundred_flips_in_each_file(run, record_property):
    tried = check_all_damage_is_named(run, cuts=50, flips=200, seed=2)
    record_property("damages", tried)
    print(f"{tried} of {tried} cuts and flipped bits were named by verify, in {len(files_of(run))} files")


def test_damage_in_all_files_at_once_is_named_file_by_file(run):
    rng = np.random.default_rng(3)
    names = [name for name in files_of(run) if name != "journal.jsonl"]
    for name in names:
        path = run / name
        path.write_bytes(next(damaged_contents(path.read_bytes(), rng, 1, 0)))
    problems = damage(run)
    assert [name for name in names if not any(problem.startswith(name) for problem in problems)] == []


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
    assert len(open_store(run).cases()) == CASES


def test_what_cannot_be_flown_again_is_refused_by_name(run):
    for name in ("campaign.toml", "manifest.json"):
        whole = (run / name).read_bytes()
        (run / name).write_bytes(whole[:-2])
        with pytest.raises(StoreError, match=f"{name}: damaged or edited"):
            runner.resume(run, repair=True)
        (run / name).write_bytes(whole)
    journal = run / "journal.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join([b"?\n", *lines[1:]]))
    with pytest.raises(StoreError, match=r"journal\.jsonl, line 1: damaged"):
        runner.resume(run, repair=True)
    assert journal.read_bytes().startswith(b"?\n")


# ---- extensions, of which a line of the journal alone tells


@pytest.fixture(scope="module")
def grown(tmp_path_factory):
    """A run that was extended twice: 200, 290 and 350 cases."""
    folder = tmp_path_factory.mktemp("grown")
    runner.run(stones(folder / "campaign", CASES), folder / "whole", workers=2, chunk=CHUNK)
    runner.extend(folder / "whole", 290, workers=2, chunk=35)
    return runner.extend(folder / "whole", 350, workers=2, chunk=30)


def all_bytes(run):
    return {name: path.read_bytes() for name, path in files_of(run).items() if name.startswith(RECOMPUTED)}


def spoilt(run, spoil, *events):
    """Spoil all lines of these events; their numbers."""
    journal = run / "journal.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    hit = [number for number, entry in enumerate(scan(b"".join(lines)).entries) if entry.event in events]
    journal.write_bytes(b"".join(spoil(line) if number in hit else line for number, line in enumerate(lines)))
    return [number + 1 for number in hit]


def flipped(line):
    return line[:30] + bytes([line[30] ^ 1]) + line[31:]


@pytest.mark.parametrize("which", [0, 1, slice(None)], ids=["first", "second", "both"])
@pytest.mark.parametrize("spoil", [flipped, lambda line: b"?\n"], ids=["one-bit", "whole-line"])
def test_a_lost_extension_costs_no_case(grown, tmp_path, which, spoil):
    run = tmp_path / "run"
    shutil.copytree(grown.path, run)
    before = all_bytes(run)
    stamps = {name: (run / name).stat().st_mtime_ns for name in before}
    extensions = [entry.number for entry in grown.notes("extended")]
    numbers = np.atleast_1d(extensions[which]).tolist()
    lines = (run / "journal.jsonl").read_bytes().splitlines(keepends=True)
    content = [spoil(line) if number in numbers else line for number, line in enumerate(lines, start=1)]
    (run / "journal.jsonl").write_bytes(b"".join(content))
    assert damage(run) == [f"journal.jsonl, line {number}: damaged" for number in numbers]
    store = runner.resume(run, workers=2, repair=True)
    assert store.n_cases == 350
    assert damage(store.path) == []
    assert all_bytes(run) == before
    assert {name: (run / name).stat().st_mtime_ns for name in before} == stamps


@pytest.mark.parametrize("flown_parts", [0, 1])
def test_an_extension_that_was_broken_off_keeps_what_it_flew_and_can_be_asked_for_again(grown, tmp_path, flown_parts):
    """The session behind the lost line had 60 cases to fly, and was killed before or after the first 30."""
    run = tmp_path / "run"
    shutil.copytree(grown.path, run)
    entries = list(scan((run / "journal.jsonl").read_bytes()).entries)
    second = grown.notes("extended")[1].number
    kept = [encode(entry.number, entry.at, entry.event, entry.facts) for entry in entries[: second + 1 + flown_parts]]
    assert [entry.event for entry in entries[second : len(kept)]] == ["started", "part"][: 1 + flown_parts]
    kept[second - 1] = flipped(kept[second - 1])
    (run / "journal.jsonl").write_bytes(b"".join(kept))
    stops = [entry.facts["first"] + entry.facts["rows"] for entry in entries[: len(kept)] if entry.event == "part"]
    assert runner.resume(run, workers=2, repair=True).n_cases == max(stops) >= 290
    if max(stops) < 350:
        runner.extend(run, 350, workers=2, chunk=30)
    assert damage(run) == []
    assert results(run) == results(grown.path)


def test_a_lost_extension_and_a_lost_part_before_it_cost_the_part_alone(grown, tmp_path):
    run = tmp_path / "run"
    shutil.copytree(grown.path, run)
    before = all_bytes(run)
    extended, part = grown.notes("extended")[1].number, grown.notes("part")[1].number
    lines = (run / "journal.jsonl").read_bytes().splitlines(keepends=True)
    content = [flipped(line) if number in (extended, part) else line for number, line in enumerate(lines, start=1)]
    (run / "journal.jsonl").write_bytes(b"".join(content))
    assert runner.resume(run, workers=2, repair=True).n_cases == 350
    assert all_bytes(run) == before


def test_no_flipped_bit_in_the_line_of_an_extension_takes_a_case_away(grown, tmp_path):
    """Nor one in its newline, which joins it to the next line, nor one that makes a newline in it."""
    run = tmp_path / "run"
    shutil.copytree(grown.path, run)
    journal, number = run / "journal.jsonl", grown.notes("extended")[1].number
    whole = journal.read_bytes()
    begin = sum(len(line) + 1 for line in whole.split(b"\n")[: number - 1])
    length = len(whole.split(b"\n")[number - 1])
    cut = begin + length // 2
    flips = [(place, 1 << place % 8) for place in range(begin, begin + length)]
    flips += [(begin - 1, 4), *((begin + length, 1 << bit) for bit in range(8))]  # of the newlines
    contents = [whole[:place] + bytes([whole[place] ^ bit]) + whole[place + 1 :] for place, bit in flips]
    for content in [*contents, whole[:cut] + b"\n" + whole[cut + 1 :]]:
        journal.write_bytes(content)
        assert [problem for problem in damage(run) if problem.startswith("journal.jsonl, line")]
        mend_journal(run)
        store = open_store(run)
        assert store.n_cases == 350
        assert store.parts == grown.parts
        journal.write_bytes(whole)


def test_a_lost_withdrawal_is_no_extension(run, flown):
    (run / open_store(run).parts[4].file).unlink()
    runner.resume(run, workers=2, repair=True)
    assert spoilt(run, flipped, "part-withdrawn")
    repaired(run, flown)
    assert open_store(run).n_cases == CASES


# ---- shards, and folders


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
