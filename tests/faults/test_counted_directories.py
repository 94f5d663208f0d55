"""Directories of runs, tunings, rare events and published copies: no changed byte in any of their files is missed.

Reports and replays are such files too.  Mutated records end in a sentence, and open nothing outside.
"""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from counted_directories import (
    KINDS,
    PAGES,
    a_rare_event,
    a_run,
    a_tuning,
    files_of,
    verified,
    vouched,
)
from mutated_records import dumped, mutated
from stones import call

from mc_engine.errors import StoreError
from mc_engine.store import counted_files
from mc_engine.store.derived_files import derived_files
from mc_engine.store.run_files import RARE_EVENT, TUNING
from mc_engine.store.verification import damage

RECORDS = {TUNING: ("tuning.json", a_tuning), RARE_EVENT: ("rare.json", a_rare_event)}


@pytest.fixture(scope="module", params=KINDS)
def directory(request, tmp_path_factory):
    """A kind, and a directory of it."""
    return request.param, KINDS[request.param](tmp_path_factory.mktemp("directory"))


def check_flips(kind, folder, flips, seed):
    """Flip random bits, one at a time and the same number in every file; those that `verify` did not name."""
    rng, missed = np.random.default_rng(seed), []
    files = list(files_of(folder).items())
    files = [files[k] for k in rng.permutation(len(files))]
    assert verified(kind, folder).exit_code == 0
    for flip in range(flips):
        name, path = files[flip % len(files)]
        whole = path.read_bytes()
        at = int(rng.integers(8 * len(whole)))
        path.write_bytes(whole[: at // 8] + bytes([whole[at // 8] ^ 1 << at % 8]) + whole[at // 8 + 1 :])
        said = verified(kind, folder)
        assert isinstance(said.exception, SystemExit) or said.exception is None, (name, at, said.exception)
        if said.exit_code != 5 or name not in said.stderr:
            missed.append((name, at))
        path.write_bytes(whole)
    assert verified(kind, folder).exit_code == 0
    assert missed == []


@pytest.mark.parametrize("flips", [None, pytest.param(1000, marks=pytest.mark.slow)])
def test_no_flipped_bit_in_any_file_is_missed(directory, flips, record_property):
    kind, folder = directory
    flips = flips or (6 if kind == "published run" else len(files_of(folder)))
    check_flips(kind, folder, flips, seed=1)
    record_property("flips", flips)


@pytest.mark.parametrize("made", [a_run, a_tuning, a_rare_event])
def test_every_file_that_is_cut_gone_or_not_of_the_directory_is_named(tmp_path, made):
    folder = made(tmp_path)
    for name, path in files_of(folder).items():
        whole = path.read_bytes()
        path.write_bytes(whole[:-1])
        assert any(name in what for what in damage(folder)), name
        path.unlink()
        assert any(name in what for what in damage(folder)), name
        path.write_bytes(whole)
    for name in ("report-figures/figure-2.svg", "replay/case-5.parquet", "report.json", "replay/x"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(b"x")
        assert f"{name}: does not count, derived.jsonl does not name it" in damage(folder)


@pytest.mark.parametrize("kind", RECORDS)
def test_an_edited_probability_or_list_of_files_is_damage_for_every_verb(tmp_path, kind):
    name, made = RECORDS[kind]
    folder = made(tmp_path)
    record = json.loads((folder / name).read_bytes())
    (folder / name).write_text(json.dumps({**record, "files": {}, "probability": 0.25}))
    for verb in ("verify", "status", "report"):
        said = call(verb, folder)
        assert (said.exit_code, isinstance(said.exception, SystemExit)) == (5, True), said.output
        assert f"{name}: damaged" in said.stderr


OUTSIDE = Path("/etc/hostname")
_OPENED = []


@pytest.fixture(scope="module")
def opened():
    """All files outside that are opened from now on."""
    if not _OPENED:
        sys.addaudithook(lambda event, facts: _OPENED.append(str(facts[0])) if event == "open" else None)
        _OPENED.append("")
    return lambda: [path for path in _OPENED if path == str(OUTSIDE) or "victim" in path]


def check_mutations(folder, kind, count, seed, opened):
    """Mutate the record, half of the times with a journal that vouches for it."""
    name, rng = RECORDS[kind][0], np.random.default_rng(seed)
    whole, journal = (folder / name).read_bytes(), (folder / "journal.jsonl").read_bytes()
    for number in range(count):
        content = None
        while content is None:
            content = dumped(mutated(json.loads(whole), rng))
        if number % 2:
            (folder / name).write_bytes(content)
        else:
            vouched(folder, kind, name, content)
        for verb, *options in (("verify",), ("status",), ("report", "--format", "md")):
            said = call(verb, folder, *options)
            assert said.exception is None or isinstance(said.exception, SystemExit), (content, verb, said.exception)
            assert said.exit_code == 5 or (number % 2 == 0 and said.exit_code == 0), (content, verb, said.output)
        (folder / name).write_bytes(whole)
        (folder / "journal.jsonl").write_bytes(journal)
    assert opened() == []


@pytest.mark.parametrize("count", [12, pytest.param(300, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", RECORDS)
def test_mutated_records_end_in_a_sentence_and_open_nothing_outside(tmp_path, kind, count, opened):
    check_mutations(RECORDS[kind][1](tmp_path), kind, count, 3, opened)


# ---- replays


@pytest.mark.parametrize("content", [b"", b"PAR1", None])
def test_a_damaged_replay_is_named_by_verify_refused_by_the_report_and_made_anew_by_replay(tmp_path, content):
    run = a_run(tmp_path)
    table = run / "replay" / "case-17.parquet"
    whole = table.read_bytes()
    table.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]) if content is None else content)
    for verb, *options in (("verify",), ("report", "--format", "md")):
        said = call(verb, run, *options)
        assert (said.exit_code, isinstance(said.exception, SystemExit)) == (5, True), said.output
        assert "replay/case-17.parquet: damaged" in said.stderr
        assert "`mc-engine replay" in said.stderr
    assert call("replay", run, "17").exit_code == 0
    assert table.read_bytes() == whole
    assert damage(run) == []


# ---- what is replaced together


def test_a_kill_at_any_step_leaves_the_old_files_or_the_new_ones(tmp_path, monkeypatch):
    """And what the next writer finds of it, it finishes or removes."""
    steps, after = ("make_way", "write_synced", "append_synced", "publish", "remove_file"), []
    for stop in range(1, 40):
        folder, done = tmp_path / str(stop), []
        folder.mkdir()
        kept = derived_files(folder)
        kept.write({"report.md": b"old", "report-figures/figure-1.svg": b"old", "report-figures/figure-2.svg": b"old"})
        with monkeypatch.context() as patch:
            for name in steps:
                patch.setattr(counted_files, name, stopping(getattr(counted_files, name), done, stop))
            try:
                kept.write({"report.md": b"new", "report-figures/figure-1.svg": b"new"}, alone_in="report-figures")
                break
            except Killed:
                pass
        contents = kept.read()
        after.append(set(contents.values()))
        assert contents["report.md"] == contents["report-figures/figure-1.svg"]
        assert [what for _, what in kept.problems() if "does not count" not in what] == []
        kept.write(PAGES)
        assert {**kept.read(), **PAGES} == {**contents, **PAGES}
        assert not [path for path in folder.rglob("*.tmp")]
    assert after == [{b"old"}] * after.count({b"old"}) + [{b"new"}] * after.count({b"new"})
    assert stop > 8


class Killed(BaseException):
    """A kill: nobody tidies up behind it."""


def stopping(genuine, done, stop):
    def call(*arguments):
        done.append(1)
        if len(done) >= stop:
            raise Killed
        return genuine(*arguments)

    return call


def test_a_damaged_line_about_reports_is_mended_by_the_next_report_alone(tmp_path):
    folder = a_rare_event(tmp_path)
    journal = folder / "derived.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"?" + lines[0][1:] + lines[1])
    assert [what.partition(":")[0] for what in damage(folder)] == ["derived.jsonl, line 1", "report.html", "report.pdf"]
    derived_files(folder).write(PAGES)
    assert damage(folder) == []
    with pytest.raises(StoreError, match=r"report\.json: does not count"):
        derived_files(folder).read(["report.json"])
