"""Tables in files next to a campaign file: cases of the design "table", numbers of "empirical" distributions.

CSV (comma, UTF-8, names in the first line) or Parquet.  Every mistake is reported as one sentence with file, row and
column.  File size and number of cells are limited, so that no file fills the memory.
"""

import csv
import io
import math
from collections.abc import Iterator, Sequence
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mc_engine.campaign.sections import LARGEST
from mc_engine.model.files import FileFault, open_beside
from mc_engine.numbers_in_text import counted, is_real

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

MOST_CSV_BYTES, MOST_CSV_CELLS = 2**28, 20_000_000
MOST_PARQUET_BYTES, MOST_PARQUET_CELLS = 2**32, 2**28
MOST_COLUMNS = 10_000
_MOST_LINES = 5  # named in one sentence
_LONGEST_NAME = 60  # written out in one
_PARQUET = (".parquet", ".pq")

_FORMULA = ("=", "+", "-", "@", "\t", "\r")  # a spreadsheet calculates a cell that begins so
_NUMBERS = (int, float, np.number, Decimal)  # of a table that has types
_GUARD = "'"  # which makes it text


def read_columns(path: Path) -> dict[str, np.ndarray]:
    """Column name -> object[n] of text (CSV) or a plain array (Parquet), in the order of the file."""
    if path.suffix.lower() in _PARQUET:
        return _read_parquet(path)
    if path.suffix.lower() not in (".csv", ".txt"):
        raise FileFault(f'"{path.name}" ends in neither .csv nor .parquet')
    return _read_csv(path)


def _read_parquet(path: Path) -> dict[str, np.ndarray]:
    from mc_engine.store.parts import parquet_table

    try:
        with open_beside(path, MOST_PARQUET_BYTES) as file:
            table = parquet_table(file, most=MOST_PARQUET_CELLS)
    except ValueError as error:
        raise FileFault(f'"{path.name}" is not a Parquet file that can be read: {error}') from None
    _check_names(path, table.column_names)
    return {name: _cells(table[name]) for name in table.column_names}


def _cells(column: "pa.ChunkedArray") -> np.ndarray:
    """The cells of a column of Parquet; lists and structures as their text, which is no number."""
    from pyarrow.types import is_nested

    if is_nested(column.type):
        return np.array([str(cell) for cell in column.to_pylist()], dtype=object)
    return np.asarray(column.to_numpy(zero_copy_only=False))


def _read_csv(path: Path) -> dict[str, np.ndarray]:
    with open_beside(path, MOST_CSV_BYTES) as binary:
        lines = io.TextIOWrapper(binary, encoding="utf-8-sig", newline="")
        try:
            return _csv_columns(path, csv.reader(lines, strict=True, skipinitialspace=True))
        except (UnicodeDecodeError, csv.Error) as error:
            raise FileFault(f'"{path.name}" is not CSV text in UTF-8: {error}') from None


def _csv_columns(path: Path, rows: Iterator[list[str]]) -> dict[str, np.ndarray]:
    """The columns of a CSV file; FileFault for a table without names, with ragged rows, or with too many cells."""
    filled = ((line, row) for line, row in enumerate(rows, start=1) if any(cell.strip() for cell in row))
    names = [_without_guard(cell) for cell in next(filled, (0, []))[1]]
    if not names:
        raise FileFault(f'"{path.name}" is empty')
    if len(names) == 1 and (";" in names[0] or "\t" in names[0]):
        raise FileFault(
            f'"{path.name}" has semicolons or tabs between its columns; put commas there, and points in numbers'
        )
    _check_names(path, names)
    columns: list[list[str]] = [[] for _ in names]
    most, ragged = MOST_CSV_CELLS // len(names), []
    for line, row in filled:
        if len(row) != len(names):
            ragged.append(f"line {line}: {counted(len(row), 'field')}")
        elif len(columns[0]) == most:
            raise FileFault(f'"{path.name}" has more than {MOST_CSV_CELLS:,} cells; a Parquet file may have more')
        for column, cell in zip(columns, row, strict=False):
            column.append(_without_guard(cell))
        if len(ragged) > _MOST_LINES:
            break
    if ragged:
        ending = " and more" if len(ragged) > _MOST_LINES else ""
        lines = ", ".join(ragged[:_MOST_LINES])
        raise FileFault(f'"{path.name}", {lines}{ending}; its first line names {counted(len(names), "column")}')
    return {name: np.array(column, dtype=object) for name, column in zip(names, columns, strict=True)}


def _check_names(path: Path, names: list[str]) -> None:
    if len(names) > MOST_COLUMNS:
        raise FileFault(f'"{path.name}" has {len(names):,} columns; at most {MOST_COLUMNS:,} are read')
    for name in names:
        if not name:
            raise FileFault(f'"{path.name}" has a column without a name in its first line')
        if names.count(name) > 1:
            raise FileFault(f'"{path.name}" has the column "{name}" twice')


def csv_text(frame: "pd.DataFrame") -> str:
    """The table as CSV; an apostrophe is put before text that a spreadsheet would evaluate as a formula.

    Numbers keep all their digits.  `read_columns` removes the apostrophes.  OWASP, "CSV Injection".
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


def _without_guard(cell: str) -> str:
    cell = cell.strip()
    return cell[1:] if _is_guarded(cell) else cell


def numbers(path: Path, name: str, cells: np.ndarray) -> np.ndarray:
    """float64[n]: the cells as finite numbers."""
    values = (
        cells.astype(np.float64) if cells.dtype.kind in "fiu" else np.array([_number_or_nan(cell) for cell in cells])
    )
    wrong = np.flatnonzero(~(np.abs(values) <= LARGEST))
    if wrong.size:
        row = wrong[0]
        fault = f"is beyond {LARGEST:g}" if np.isfinite(values[row]) else "is not a finite number"
        raise FileFault(f'"{path.name}", row {row + 1}, column "{name}": "{str(cells[row])[:_LONGEST_NAME]}" {fault}')
    return values


def _number_or_nan(cell: Any) -> float:
    """A cell as a number; NaN for one that is none."""
    known = is_real(cell) if isinstance(cell, str) else type(cell) is not bool and isinstance(cell, _NUMBERS)
    return float(cell) if known else math.nan


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
    """The finite numbers of one column, sorted.  A CSV file with one column needs no name."""
    columns = read_columns(path)
    headless = path.suffix.lower() not in _PARQUET and all(is_real(name) for name in columns)
    if headless and (column is not None or len(columns) > 1):
        raise FileFault(f'"{path.name}" has numbers in its first line; put a line with the names of the columns first')
    if column is None and len(columns) > 1:
        raise FileFault(f'"{path.name}" has {len(columns)} columns; say which with column = "{next(iter(columns))}"')
    name = column if column is not None else next(iter(columns))
    if name not in columns:
        raise FileFault(f'"{path.name}" has no column "{name}"; it has {", ".join(columns)}')
    cells = columns[name]
    if headless:
        cells = np.array([name, *cells], dtype=object)
    if len(cells) == 0:
        raise FileFault(f'"{path.name}" has no numbers below its first line')
    return tuple(sorted(numbers(path, name, cells).tolist()))
