"""Repair of a run directory: what is damaged counts no more, so that it is missing and can be flown again.

Parts, the nominal case and histories can be flown again; damaged lines of the journal are dropped, and what only they
told of with them.  Campaign, manifest and the journal's first line say what the run is: nothing here replaces them.
"""

from pathlib import Path

from mc_engine.durable_file import read_file, write_durably
from mc_engine.journal import Scan, encode, scan, utc_now
from mc_engine.parts import Part
from mc_engine.store import JOURNAL, Store
from mc_engine.verification import part_damage
from mc_engine.writer_lock import WriterLock


def mend_journal(run: Path) -> None:
    """Drop the damaged lines of a journal, with a note of their numbers; nothing where none is, or the first one is.

    StoreError if another writer is at work.
    """
    if not (run / JOURNAL).is_file() or not _mendable(scan(read_file(run / JOURNAL))):
        return
    lock = WriterLock(run)
    dead = lock.acquire()
    try:
        found = scan(read_file(run / JOURNAL))  # again: another writer may have been here
        if not _mendable(found):
            return
        events = [(entry.at, entry.event, entry.facts) for entry in found.entries]
        events += [(utc_now(), "lock-taken-over", {"from": dead})] if dead is not None else []
        events += [(utc_now(), "mended", {"lost": list(found.damaged)})]
        lines = [encode(number, *event) for number, event in enumerate(events, start=1)]
        write_durably(run / JOURNAL, b"".join(lines))
    finally:
        lock.release()


def _mendable(found: Scan) -> bool:
    return bool(found.damaged) and found.damaged[0] > 1


def withdraw_damaged(store: Store) -> None:
    """Let the parts count no more that are not as they were written, or that hold the same cases as another."""
    twice = _overlapping(store.parts)
    for part in {part.file: part for part in store.parts}.values():
        if part.file in twice or part_damage(store.path, part):
            store.withdraw(part)


def _overlapping(parts: list[Part]) -> set[str]:
    """Files of the parts that share cases with another, as where the line is lost that withdrew one of them."""
    found: set[str] = set()
    furthest: Part | None = None
    for part in sorted(parts, key=lambda part: part.first):
        if furthest is not None and part.first < furthest.stop:
            found |= {part.file, furthest.file}
        if furthest is None or part.stop > furthest.stop:
            furthest = part
    return found
