"""Repair of a run directory: what is damaged counts no more, so that it is missing and can be flown again.

Parts, the nominal case and histories can be flown again; damaged lines of the journal are dropped, and what only they
told of with them.  Campaign, manifest and the journal's first line say what the run is: nothing here replaces them.
"""

from contextlib import suppress
from hashlib import sha256
from pathlib import Path

from mc_engine.durable_file import read_file, write_durably
from mc_engine.errors import StoreError
from mc_engine.journal import Scan, encode, scan, utc_now
from mc_engine.manifest_file import parse_manifest
from mc_engine.receipts import receipts_of
from mc_engine.store import JOURNAL, MANIFEST, Store
from mc_engine.verification import part_damage
from mc_engine.writer_lock import WriterLock


def mend_journal(run: Path) -> None:
    """Drop the damaged lines of a journal, with a note of their numbers; nothing where none is, or the first one is.

    StoreError if another writer is at work.
    """
    if not (run / JOURNAL).is_file() or not _lost(run, scan(read_file(run / JOURNAL))):
        return
    lock = WriterLock(run)
    dead = lock.acquire()
    try:
        found = scan(read_file(run / JOURNAL))  # again: another writer may have been here
        lost = _lost(run, found)
        if not lost:
            return
        events = [(entry.at, entry.event, entry.facts) for entry in found.entries if entry.number not in lost]
        events += [(utc_now(), "lock-taken-over", {"from": dead})] if dead is not None else []
        events += [(utc_now(), "mended", {"lost": lost})]
        lines = [encode(number, *event) for number, event in enumerate(events, start=1)]
        write_durably(run / JOURNAL, b"".join(lines))
    finally:
        lock.release()


def _lost(run: Path, found: Scan) -> list[int]:
    """Numbers of the lines that cannot be trusted; none if the first one is among them, for which nothing stands in."""
    lost = sorted({*found.damaged, *receipts_of(found.entries, _begun_with(run, found))[1]})
    return lost if lost and lost[0] > 1 else []


def _begun_with(run: Path, found: Scan) -> int | None:
    """Cases by the manifest; None where that is damaged."""
    with suppress(StoreError, ValueError):
        content = read_file(run / MANIFEST)
        if found.entries and sha256(content).hexdigest() == found.entries[0].facts.get("manifest"):
            return int(parse_manifest(content)["campaign"]["cases"])
    return None


def withdraw_damaged(store: Store) -> None:
    """Let the parts count no more that are not as they were written, or whose cases nobody asked for."""
    for part in store.parts:
        if part.stop > store.wanted.stop or part_damage(store.path, part):
            store.withdraw(part)
