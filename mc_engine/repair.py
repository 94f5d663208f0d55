"""Repair of a run directory: what is damaged counts no more, so that it is missing and can be flown again.

Parts, the nominal case and histories can be flown again; damaged lines of the journal are dropped, and what only they
told of with them.  Campaign, manifest and the journal's first line say what the run is: nothing here replaces them.
"""

import os
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any

from mc_engine.durable_file import make_folder, read_short, write_durably
from mc_engine.errors import StoreError
from mc_engine.journal import Scan, encode, read_journal, scan, utc_now
from mc_engine.lost_extensions import with_lost_extensions
from mc_engine.manifest_file import parse_manifest
from mc_engine.part_contents import case_problems
from mc_engine.parts import PART_FOLDERS
from mc_engine.receipts import receipts_of
from mc_engine.store import JOURNAL, MANIFEST, Store
from mc_engine.writer_lock import WriterLock


def make_folders(run: Path) -> None:
    """Make the folders of the parts where they are gone, with all that lay in them."""
    if (run / JOURNAL).is_file():
        for folder in PART_FOLDERS:
            if not os.path.lexists(run / folder):  # a symbolic link that leads nowhere is refused, not followed
                make_folder(run / folder)


def mend_journal(run: Path) -> None:
    """Drop the damaged lines of a journal, with a note of their numbers; nothing where none is, or the first one is.

    Extensions that the lines behind prove are written anew in their place.
    StoreError if another writer is at work.
    """
    make_folders(run)
    if not (run / JOURNAL).is_file() or not _lost(run, scan(read_journal(run / JOURNAL))):
        return
    lock = WriterLock(run)
    dead = lock.acquire()
    try:
        found = scan(read_journal(run / JOURNAL))  # again: another writer may have been here
        lost = _lost(run, found)
        if not lost:
            return
        kept = with_lost_extensions(found.entries, lost, _manifest(run, found))
        events = [(entry.at, entry.event, entry.facts) for entry in kept]
        events += [(utc_now(), "lock-taken-over", {"from": dead})] if dead is not None else []
        events += [(utc_now(), "mended", {"lost": lost})]
        lines = [encode(number, *event) for number, event in enumerate(events, start=1)]
        write_durably(run / JOURNAL, b"".join(lines))
    finally:
        lock.release()


def _lost(run: Path, found: Scan) -> list[int]:
    """Numbers of the lines that cannot be trusted; none if the first one is among them, for which nothing stands in."""
    manifest = _manifest(run, found)
    cases = manifest["campaign"]["cases"] if manifest else None
    lost = sorted({*found.damaged, *receipts_of(found.entries, cases)[1]})
    return lost if lost and lost[0] > 1 else []


def _manifest(run: Path, found: Scan) -> dict[str, Any] | None:
    """What the manifest says; None where it is damaged."""
    with suppress(StoreError, ValueError):
        content = read_short(run / MANIFEST)
        if found.entries and sha256(content).hexdigest() == found.entries[0].facts.get("manifest"):
            return parse_manifest(content)
    return None


def withdraw_damaged(store: Store) -> None:
    """Let the parts count no more that are not as they were written, or whose cases nobody asked for."""
    for part in store.parts:
        outside = part.first < store.wanted.start or part.stop > store.wanted.stop
        if outside or case_problems(store.path, part, store.manifest):
            store.withdraw(part)
