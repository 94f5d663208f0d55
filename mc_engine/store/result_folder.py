"""The directory of a tuning or of a rare event: a record, tables, and the text of the campaign.

    <stem>.toml   <stem>.json   <table>.parquet ...   journal.jsonl      and reports made from them

The journal records each file with its SHA-256, see `counted_files`.
"""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mc_engine.durable_file import make_folder
from mc_engine.errors import StoreError
from mc_engine.store.counted_files import CountedFiles
from mc_engine.store.journal import plain
from mc_engine.store.manifest_file import columns_in
from mc_engine.store.parts import Column, arrow_schema, arrow_table, attributes, parquet_bytes, parquet_table
from mc_engine.store.result_records import FORMAT, TABLES, parse_result
from mc_engine.store.run_files import JOURNAL, RARE_EVENT, STEMS, TUNING, kind_of
from mc_engine.store.writer_lock import WriterLock

if TYPE_CHECKING:
    import pandas as pd

ColumnsAndArrays = tuple[Sequence[Column], Mapping[str, np.ndarray]]

COMMANDS = {TUNING: "tune", RARE_EVENT: "rare"}


def result_files(path: Path, kind: str) -> CountedFiles:
    """The files of a directory of this kind."""
    tables = "|".join(TABLES[kind])
    return CountedFiles(path, JOURNAL, re.compile(rf"{STEMS[kind]}\.(?:toml|json)|(?:{tables})\.parquet"))


def write_result(
    path: Path,
    kind: str,
    text: str,
    record: Mapping[str, Any],
    tables: Mapping[str, ColumnsAndArrays],
    lock: WriterLock | None = None,
) -> None:
    """Write a result into `path`, in place of an earlier one.  lock : that of `path`, if the caller holds it."""
    make_folder(path)
    files, about = {f"{STEMS[kind]}.toml": text.encode()}, {}
    for name, (columns, arrays) in tables.items():
        rows = len(next(iter(arrays.values())))
        files[f"{name}.parquet"] = parquet_bytes(arrow_table(columns, arrays, rows, path / name))
        about[name] = {"rows": rows, "columns": [asdict(column) for column in columns]}
    whole = {**record, "format": FORMAT, "tables": about}
    content = json.dumps(whole, indent=1, ensure_ascii=False, allow_nan=False, default=plain)
    result_files(path, kind).write({**files, f"{STEMS[kind]}.json": content.encode()}, lock=lock)


def read_result(path: Path, kind: str) -> tuple[dict[str, Any], dict[str, "pd.DataFrame"]]:
    """Record and tables of the result in `path`; StoreError if there is none, or a byte has changed."""
    again = f"`mc-engine {COMMANDS[kind]}` makes one"
    if kind_of(path) != kind:
        raise StoreError(f"{path}: {f'holds no {kind}; {again}' if path.exists() else 'there is no such folder'}")
    if not (path / JOURNAL).exists():
        why = f"an older version of the engine made this {kind}, or the file was removed"
        raise StoreError(f"{path / JOURNAL}: is not there: {why}; {again} anew")
    stem = STEMS[kind]
    names = (f"{stem}.toml", f"{stem}.json", *(f"{name}.parquet" for name in TABLES[kind]))
    contents = result_files(path, kind).read(names)
    try:
        record = parse_result(contents[f"{stem}.json"], kind)
    except ValueError as error:
        raise StoreError(f"{path / stem}.json: {error}") from None
    return record, {name: _result_table(path, name, contents, record) for name in TABLES[kind]}


def _result_table(path: Path, name: str, contents: Mapping[str, bytes], record: Mapping[str, Any]) -> "pd.DataFrame":
    columns = columns_in(record["tables"][name])
    try:
        table = parquet_table(contents[f"{name}.parquet"])
        if not table.schema.equals(arrow_schema(columns)):
            raise ValueError("its columns are not those of the record")
    except ValueError as error:
        raise StoreError(f"{path / name}.parquet: {error}") from None
    frame = table.to_pandas(use_threads=False)
    frame.attrs.update(attributes(columns))
    return frame
