import json
import os

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mc_engine.durable_file import append_synced
from mc_engine.errors import StoreError
from mc_engine.store.journal import Journal, decode, encode, scan

AT = "2026-01-01T00:00:00.000Z"
LINES = [encode(n, AT, "part", {"first": 10 * (n - 1), "rows": 10, "file": f"cases/part-{n}"}) for n in range(1, 5)]
WHOLE = b"".join(LINES)

facts = st.dictionaries(
    st.text(min_size=1).filter(lambda key: key not in ("n", "at", "event", "crc")),
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
)


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "journal.jsonl"
    path.write_bytes(WHOLE)
    return path


@given(event=st.text(), facts=facts)
def test_a_line_gives_back_the_event_and_facts_it_was_made_of(event, facts):
    line = encode(7, AT, event, facts)
    entry = decode(line[:-1])
    assert (entry.number, entry.at, entry.event, entry.facts) == (7, AT, event, facts)
    assert line.count(b"\n") == 1
    assert json.loads(line)["n"] == 7


@pytest.mark.parametrize("number", [0, 3])
@pytest.mark.parametrize("bit", range(8))
def test_any_flipped_bit_makes_a_line_worthless(number, bit):
    line = LINES[number][:-1]
    for place in range(len(line)):
        flipped = bytearray(line)
        flipped[place] ^= 1 << bit
        assert decode(bytes(flipped)) is None, place


@pytest.mark.parametrize("kept", range(len(LINES[3])))
def test_every_cut_of_the_last_line_loads_the_lines_before_it(path, kept):
    path.write_bytes(WHOLE[: len(WHOLE) - len(LINES[3]) + kept])
    journal = Journal(path)
    assert len(journal.entries) == 3
    assert journal.torn == (kept > 0)


def test_a_lost_line_in_the_middle_is_refused_with_its_number(path):
    path.write_bytes(LINES[0] + LINES[2] + LINES[3])
    with pytest.raises(StoreError, match="line 2: damaged"):
        Journal(path)


def test_a_scan_names_every_damaged_line():
    found = scan(LINES[0] + b"x\n" + LINES[2] + b"y\n" + encode(5, AT, "z", {}))
    assert found.damaged == (2, 4)
    assert [entry.number for entry in found.entries] == [1, 3, 5]


@pytest.mark.parametrize("line", [0, 1, 2])
def test_a_flipped_newline_costs_the_two_lines_it_joins_alone(line):
    lines = [*LINES, encode(5, AT, "z", {}), encode(6, AT, "z", {})]
    lines[line] = lines[line][:-1] + b"\x0b"
    found = scan(b"".join(lines))
    assert found.damaged == (line + 1, line + 2)
    assert [entry.number for entry in found.entries] == sorted({1, 2, 3, 4, 5, 6} - {line + 1, line + 2})
    assert not found.torn


def test_a_line_that_stands_twice_is_damage_and_so_is_a_number_beyond_all_lines():
    assert scan(LINES[0] + LINES[1] + LINES[1] + LINES[2] + LINES[3]).damaged == (3,)
    far = encode(10**15, AT, "z", {})
    assert scan(LINES[0] + far + LINES[2]).damaged == (2,)


def test_an_appended_line_is_there_for_the_next_reader(path):
    journal = Journal(path)
    journal.append("finished", {"seconds": 2.5})
    again = Journal(path)
    assert again.entries[-1].number == 5
    assert again.entries[-1].event == "finished"
    assert again.entries[-1].facts == {"seconds": 2.5}
    assert again.entries == journal.entries


def test_lines_of_one_event_are_written_together_but_for_those_of_another_page(path, monkeypatch):
    journal, written = Journal(path), []
    monkeypatch.setattr(
        "mc_engine.store.journal.append_synced",
        lambda root, name, at, content: (written.append((at, content)), append_synced(root, name, at, content)),
    )
    facts = [{"file": "x" * 150, "first": number} for number in range(100)]
    left = facts
    while left:
        left = left[len(journal.append("part", *left)) :]
    assert [entry.facts for entry in Journal(path).entries[4:]] == facts
    assert len(written) < 20
    for at, content in written:
        assert content.count(b"\n") == 1 or at // 4096 == (at + len(content) - 1) // 4096


# shorter and longer than the new line; and with a newline that was on the disk before the bytes in front of it
@pytest.mark.parametrize("torn", [LINES[0][:17], b"x" * 500, bytes(40) + b"\n"], ids=["short", "long", "zeros"])
def test_appending_cuts_a_torn_line_off_first(path, torn):
    path.write_bytes(WHOLE + torn)
    Journal(path).append("finished", {})
    content = path.read_bytes()
    assert content.startswith(WHOLE)
    assert scan(content).damaged == ()
    assert not scan(content).torn
    assert len(Journal(path).entries) == 5


@pytest.mark.parametrize("broken", ["fsync", "write"])
def test_an_append_that_failed_does_not_count_and_can_be_tried_again(path, monkeypatch, broken):
    journal = Journal(path)
    with monkeypatch.context() as patch:
        patch.setattr(os, broken, _full_disk if broken == "fsync" else _half_written)
        with pytest.raises(StoreError, match=r"journal\.jsonl: "):
            journal.append("lost", {})
    assert len(journal.entries) == 4
    assert path.read_bytes() == WHOLE
    journal.append("kept", {})
    assert [entry.event for entry in Journal(path).entries] == ["part"] * 4 + ["kept"]


def _full_disk(*_):
    raise OSError(28, "No space left on device")


def _half_written(descriptor, content, genuine=os.write):
    """The disk takes all but fifteen bytes, and then no more."""
    if len(content) < 20:
        _full_disk()
    return genuine(descriptor, content[:-15])
