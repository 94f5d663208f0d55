"""Tables that stand beside a campaign file: the cases of the design "table", the numbers of "empirical".

CSV (comma, first line the names) or Parquet.  Every fault is a sentence with file, line and column.
"""

import csv
import io
import json
import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

_MOST_LINES = 5  # named in one sentence
_LONGEST_NAME = 60  # written out in one


_FORMULA = ("=", "+", "-", "@", "\t", "\r")  # a spreadsheet calculates a cell that begins so
_GUARD = "'"  # which makes it text


class FileFault(Exception):
    """What is wrong with the file, as one sentence; the reader of the campaign file adds the place."""


def resolve_beside(directory: Path, reference: str) -> Path:
    """The file `reference`, which must stand in `directory` or below it, and be named from there.

    A run directory holds a copy of it under the same name, which must lead to the copy; so a link keeps its own name.
    """
    home = directory.resolve()
    name = json.dumps(reference if len(reference) <= _LONGEST_NAME else f"{reference[:57]}...", ensure_ascii=False)
    try:
        path = (home / reference).resolve()
        is_file = path.is_file()
    except (OSError, ValueError, RuntimeError):  # too long, with a zero byte, links that go round
        raise FileFault(f"{name} is no name that a file can have") from None
    if not path.is_relative_to(home):
        raise FileFault(f"{name} lies outside the folder of the campaign file; put it beside that file")
    if os.path.isabs(reference) or os.path.normpath(reference).startswith(".."):
        here = json.dumps(path.relative_to(home).as_posix(), ensure_ascii=False)
        raise FileFault(f"{name} leads through other folders than that of the campaign file; write {here}")
    if not is_file:
        raise FileFault(f"there is no file {name} beside the campaign file")
    return home / os.path.normpath(reference)


def read_columns(path: Path) -> dict[str, np.ndarray]:
    """Column name -> object[n] of text (CSV) or a plain array (Parquet), in the order of the file."""
    if path.suffix.lower() in (".parquet", ".pq"):
        return _read_parquet(path)
    if path.suffix.lower() not in (".csv", ".txt"):
        raise FileFault(f'"{path.name}" ends in neither .csv nor .parquet')
    return _read_csv(path)


def _read_parquet(path: Path) -> dict[str, np.ndarray]:
    import pyarrow
    import pyarrow.parquet

    try:
        table = pyarrow.parquet.ParquetFile(path).read(use_threads=False)
    except (pyarrow.ArrowException, OSError) as error:
        raise FileFault(f'"{path.name}" is not a Parquet file that can be read: {error}') from None
    repeated = sorted({name for name in table.column_names if table.column_names.count(name) > 1})
    if repeated:
        raise FileFault(f'"{path.name}" has the column "{repeated[0]}" twice')
    return {name: table[name].to_numpy(zero_copy_only=False) for name in table.column_names}


def _read_csv(path: Path) -> dict[str, np.ndarray]:
    try:
        text = path.read_text(encoding="utf-8-sig")
        rows = list(csv.reader(io.StringIO(text), strict=True))
    except (UnicodeDecodeError, csv.Error) as error:
        raise FileFault(f'"{path.name}" is not CSV text in UTF-8: {error}') from None
    numbered = [(line, row) for line, row in enumerate(rows, start=1) if any(cell.strip() for cell in row)]
    if not numbered:
        raise FileFault(f'"{path.name}" is empty')
    names = [_as_meant(cell) for cell in numbered[0][1]]
    _check_names(path, names)
    ragged = [(line, len(row)) for line, row in numbered[1:] if len(row) != len(names)]
    if ragged:
        lines = ", ".join(f"line {line}: {count} fields" for line, count in ragged[:_MOST_LINES])
        more = f" and {len(ragged) - _MOST_LINES} lines more" if len(ragged) > _MOST_LINES else ""
        raise FileFault(f'"{path.name}", {lines}{more} where {len(names)} columns are named')
    return {
        name: np.array([_as_meant(row[k]) for _, row in numbered[1:]], dtype=object) for k, name in enumerate(names)
    }


def _check_names(path: Path, names: list[str]) -> None:
    for name in names:
        if not name:
            raise FileFault(f'"{path.name}" has a column without a name in its first line')
        if names.count(name) > 1:
            raise FileFault(f'"{path.name}" has the column "{name}" twice')


def csv_text(frame: "pd.DataFrame") -> str:
    """The table as CSV; text in which a spreadsheet would find a formula is guarded by an apostrophe.

    Numbers stay numbers, with all their digits.  `read_columns` takes the apostrophes away again.
    OWASP, "CSV Injection".
    """
    words = {name: frame[name].map(_without_formula) for name in frame.select_dtypes(exclude=["number", "bool"])}
    guarded = frame.assign(**words).rename(columns=_without_formula)
    # A carriage return ends a line for a reader, though not for this writer: it must stand in quotes.
    broken = any("\r" in str(cell) for name in words for cell in words[name])
    quoting = csv.QUOTE_NONNUMERIC if broken else csv.QUOTE_MINIMAL
    return str(guarded.to_csv(index=False, lineterminator="\n", quoting=quoting))


def _without_formula(cell: Any) -> Any:
    text = isinstance(cell, str) and (cell.startswith(_FORMULA) or _is_guarded(cell))
    return _GUARD + cell if text else cell


def _is_guarded(cell: str) -> bool:
    return cell.startswith(_GUARD) and cell.lstrip(_GUARD).startswith(_FORMULA)


def _as_meant(cell: str) -> str:
    cell = cell.strip()
    return cell[1:] if _is_guarded(cell) else cell


def numbers(path: Path, name: str, cells: np.ndarray) -> np.ndarray:
    """float64[n]: the cells as finite numbers."""
    values = np.empty(len(cells))
    for row, cell in enumerate(cells):
        try:
            values[row] = math.nan if isinstance(cell, bool | np.bool_) or cell is None else float(cell)
        except (TypeError, ValueError):
            values[row] = math.nan
        if not math.isfinite(values[row]):
            raise FileFault(f'"{path.name}", row {row + 1}, column "{name}": "{cell}" is not a finite number')
    return values


def words(path: Path, name: str, cells: np.ndarray, choices: Sequence[str]) -> np.ndarray:
    """object[n]: the cells, each one of `choices`."""
    for row, cell in enumerate(cells):
        if cell not in choices:
            raise FileFault(f'"{path.name}", row {row + 1}, column "{name}": "{cell}" is none of {", ".join(choices)}')
    return np.array(list(cells), dtype=object)


def switches(path: Path, name: str, cells: np.ndarray) -> np.ndarray:
    """bool[n]: the cells, each true or false."""
    return words(path, name, np.array([str(cell).lower() for cell in cells], dtype=object), ("true", "false")) == "true"


def empirical_numbers(path: Path, column: str | None) -> tuple[float, ...]:
    """The finite numbers of one column, sorted.  A CSV file of one column may do without a name."""
    columns = read_columns(path)
    if column is None and len(columns) > 1:
        raise FileFault(f'"{path.name}" has {len(columns)} columns; say which with column = "{next(iter(columns))}"')
    name = column if column is not None else next(iter(columns))
    if name not in columns:
        raise FileFault(f'"{path.name}" has no column "{name}"; it has {", ".join(columns)}')
    cells = columns[name]
    if column is None and _is_number(name):
        cells = np.array([name, *cells], dtype=object)
    if len(cells) == 0:
        raise FileFault(f'"{path.name}" has no numbers below its first line')
    return tuple(sorted(numbers(path, name, cells).tolist()))


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False
