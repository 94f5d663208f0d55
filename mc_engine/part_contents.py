"""What is wrong with the files of parts: bytes against their receipts, tables against the manifest.

Bytes that are not those that were written are damage of a disk.  A checksum holds over anything that someone computed
one for: the table that the bytes make is held against what an engine writes there, too.  `verify` names, and a repair
flies again, what these functions find.
"""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from mc_engine.durable_file import read_inside
from mc_engine.errors import StoreError
from mc_engine.history_tables import history_problem
from mc_engine.manifest_file import columns_in
from mc_engine.parts import Column, Part, arrow_schema, content_problem, parquet_table, table_problem
from mc_engine.status import STATUS_NAME

Manifest = dict[str, Any]  # that `parse_manifest` let pass; None where it is damaged


def case_problems(run: Path, part: Part, manifest: Manifest | None) -> list[str]:
    """A sentence for all that is wrong with a part of cases."""
    columns = None if manifest is None else columns_in(manifest)
    table, problem = _table(run, part, columns)
    if problem or columns is None:
        return [problem] if problem else []
    problem = _schema_problem(table, columns)
    if problem:
        return [problem]
    return [] if Counter(table["status"].to_pylist()) == part.status else ["its cases did not end as the journal says"]


def nominal_problems(run: Path, part: Part, manifest: Manifest | None) -> list[str]:
    """A sentence for all that is wrong with the file of the nominal case."""
    columns = None if manifest is None else columns_in(manifest)
    table, problem = _table(run, part, columns)
    problem = problem or ("" if columns is None else _schema_problem(table, columns))
    if problem or manifest is None:
        return [problem] if problem else []
    row = table.to_pylist()[0]
    if row["case_id"] != -1 or row["status"] not in STATUS_NAME.values():
        return ["is no nominal case, which has the case_id -1 and a status"]
    for name, value in _nominal_inputs(manifest).items():
        if name in row and row[name] != value:
            return [f"is not the nominal case of this campaign, {name} is {row[name]} where the manifest says {value}"]
    return []


def history_problems(run: Path, part: Part, manifest: Manifest | None, cases: int | None) -> list[str]:
    """A sentence for all that is wrong with the file of the histories of a run of so many cases."""
    table, problem = _table(run, part, None)
    problem = problem or ("" if manifest is None else history_problem(table, manifest.get("quantities", [])))
    if problem or manifest is None or cases is None:
        return [problem] if problem else []
    ids = np.unique(table["case_id"].to_numpy())
    if ids.size and not (-1 <= ids[0] and ids[-1] < cases):
        return [f"has histories of cases beyond the {cases} of the run"]
    return []


def _table(run: Path, part: Part, columns: Sequence[Column] | None) -> tuple[pa.Table, str]:
    """The table of a part, or what is wrong with its bytes, with the number of its rows, or its columns."""
    try:
        content = read_inside(run, part.file, part.bytes + 1)
    except StoreError as error:
        return None, str(error).removeprefix(f"{run / part.file}: ")
    problem = content_problem(content, part)
    if problem:
        return None, problem
    # From here on only a faulty writer can have done it: the bytes are those that were written.
    try:
        table = parquet_table(content)
    except ValueError as error:
        return None, str(error)
    return table, table_problem(table, part, columns)


def _schema_problem(table: pa.Table, columns: Sequence[Column]) -> str:
    """What is wrong beside names and types: units and meanings, and values that are missing, which NaN is not."""
    if not table.schema.equals(arrow_schema(columns), check_metadata=True):
        return "the units and meanings of its columns are not those of the manifest"
    empty = [column.name for column in columns if column.kind == "number" and table[column.name].null_count]
    return f'its column "{empty[0]}" has missing values, which no engine writes' if empty else ""


def _nominal_inputs(manifest: Manifest) -> dict[str, float]:
    """Nominal values of what is dispersed."""
    inputs = {item["name"]: item.get("nominal") for item in manifest.get("inputs", [])}
    return {name: value for name, value in inputs.items() if isinstance(value, float)}
