"""Recovery of parts that workers had written when the run was killed, but that the journal does not record yet.

The name of such a part is temporary and ends in half its SHA-256; or it is final, and a receipt is next to it.  A part
whose bytes match is complete, and its cases are not flown again.
"""

import json
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

from mc_engine.durable_file import MOST_OF_TEXT, leave, names_in, read_inside, sync_file
from mc_engine.errors import StoreError
from mc_engine.store.parts import Part, Written, cases_in_name, parquet_table
from mc_engine.store.receipts import receipt_of

if TYPE_CHECKING:
    from mc_engine.store.store import Store

_ASIDE = re.compile(r"\.(part-[^/]*\.parquet)\.[0-9a-f]{8}\.([0-9a-f]{32})\.tmp")
_RECEIPTS = "cases/.receipt.tmp"


def leave_receipts(run: Path, parts: Sequence[Part]) -> None:
    """Write which parts are renamed and recorded next.

    Not synced, and errors are ignored: without it a kill can cost these parts, which are then flown again.
    """
    with suppress(StoreError):
        leave(run, _RECEIPTS, json.dumps([asdict(part) for part in parts]).encode())


def count_finished(store: "Store") -> None:
    """Commit the complete parts that a killed writer left unrecorded.  The caller holds the lock."""
    counted: list[Written] = []
    for written in finished_parts(store.path):
        first, stop = written.part.first, written.part.stop
        is_known = any(first < other.part.stop and other.part.first < stop for other in counted)
        if not is_known and store.missing(range(first, stop)) == [(first, stop)] and stop <= store.wanted.stop:
            counted.append(written)
    if counted:
        store.publish(*counted)


def finished_parts(run: Path) -> Iterator[Written]:
    """The complete, unrecorded parts of `run`; on return their bytes are synced to the disk."""
    noted: list[Part] = []
    with suppress(StoreError, ValueError, TypeError, RecursionError):  # there are none, or they are incomplete
        noted = [receipt_of(facts) for facts in json.loads(read_inside(run, _RECEIPTS, limit=MOST_OF_TEXT))]
    for receipt in noted:
        if part := _whole(run, receipt.file, receipt.file, receipt.sha256):
            yield Written(part, part.file)
    for name in names_in(run, "cases"):
        match = _ASIDE.fullmatch(name)
        if match is not None and (part := _whole(run, f"cases/{name}", f"cases/{match[1]}", match[2])):
            yield Written(part, f"cases/{name}")


def _whole(run: Path, present_name: str, file: str, digest: str) -> Part | None:
    """The receipt of the part `file`, whose present name is given; None if the part is incomplete or missing.

    digest : its SHA-256, or the beginning of it.
    """
    cases = cases_in_name(file)
    if cases is None:
        return None
    try:
        content = read_inside(run, present_name)
    except StoreError:  # missing, no regular file, or too long
        return None
    ours = sha256(content).hexdigest()
    if not ours.startswith(digest):
        return None
    sync_file(run, present_name)
    try:
        status = parquet_table(content, ["status"])["status"].to_pylist()
        facts = {"file": file, "first": cases[0], "rows": len(status), "bytes": len(content), "sha256": ours}
        return receipt_of({**facts, "status": dict(sorted(Counter(status).items()))})
    except (KeyError, ValueError):
        return None
