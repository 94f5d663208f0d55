"""The directory of a tuning: what `mc-engine tune` leaves behind.

    tuning.toml   tuning.json   evaluations.parquet   generations.parquet   front.parquet   report.html   report.pdf

`tuning.json`, the manifest, names each table and holds its digest.  While a search goes on, the tables are written
anew after each generation, as `evaluations-12.parquet`; then the manifest is replaced, and last the tables of the
generation before are removed: whenever the search is killed, the manifest and the tables that it names are whole.
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

MANIFEST, TEXT = "tuning.json", "tuning.toml"
TABLES = ("evaluations", "generations", "front")
UNFINISHED = "not ended"  # instead of why the search ended
FORMAT = 1  # of the directory; the manifest's "format"


@dataclass(frozen=True)
class TuningRecord:
    """A tuning: all of it, or what there is of one that has not ended.

    evaluations : every candidate flown, in order.  front : those of them inside all limits that no other one of these
        beats; no rows if none is inside.  generations : how the search went on.
    """

    path: Path
    manifest: dict[str, Any]
    evaluations: pd.DataFrame
    generations: pd.DataFrame
    front: pd.DataFrame

    @property
    def feasible(self) -> bool:
        """Whether a candidate was found inside all limits."""
        return len(self.front) > 0


def write_tuning(
    path: Path,
    text: str,
    manifest: Mapping[str, Any],
    tables: Mapping[str, tuple[Sequence[Column], Mapping[str, np.ndarray]]],
    mark: str = "",
) -> None:
    """Write a tuning into `path`, in place of what is there of the same search.

    tables : columns and arrays of each of TABLES;  mark : what their files' names end in, none for the last ones.
    """
    make_folder(path)
    write_durably(path / TEXT, text.encode())
    records = {}
    for name in TABLES:
        columns, arrays = tables[name]
        file = f"{name}{mark}.parquet"
        rows = len(next(iter(arrays.values())))
        content = parquet_bytes(arrow_table(columns, arrays, rows, path / file))
        write_durably(path / file, content)
        records[name] = {
            "file": file,
            "rows": rows,
            "sha256": sha256(content).hexdigest(),
            "columns": [asdict(column) for column in columns],
        }
    record = {**manifest, "format": FORMAT, "text_sha256": sha256(text.encode()).hexdigest(), "tables": records}
    content = json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False, default=plain).encode()
    write_durably(path / MANIFEST, content)
    for name in TABLES:
        for old in path.glob(f"{name}-*.parquet"):
            if old.name != records[name]["file"]:
                old.unlink()


def is_tuning_directory(path: str | Path) -> bool:
    """True if `path` holds a tuning, ended or not."""
    return (Path(path) / MANIFEST).is_file()


def open_tuning(path: str | Path) -> TuningRecord:
    """The tuning in directory `path`; StoreError if there is none, or a byte of it changed."""
    path = Path(path)
    if not is_tuning_directory(path):
        raise StoreError(
            f"{path}: is no directory of a tuning" if path.exists() else f"{path}: there is no such folder"
        )
    try:
        manifest = json.loads(read_file(path / MANIFEST))
    except ValueError as error:
        raise StoreError(f"{path / MANIFEST}: damaged, {error}") from None
    if manifest.get("format", FORMAT) > FORMAT:
        raise StoreError(f"{path}: was written by a newer engine; this one reads format {FORMAT}")
    _whole(path / TEXT, manifest["text_sha256"])
    return TuningRecord(path, manifest, **{name: _table(path, name, manifest["tables"][name]) for name in TABLES})


def _whole(file: Path, digest: str) -> bytes:
    """The bytes of a file; StoreError if they are not those of the digest."""
    content = read_file(file)
    if sha256(content).hexdigest() != digest:
        raise StoreError(f"{file}: damaged, its SHA-256 is not the one in {MANIFEST}")
    return content


def _table(path: Path, name: str, record: Mapping[str, Any]) -> pd.DataFrame:
    content = _whole(path / record["file"], record["sha256"])
    frame = parquet_table(content).to_pandas(use_threads=False)
    frame.attrs.update(attributes([Column(**column) for column in record["columns"]]))
    return frame


def outcome_lines(record: TuningRecord) -> list[str]:
    """How the search ended, for the command line."""
    tuning, evaluations = record.manifest["tuning"], record.evaluations
    inside = int(evaluations["feasible"].sum())
    lines = [
        f"candidates   {len(evaluations):,} in {tuning['flown']} generations ({tuning['end']}), {inside:,} feasible"
    ]
    if not record.feasible:
        return [*lines, f"front        {infeasibility(record)}"]
    lines.append(f"front        {len(record.front)} candidates")
    units = record.front.attrs["units"]
    for one in tuning["objectives"]:
        values = record.front[one["name"]]
        lines.append(f"  {one['name']}  {values.min():.6g} to {values.max():.6g} {units[one['name']]}".rstrip())
    return lines


def infeasibility(record: TuningRecord) -> str:
    """Why there is no front, in a sentence with the least violation found."""
    tried = f"no feasible point among {len(record.evaluations):,} candidates"
    row = least_violating(record)
    if row is None:
        return f"{tried}; none of them has a number for every metric{_commonest(record.evaluations)}"
    units = record.evaluations.attrs["units"]
    broken = []
    for one in record.manifest["tuning"]["constraints"]:
        value, unit = float(row[one["name"]]), units[one["name"]]
        for word, limit, sign in (("at most", one["at_most"], 1.0), ("at least", one["at_least"], -1.0)):
            if limit is not None and sign * (value - limit) > 0.0:
                broken.append(f"{one['name']} {value:.4g}{' ' * bool(unit)}{unit} where {word} {limit:g} is allowed")
    return f"{tried}; the least violation found is {float(row['violation']):.4g}: {', '.join(broken)}"


def _commonest(evaluations: pd.DataFrame) -> str:
    """The end that most of the candidates' failed cases came to, as an end of a sentence."""
    ends = evaluations["commonest_failure"][evaluations["failed_cases"] > 0].value_counts(sort=False)
    return f", most often ({ends.max():,} candidates) {ends.idxmax()}" if len(ends) else ""


def least_violating(record: TuningRecord) -> pd.Series | None:
    """The candidate nearest to the limits; None if none has a number for every metric."""
    violation = record.evaluations["violation"]
    return record.evaluations.loc[violation.idxmin()] if np.isfinite(violation.min()) else None
