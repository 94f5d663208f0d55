"""Parts that workers had finished when their run was killed, before it came to count them.

Such a part stands under a temporary name that ends in half its SHA-256, or has its own name already and a receipt
beside it.  Where its bytes have their digest it is whole, and its cases need not be flown again.
"""

import json
import re
from collections import Counter
from collections.abc import Iterator
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


_RECEIPT = "cases/.receipt.tmp"


def leave_receipt(run: Path, part: Part) -> None:
    """Note which part gets its name and its line next.

    Not synced, and not missed where the disk refuses: it saves a part after a kill, and nothing rests on it.
    """
    with suppress(StoreError):
        leave(run, _RECEIPT, json.dumps(asdict(part)).encode())


def count_finished(store: "Store") -> None:
    """Commit what is whole among the parts that a killed writer did not come to count; for the holder of the lock."""
    for written in finished_parts(store.path):
        cases = (written.part.first, written.part.stop)
        if store.missing(range(*cases)) == [cases] and cases[1] <= store.wanted.stop:
            store.publish(written)


def finished_parts(run: Path) -> Iterator[Written]:
    """What is whole among the parts of `run` that it did not come to count; their bytes are on the disk."""
    noted = _noted(run)  # first: to commit a part writes another receipt
    if noted is not None and (part := _whole(run, noted.file, noted.file, noted.sha256)):
        yield Written(part, part.file)
    for name in names_in(run, "cases"):
        match = _ASIDE.fullmatch(name)
        if match is not None and (part := _whole(run, f"cases/{name}", f"cases/{match[1]}", match[2])):
            yield Written(part, f"cases/{name}")


def _noted(run: Path) -> Part | None:
    """The part of the last receipt; None if there is none, or it was cut off while it was written."""
    try:
        return receipt_of(json.loads(read_inside(run, _RECEIPT, limit=MOST_OF_TEXT)))
    except (StoreError, ValueError, RecursionError):
        return None


def _whole(run: Path, place: str, file: str, digest: str) -> Part | None:
    """The receipt of the part `file`, which lies in `place`; None if it was killed, or cut off, while it was written.

    digest : its SHA-256, or the beginning of it.
    """
    cases = cases_in_name(file)
    if cases is None:
        return None
    try:
        content = read_inside(run, place)
    except StoreError:  # not there, no file, or longer than any
        return None
    ours = sha256(content).hexdigest()
    if not ours.startswith(digest):
        return None
    sync_file(run, place)
    try:
        status = parquet_table(content, ["status"])["status"].to_pylist()
        facts = {"file": file, "first": cases[0], "rows": len(status), "bytes": len(content), "sha256": ours}
        return receipt_of({**facts, "status": dict(sorted(Counter(status).items()))})
    except (KeyError, ValueError):
        return None
