"""The directory of a rare event's estimate: what `mc-engine rare` leaves behind.

    rare.toml   rare.json   cases.parquet   report.html   report.pdf

`rare.json` holds the result, how it came about, and the digests of the other two files; it is written last.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from mc_engine.durable_file import make_folder, read_file, write_durably
from mc_engine.errors import StoreError
from mc_engine.journal import plain
from mc_engine.parts import Column, arrow_table, attributes, parquet_bytes, parquet_table

RECORD, TEXT, CASES = "rare.json", "rare.toml", "cases.parquet"
FORMAT = 1  # of the directory; the record's "format"


@dataclass(frozen=True)
class RareEventRecord:
    """An estimate: record is what rare.json holds, cases every case flown for it, in order."""

    path: Path
    record: dict[str, Any]
    cases: pd.DataFrame

    @property
    def result(self) -> dict[str, Any]:
        return self.record["rare_event"]


def write_rare_event(
    path: Path,
    text: str,
    record: Mapping[str, Any],
    columns: Sequence[Column],
    arrays: Mapping[str, np.ndarray],
) -> None:
    """Write an estimate into the new directory `path`."""
    make_folder(path)
    write_durably(path / TEXT, text.encode())
    rows = len(next(iter(arrays.values())))
    content = parquet_bytes(arrow_table(columns, arrays, rows, path / CASES))
    write_durably(path / CASES, content)
    files = {TEXT: sha256(text.encode()).hexdigest(), CASES: sha256(content).hexdigest()}
    whole = {**record, "format": FORMAT, "files": files, "columns": [asdict(column) for column in columns]}
    written = json.dumps(whole, indent=1, ensure_ascii=False, allow_nan=False, default=plain)
    write_durably(path / RECORD, written.encode())


def is_rare_event_directory(path: str | Path) -> bool:
    """True if `path` holds the estimate of a rare event."""
    return (Path(path) / RECORD).is_file()


def open_rare_event(path: str | Path) -> RareEventRecord:
    """The estimate in directory `path`; StoreError if there is none, or a byte of it changed."""
    path = Path(path)
    if not is_rare_event_directory(path):
        raise StoreError(
            f"{path}: holds no rare event; `mc-engine rare` makes one"
            if path.exists()
            else f"{path}: there is no such folder"
        )
    try:
        record = json.loads(read_file(path / RECORD))
    except ValueError as error:
        raise StoreError(f"{path / RECORD}: damaged, {error}") from None
    if record.get("format", FORMAT) > FORMAT:
        raise StoreError(f"{path}: was written by a newer engine; this one reads format {FORMAT}")
    content = {name: read_file(path / name) for name in (TEXT, CASES)}
    for name, digest in record["files"].items():
        if sha256(content[name]).hexdigest() != digest:
            raise StoreError(f"{path / name}: damaged, its SHA-256 is not the one in {RECORD}")
    cases = parquet_table(content[CASES]).to_pandas(use_threads=False)
    cases.attrs.update(attributes([Column(**column) for column in record["columns"]]))
    return RareEventRecord(path, record, cases)
