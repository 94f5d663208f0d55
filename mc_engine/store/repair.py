"""Repair of a run directory: damaged parts and journal lines are removed, so that their cases can be flown again.

Campaign, manifest and the first line of the journal define the run; if one of them is damaged, it cannot be repaired.
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
    """Remove the damaged lines of a journal and record their numbers.  No change if none is damaged, or the first is.

    StoreError if another process is writing.
    """
    if is_run_directory(run):
        for folder in PART_FOLDERS:
            make_way(run, f"{folder}/*")
    if not (run / JOURNAL).is_file() or not _damaged_lines(scan(read_journal(run / JOURNAL))):
        return
    with (lock := WriterLock(run)) as dead:
        journal = scan(read_journal(run / JOURNAL))  # again: another process may have written since
        lost = _damaged_lines(journal)
        if not lost:
            return
        events = [(entry.at, entry.event, entry.facts) for entry in journal.entries if entry.number not in lost]
        events += [(utc_now(), "lock-taken-over", {"from": dead})] if dead is not None else []
        events += [(utc_now(), "mended", {"lost": lost})]
        lines = [encode(number, *event) for number, event in enumerate(events, start=1)]
        lock.check()
        write_inside(run, JOURNAL, b"".join(lines))


def _damaged_lines(journal: Scan) -> list[int]:
    """Numbers of the lines that are not valid; empty if line 1 is among them, since nothing can replace it."""
    lost = sorted({*journal.damaged, *receipts_of(journal.entries)[1]})
    return lost if lost and lost[0] > 1 else []


def withdraw_damaged(store: Store) -> None:
    """Withdraw every part of cases that cannot be read as it was written."""
    for part in store.parts:
        if problem_of(store.path / part.file, lambda: read_part(store.path, part, store.columns)):  # noqa: B023
            store.withdraw(part)
