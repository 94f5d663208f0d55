"""Repair of a run directory: what is damaged counts no more, so that it is missing and can be flown again.

Parts, the nominal case and histories can be flown again; damaged lines of the journal are dropped, and what only they
told of with them.  Campaign, manifest and the journal's first line say what the run is: nothing here replaces them.
"""

from pathlib import Path

from mc_engine.durable_file import make_way, write_inside
from mc_engine.store.journal import Scan, encode, read_journal, scan, utc_now
from mc_engine.store.parts import PART_FOLDERS, problem_of, read_part
from mc_engine.store.receipts import receipts_of
from mc_engine.store.run_files import JOURNAL, is_run_directory
from mc_engine.store.store import Store
from mc_engine.store.writer_lock import WriterLock


def mend_journal(run: Path) -> None:
    """Drop the damaged lines of a journal, with a note of their numbers; nothing where none is, or the first one is.

    StoreError if another writer is at work.
    """
    if is_run_directory(run):
        for folder in PART_FOLDERS:
            make_way(run, f"{folder}/*")
    if not (run / JOURNAL).is_file() or not _lost(scan(read_journal(run / JOURNAL))):
        return
    with (lock := WriterLock(run)) as dead:
        found = scan(read_journal(run / JOURNAL))  # again: another writer may have been here
        lost = _lost(found)
        if not lost:
            return
        events = [(entry.at, entry.event, entry.facts) for entry in found.entries if entry.number not in lost]
        events += [(utc_now(), "lock-taken-over", {"from": dead})] if dead is not None else []
        events += [(utc_now(), "mended", {"lost": lost})]
        lines = [encode(number, *event) for number, event in enumerate(events, start=1)]
        lock.check()
        write_inside(run, JOURNAL, b"".join(lines))


def _lost(found: Scan) -> list[int]:
    """Numbers of the lines that cannot be trusted; none if the first one is among them, for which nothing stands in."""
    lost = sorted({*found.damaged, *receipts_of(found.entries)[1]})
    return lost if lost and lost[0] > 1 else []


def withdraw_damaged(store: Store) -> None:
    """Let the parts count no more that are not as they were written."""
    for part in store.parts:
        if problem_of(store.path / part.file, lambda: read_part(store.path, part, store.columns)):  # noqa: B023
            store.withdraw(part)
