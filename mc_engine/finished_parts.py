"""Parts that workers had finished when their run was killed, before it came to count them.

Such a part stands under a temporary name that ends in its SHA-256, or has its own name already and a receipt beside it.
Where its bytes have their digest it is whole, and its cases need not be flown again.
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

import pyarrow as pa
import pyarrow.parquet as pq

from mc_engine.durable_file import read_file, sync_file, write_all
from mc_engine.parts import Part, Written, is_part_file

if TYPE_CHECKING:
    from mc_engine.store import Store

_ASIDE = re.compile(r"\.(part-(\d+)-\d+\.parquet)\.[0-9a-f]{32}\.([0-9a-f]{64})\.tmp")


_RECEIPT = "cases/.receipt.tmp"


def leave_receipt(run: Path, part: Part) -> None:
    """Note which part gets its name and its line next.

    Not synced, and not missed where the disk refuses: it saves a part after a kill, and nothing rests on it.
    """
    with suppress(OSError), open(run / _RECEIPT, "wb", buffering=0) as file:
        write_all(file.fileno(), json.dumps(asdict(part)).encode())


def count_finished(store: "Store") -> None:
    """Commit what is whole among the parts that a killed writer did not come to count; for the holder of the lock."""
    for written in finished_parts(store.path):
        cases = (written.part.first, written.part.stop)
        if store.missing(range(*cases)) == [cases] and cases[1] <= store.wanted.stop:
            store.publish(written)


def finished_parts(run: Path) -> Iterator[Written]:
    """What is whole among the parts of `run` that it did not come to count; their bytes are on the disk."""
    noted = _noted(run)  # first: to commit a part writes another receipt
    if noted is not None and is_part_file(noted.file) and (run / noted.file).exists():
        part = _whole(run / noted.file, noted.file, noted.first, noted.sha256)
        if part is not None:
            yield Written(part, part.file)
    for path in sorted((run / "cases").iterdir()):
        match = _ASIDE.fullmatch(path.name)
        if match is not None and (part := _whole(path, f"cases/{match[1]}", int(match[2]), match[3])):
            yield Written(part, f"cases/{path.name}")


def _noted(run: Path) -> Part | None:
    """The part of the last receipt; None if there is none, or it was cut off while it was written."""
    try:
        return Part(**json.loads((run / _RECEIPT).read_bytes()))
    except (OSError, ValueError, TypeError):
        return None


def _whole(path: Path, file: str, first: int, digest: str) -> Part | None:
    """The receipt of the part in `path`; None if it was killed, or cut off, while it was written."""
    content = read_file(path)
    if sha256(content).hexdigest() != digest:
        return None
    sync_file(path)
    status = pq.read_table(pa.BufferReader(content), columns=["status"], use_threads=False)["status"].to_pylist()
    return Part(file, first, len(status), len(content), digest, dict(sorted(Counter(status).items())))
