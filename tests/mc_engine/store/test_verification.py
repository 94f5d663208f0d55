from dataclasses import asdict, replace

import numpy as np
import pytest
from small_run import block, filled, row

from mc_engine.errors import StoreError
from mc_engine.store import parts, verification
from mc_engine.store.opening import open_store
from mc_engine.store.repair import mend_journal
from mc_engine.store.verification import damage


def everything(store):
    filled(store)
    store.write_nominal(row(7))
    store.write_histories({"case_id": [3], "t_s": [0.0], "force_n": [1.0]})
    return [path for path in sorted(store.path.rglob("*")) if path.is_file() and path.name != ".lock"]


def test_verify_reports_all_damage_at_once(store):
    files = everything(store)
    for path in files:
        if path.parent.name == "cases":
            path.write_bytes(path.read_bytes()[:-1])
    (store.path / "manifest.json").write_text("{")
    journal = store.path / "journal.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join([lines[0], b"?\n", *lines[2:]]))
    text = "\n".join(verification.damage(store.path))
    assert "journal.jsonl, line 2: damaged" in text
    assert "manifest.json: damaged" in text
    assert text.count("bytes where") == 3  # of four: the line of the first is lost
    assert "part-0000000000-0000000009.parquet: has no line" in text


@pytest.mark.parametrize("left", [b"", b'{"torn', b"damaged\n"], ids=["empty", "torn first line", "other lines"])
def test_without_the_first_line_of_a_journal_the_one_remedy_is_its_original(store, left):
    everything(store)
    journal = store.path / "journal.jsonl"
    if left.endswith(b"\n"):
        left += journal.read_bytes().split(b"\n", 1)[1]
    journal.write_bytes(left)
    mend_journal(store.path)
    assert journal.read_bytes() == left
    problems = verification.damages(store.path)
    [remedy] = verification.remedies("runs/x", problems)
    assert remedy.startswith("put back the original of journal.jsonl, or fetch a copy of the run; without it no repair")
    assert [problem.file for problem in problems] == ["journal.jsonl"]


def test_verify_names_a_part_that_is_gone(store):
    filled(store)
    path = store.path / "cases" / parts.part_name(10, 10)
    path.unlink()
    assert damage(store.path) == [f"cases/{path.name}: No such file or directory"]
    with pytest.raises(StoreError, match=path.name):
        store.cases()


def test_verify_finds_a_part_whose_rows_are_not_those_of_the_journal(store):
    store.append(0, 10, block(0, 10))
    part = store.parts[0]
    store.withdraw(part)
    claim = replace(part, file="cases/part-0000000010-0000000020.parquet", first=10, rows=11, status={"ok": 11})
    with store.lock():
        (store.path / claim.file).write_bytes(block_bytes(store))
        store.note("part", **asdict(claim))
    assert damage(store.path) == [f"{claim.file}: is no part of this run, it has other rows or columns"]


def block_bytes(store):
    """The bytes of the part of the first ten cases."""
    arrays = {**block(0, 10), "case_id": np.arange(10)}
    return parts.parquet_bytes(parts.arrow_table(store.columns, arrays, 10, store.path))


@pytest.mark.parametrize("name", ["manifest.json", "campaign.toml"])
def test_an_edited_manifest_or_campaign_is_refused_by_name(store, name):
    with open(store.path / name, "a") as file:
        file.write("\n")
    with pytest.raises(StoreError, match=rf"{name}: damaged or edited"):
        _ = open_store(store.path).campaign_text


def test_a_run_whose_extension_is_lost_has_the_cases_that_it_flew(store):
    filled(store)
    store.note("extended", cases=60)
    store.append(40, 10, block(40, 10))
    journal = store.path / "journal.jsonl"
    journal.write_bytes(journal.read_bytes().replace(b'"extended"', b'"extender"'))
    mend_journal(store.path)
    again = open_store(store.path)
    assert (again.n_cases, again.missing(), len(again.cases())) == (50, [], 50)
    assert damage(store.path) == []


def test_a_hidden_file_among_the_parts_is_named_only_if_something_reads_it_as_cases(store):
    everything(store)
    (store.path / "cases" / ".DS_Store").write_bytes(b"Bud1")  # of macOS, in every folder that it showed
    assert not [problem for problem in damage(store.path) if ".DS_Store" in problem]
    (store.path / "cases" / "._part-0.parquet").write_bytes(b"\0\5\x16\7")  # of macOS, of each file on a foreign disk
    assert any("cases/._part-0.parquet: is not of this run" in problem for problem in damage(store.path))
