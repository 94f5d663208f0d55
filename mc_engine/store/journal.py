"""The journal of a run directory: one JSON line per event, in order.

A line is `{"n": 7, "at": ..., "event": ..., facts..., "crc": "89abcdef"}`: numbered from 1, with a CRC-32 of every byte
before the last member.  A line is valid once it is synced.  The last line may be torn by a crash: readers ignore it and
the next writer removes it.  Any other damaged line is an error that gives its number.
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

PUT_BACK = "put the original back, or fetch a copy of the run"
_TAIL = re.compile(rb',"crc":"([0-9a-f]{8})"}')
_TAIL_LENGTH = len(b',"crc":"00000000"}')
_PAGE = 4096  # bytes that systems hand to the disk together
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
    """Content of a journal file.

    entries : the valid lines.  length : bytes up to the last valid line.  torn : the last line is incomplete.
    damaged : numbers of the other lines that are not valid.
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


def decode(line: bytes) -> Entry | None:
    """The entry of a line without its newline; None unless its checksum holds."""
    tail = _TAIL.fullmatch(line[-_TAIL_LENGTH:])
    body = line[:-_TAIL_LENGTH]
    if tail is None or int(tail[1], 16) != zlib.crc32(body):
        return None
    try:
        facts = json.loads(body + b"}")
        number, at, event = facts.pop("n"), facts.pop("at"), facts.pop("event")
    except (ValueError, KeyError, AttributeError, TypeError, RecursionError):
        return None  # the checksum is right, and the line is no event
    plausible = type(number) is int and isinstance(at, str) and isinstance(event, str)
    return Entry(number, at, event, facts) if plausible else None


def scan(content: bytes) -> Scan:
    """Check every line of a journal.

    A flipped bit can join two lines or split one.  The numbers in the lines tell which are lost; a line whose number
    continues from the last valid one is valid wherever it is in the file.
    """
    lines = content.split(b"\n")
    rest = lines.pop()  # after the last newline: empty, or a torn line
    entries: list[Entry] = []
    damaged: list[int] = []
    last = unread = 0  # number of the last good line, lines since then
    for line in lines:
        entry = decode(line)
        # The last condition bounds the list of damaged lines where a line has an absurd number.
        if entry is None or entry.number < last + 1 + (unread > 0) or entry.number * _SHORTEST > len(content):
            unread += 1
            continue
        damaged += range(last + 1, entry.number)
        entries.append(entry)
        last, unread = entry.number, 0
    torn = bool(rest)
    length = len(content) - len(rest)
    if not torn and unread:
        # The newline of a torn write can reach the disk before the bytes in front of it.
        torn = True
        length -= len(lines[-1]) + 1
        unread -= 1
    damaged += range(last + 1, last + 1 + unread)
    return Scan(tuple(entries), length, torn, tuple(damaged))


def read_journal(path: Path) -> bytes:
    """The bytes of a journal file; StoreError if it is too long to be one."""
    return read_file(path, limit=MOST_OF_JOURNAL)


class Journal:
    """A journal file, read completely.  `append` adds a synced line, and needs the writer lock of the directory."""

    def __init__(self, path: Path):
        """Read `path`; StoreError with the line's number if a line that is not the last is damaged."""
        self.path = path
        content = read_journal(path)
        lines = scan(content)
        if lines.damaged:
            number = lines.damaged[0]
            raise damaged_line(path, number, "its checksum or its number is wrong")
        self.entries = list(lines.entries)
        self.torn = lines.torn
        self.certain = True  # False after an append that failed: the file may hold a line that is not in `entries`
        self._length, self._size = lines.length, len(content)  # up to the last valid line, and in all

    def append(self, event: str, *facts: dict[str, Any]) -> list[Entry]:
        """Write a line of an event and sync it, or several: as many of the first of `facts` as lie in the same page.

        Of several pages a power cut may leave a later one alone, and that would be damage.  After an error the lines
        are not valid, and may be appended again.
        """
        number, at, content = len(self.entries) + 1, utc_now(), b""
        entries: list[Entry] = []
        for one in facts:
            line = encode(number + len(entries), at, event, one)
            if entries and self._length % _PAGE + len(content) + len(line) > _PAGE:
                break
            entry = decode(line[:-1])
            assert entry is not None  # just encoded
            content += line
            entries.append(entry)
        if self.certain and os.path.getsize(self.path) != self._size:
            raise StoreError(f"{self.path}: another process has written here; this process stops and writes nothing")
        self.certain = False
        append_synced(self.path.parent, self.path.name, self._length, content)  # over a torn line, or one that failed
        self._length = self._size = self._length + len(content)
        self.entries += entries
        self.torn, self.certain = False, True
        return entries


def damaged_line(path: Path, number: int, why: str) -> StoreError:
    """The error for a line that is not valid, with the command that repairs the run; line 1 cannot be repaired."""
    way_out = f"`mc-engine resume --repair {shell_word(path.parent)}` drops it and flies again what it recorded"
    return StoreError(f"{path}, line {number}: damaged, {why}; {way_out if number > 1 else PUT_BACK}")


def utc_now() -> str:
    """The time in UTC as text, to the millisecond, for readers; the engine computes nothing from it."""
    return datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def plain(value: Any) -> Any:
    """NumPy scalars and arrays as types that JSON has; TypeError for anything else."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} cannot be written as JSON in a run directory")
