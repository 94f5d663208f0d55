"""The journal of a run directory: what happened, one JSON line an event, in order.

A line is `{"n": 7, "at": ..., "event": ..., facts..., "crc": "89abcdef"}`: its number counts from 1, its CRC-32
covers every byte before the last member.  A line counts once it is synced.  The last line may be torn by a crash:
readers ignore it and the next writer cuts it off.  Any other damaged line is refused with its number.
"""

import json
import os
import re
import zlib
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from mc_engine.durable_file import MOST_OF_JOURNAL, append_synced, read_file
from mc_engine.errors import StoreError
from mc_engine.shell_words import shell_word

_TAIL = re.compile(rb',"crc":"([0-9a-f]{8})"}')
_TAIL_LENGTH = len(b',"crc":"00000000"}')
_SHORTEST = len(b'{"n":1,"at":"","event":"","crc":"00000000"}')  # bytes of a line


@dataclass(frozen=True)
class Entry:
    """One line: its number, UTC time, event and facts."""

    number: int
    at: str
    event: str
    facts: dict[str, Any]


@dataclass(frozen=True)
class Scan:
    """What a journal file holds: the good entries, the bytes up to the last good line, and what is wrong.

    damaged : numbers of the lines that cannot be trusted, the torn last one apart.
    """

    entries: tuple[Entry, ...]
    length: int
    torn: bool
    damaged: tuple[int, ...]


def encode(number: int, at: str, event: str, facts: dict[str, Any]) -> bytes:
    """The bytes of one line, with its newline."""
    record = {"n": number, "at": at, "event": event, **facts}
    body = json.dumps(record, separators=(",", ":"), allow_nan=False, default=plain).encode()[:-1]
    return body + b',"crc":"%08x"}\n' % zlib.crc32(body)


def decode(line: bytes, number: int) -> Entry | None:
    """The entry of a line without its newline; None unless its checksum holds and its number is `number`."""
    entry = _decoded(line)
    return entry if entry is not None and entry.number == number else None


def _decoded(line: bytes) -> Entry | None:
    """The entry of a line, whatever its number; None unless its checksum holds."""
    tail = _TAIL.fullmatch(line[-_TAIL_LENGTH:])
    body = line[:-_TAIL_LENGTH]
    if tail is None or int(tail[1], 16) != zlib.crc32(body):
        return None
    try:
        facts = json.loads(body + b"}")
        number, at, event = facts.pop("n"), facts.pop("at"), facts.pop("event")
    except (ValueError, KeyError, AttributeError, TypeError, RecursionError):
        return None  # a checksum that holds over something that is no event
    plausible = type(number) is int and isinstance(at, str) and isinstance(event, str)
    return Entry(number, at, event, facts) if plausible else None


def scan(content: bytes) -> Scan:
    """Judge every line of a journal's bytes.

    A flipped bit can join two lines, or cut one: the numbers that the lines have tell which are lost, and one that
    counts on from the last good one is good wherever it stands.
    """
    lines = content.split(b"\n")
    rest = lines.pop()  # after the last newline: empty, or a torn line
    entries: list[Entry] = []
    damaged: list[int] = []
    last = unread = 0  # number of the last good line, lines since then
    for line in lines:
        entry = _decoded(line)
        # The last condition bounds what a number that someone made up can cost.
        if entry is None or entry.number < last + 1 + (unread > 0) or entry.number * _SHORTEST > len(content):
            unread += 1
            continue
        damaged += range(last + 1, entry.number)
        entries.append(entry)
        last, unread = entry.number, 0
    torn = bool(rest)
    length = len(content) - len(rest)
    if not torn and unread:
        # The newline of a torn write can reach the disk before the sectors in front of it.
        torn = True
        length -= len(lines[-1]) + 1
        unread -= 1
    damaged += range(last + 1, last + 1 + unread)
    return Scan(tuple(entries), length, torn, tuple(damaged))


def read_journal(path: Path) -> bytes:
    """The bytes of a journal file; StoreError if it is longer than any."""
    return read_file(path, limit=MOST_OF_JOURNAL)


class Journal:
    """A journal file, read whole; `append` adds one synced line.  Appending needs the directory's writer lock."""

    def __init__(self, path: Path):
        """Read `path`; StoreError with the line's number if a line that is not the last is damaged."""
        self.path = path
        content = read_journal(path)
        found = scan(content)
        if found.damaged:
            number = found.damaged[0]
            raise damaged_line(path, number, "its checksum or its number does not hold")
        self.entries = list(found.entries)
        self.torn = found.torn
        self.certain = True  # False from an append that failed on: the file may hold a line that is not in `entries`
        self._length, self._size = found.length, len(content)  # up to the last good line, and in all

    def append(self, event: str, facts: dict[str, Any]) -> Entry:
        """Write and sync one line.  After an error the line does not count and `append` may be tried again."""
        number = len(self.entries) + 1
        line = encode(number, utc_now(), event, facts)
        entry = decode(line[:-1], number)
        assert entry is not None  # just encoded
        if self.certain and os.path.getsize(self.path) != self._size:
            raise StoreError(f"{self.path}: another process has written here; this one stops, and adds nothing")
        self.certain = False
        append_synced(self.path.parent, self.path.name, self._length, line)  # over a torn line, or one that failed
        self._length = self._size = self._length + len(line)
        self.entries.append(entry)
        self.torn, self.certain = False, True
        return entry


def damaged_line(path: Path, number: int, why: str) -> StoreError:
    """What to raise of a line that cannot be trusted, with the way out where there is one."""
    way_out = f"; `mc-engine resume --repair {shell_word(path.parent)}` drops it and flies again what it told of"
    return StoreError(f"{path}, line {number}: damaged, {why}{way_out * (number > 1)}")


def utc_now() -> str:
    """Time of day for a reader's eyes, to the millisecond."""
    return datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def plain(value: Any) -> Any:
    """NumPy scalars and arrays as what JSON knows; TypeError for anything else."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} cannot stand in a run directory's JSON")
