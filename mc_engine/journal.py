"""The journal of a run directory: what happened, one JSON line an event, in order.

A line is `{"n": 7, "at": ..., "event": ..., facts..., "crc": "89abcdef"}`: its number counts from 1, its CRC-32
covers every byte before the last member.  A line counts once it is synced.  The last line may be torn by a crash:
readers ignore it and the next writer cuts it off.  Any other damaged line is refused with its number.
"""

import json
import re
import zlib
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from mc_engine.durable_file import naming, plainly, read_file, sync, write_all
from mc_engine.errors import StoreError

_TAIL = re.compile(rb',"crc":"([0-9a-f]{8})"}')
_TAIL_LENGTH = len(b',"crc":"00000000"}')


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
    tail = _TAIL.fullmatch(line[-_TAIL_LENGTH:])
    body = line[:-_TAIL_LENGTH]
    if tail is None or int(tail[1], 16) != zlib.crc32(body):
        return None
    try:
        facts = json.loads(body + b"}")
        if facts.pop("n") != number:
            return None
        at, event = facts.pop("at"), facts.pop("event")
    except (ValueError, KeyError, AttributeError, TypeError, RecursionError):
        return None  # a checksum that holds over something that is no event
    return Entry(number, at, event, facts) if isinstance(at, str) and isinstance(event, str) else None


def scan(content: bytes) -> Scan:
    """Judge every line of a journal's bytes."""
    lines = content.split(b"\n")
    rest = lines.pop()  # after the last newline: empty, or a torn line
    entries = [decode(line, number) for number, line in enumerate(lines, start=1)]
    torn = bool(rest)
    length = len(content) - len(rest)
    if not torn and entries and entries[-1] is None:
        # The newline of a torn write can reach the disk before the sectors in front of it.
        torn = True
        length -= len(lines[-1]) + 1
        entries.pop()
    damaged = tuple(number for number, entry in enumerate(entries, start=1) if entry is None)
    return Scan(tuple(entry for entry in entries if entry is not None), length, torn, damaged)


class Journal:
    """A journal file, read whole; `append` adds one synced line.  Appending needs the directory's writer lock."""

    def __init__(self, path: Path):
        """Read `path`; StoreError with the line's number if a line that is not the last is damaged."""
        self.path = path
        found = scan(read_file(path))
        if found.damaged:
            number = found.damaged[0]
            raise damaged_line(path, number, "its checksum or its number does not hold")
        self.entries = list(found.entries)
        self.torn = found.torn
        self.certain = True  # False from an append that failed on: the file may hold a line that is not in `entries`
        self._length = found.length

    def append(self, event: str, facts: dict[str, Any], judge: Callable[[Entry], None] | None = None) -> Entry:
        """Write and sync one line.  After an error the line does not count and `append` may be tried again.

        judge : called with the line's entry before it is written, to raise where it must not be.
        """
        number = len(self.entries) + 1
        line = encode(number, utc_now(), event, facts)
        entry = decode(line[:-1], number)
        assert entry is not None  # just encoded
        if judge is not None:
            judge(entry)
        self.certain = False
        with naming(self.path), open(self.path, "r+b", buffering=0, opener=plainly) as file:
            file.truncate(self._length)  # a torn line, here or of an append that failed
            file.seek(self._length)
            try:
                write_all(file.fileno(), line)
                sync(file.fileno())
            except OSError:
                with suppress(OSError):  # a whole line whose sync failed must not count for the next reader
                    file.truncate(self._length)
                raise
        self._length += len(line)
        self.entries.append(entry)
        self.torn, self.certain = False, True
        return entry


def damaged_line(path: Path, number: int, why: str) -> StoreError:
    """What to raise of a line that cannot be trusted, with the way out where there is one."""
    way_out = f"; `mc-engine resume --repair {path.parent}` drops it and flies again what it told of"
    return StoreError(f"{path}, line {number}: damaged, {why}{way_out * (number > 1)}")


def utc_now() -> str:
    """Time of day for a reader's eyes, to the millisecond."""
    return datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def plain(value: Any) -> Any:
    """NumPy scalars and arrays as what JSON knows; TypeError for anything else."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} cannot stand in a run directory's JSON")
