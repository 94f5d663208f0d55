"""Parts: the Parquet files of a run directory, each with one range of cases or one set of time histories.

Equal columns give equal bytes.  Unit, role and description of a column are in the metadata of its Arrow field, and in
the place from which `pandas.read_parquet` fills `DataFrame.attrs`.  Words have dictionaries; every page has a checksum.
The SHA-256 of a part is verified before it is read.
"""

import json
import re
import uuid
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from mc_engine.durable_file import read_inside, temporary_name, write_inside, write_synced
from mc_engine.errors import DiskError, StoreError
from mc_engine.shell_words import shell_word
from mc_engine.status import STATUS_NAME
from mc_engine.store.run_files import NOMINAL, NOMINAL_CASE

MOST_CELLS = 2**30  # of a Parquet file that is read at once
_MOST_BYTES = 2**31 - 1  # of the words of a column, which Arrow counts in int32
PART_FOLDERS = ("cases", "history")  # of a run directory
_SEE = "; `mc-engine verify"
_CASE_PART = re.compile(r"cases/part-([0-9]{10,18})-([0-9]{10,18})(?:\.r[1-9][0-9]{0,8})?\.parquet")
_HISTORY_PART = re.compile(r"history/part-[0-9]{5,9}\.parquet")
ARROW_TYPES = {"number": pa.float64(), "integer": pa.int64(), "word": pa.string(), "switch": pa.bool_()}
_STREAMS = {pa.float64(): "BYTE_STREAM_SPLIT", pa.int64(): "DELTA_BINARY_PACKED"}
_ROWS_AT_ONCE = 2**16  # that are encoded: of more, the first are out of the cache before the last are made
_PLAIN = {"number": np.dtype(np.float64), "integer": np.dtype(np.int64), "switch": np.dtype(bool)}


@dataclass(frozen=True)
class Column:
    """A column of a table: its name ends in the unit; role is "case", "dispersion", "metric" or "state".

    kind : "number" (float64), "integer" (int64), "word" (string) or "switch" (bool).
    """

    name: str
    unit: str
    role: str
    description: str
    kind: str = "number"


@dataclass(frozen=True)
class Part:
    """Receipt of a part on the disk, as in its journal line.  file : name relative to the run directory."""

    file: str
    first: int
    rows: int
    bytes: int
    sha256: str
    status: dict[str, int]

    @property
    def stop(self) -> int:
        """One past the last case."""
        return self.first + self.rows


@dataclass(frozen=True)
class Written:
    """A part whose bytes are on the disk under a temporary name.  Both names are relative to the run directory."""

    part: Part
    temporary: str


CASE_COLUMNS = (
    Column("case_id", "", "case", "number of the case, from 0; -1 is the nominal", "integer"),
    Column("status", "", "case", "how the case ended", "word"),
    Column("reason", "", "case", "why the case was refused or failed, in words", "word"),
)


def attributes(columns: Sequence[Column]) -> dict[str, dict[str, str]]:
    """The `DataFrame.attrs` of a table: units, descriptions and roles by column name."""
    return {
        "units": {column.name: column.unit for column in columns},
        "descriptions": {column.name: column.description for column in columns},
        "roles": {column.name: column.role for column in columns},
    }


def arrow_schema(columns: Sequence[Column]) -> pa.Schema:
    """The Arrow schema of tables of `columns`."""
    return _schema(tuple(columns))


@lru_cache(maxsize=16)  # each part is compared with it
def _schema(columns: tuple[Column, ...]) -> pa.Schema:
    fields = []
    for column in columns:
        metadata = {"unit": column.unit, "role": column.role, "description": column.description}
        fields.append(pa.field(column.name, ARROW_TYPES[column.kind], metadata=metadata))
    return pa.schema(fields, metadata={"PANDAS_ATTRS": json.dumps(attributes(columns))})


def arrow_table(columns: Sequence[Column], arrays: Mapping[str, Any], n_rows: int, place: Path) -> pa.Table:
    """The table of `columns` from arrays of `n_rows`; StoreError naming `place` and every column that does not fit."""
    names = [column.name for column in columns]
    problems = [f'column "{name}" is missing' for name in names if name not in arrays]
    problems += [f'column "{name}" is not one of this run' for name in arrays if name not in names]
    filled = {}
    for column in columns:
        if column.name not in arrays:
            continue
        values = np.asarray(arrays[column.name])
        if values.shape != (n_rows,):
            problems.append(f'column "{column.name}" has shape {values.shape}, not ({n_rows},)')
            continue
        try:
            filled[column.name] = _arrow_array(column, values)
        except (pa.ArrowException, ValueError, TypeError, KeyError) as error:
            problems.append(f'column "{column.name}" is no {column.kind}: {error}')
    if problems:
        raise StoreError(f"{place}: " + "; ".join(problems))
    return pa.Table.from_arrays([filled[name] for name in names], schema=arrow_schema(columns))


def _arrow_array(column: Column, values: np.ndarray) -> pa.Array:
    """The array of a column.  What a run holds as a rule is handed over as it lies in memory: `pa.array` and
    `pa.scalar` import pandas, which takes longer than many a chunk."""
    if column.name == "status" and values.dtype.kind in "iu":
        codes, positions = np.unique(values, return_inverse=True)
        return _word_array([STATUS_NAME[int(code)] for code in codes], positions)
    if column.kind == "word":
        if (word := _only_word(values)) is not None:
            return _word_array([word], np.zeros(values.size, dtype=np.int64))
        words = values.tolist()
        if all(isinstance(word, str) for word in words):
            distinct = {word: place for place, word in enumerate(dict.fromkeys(words))}
            return _word_array(list(distinct), np.array([distinct[word] for word in words], dtype=np.int64))
        return pa.array(values.astype(object), pa.string(), from_pandas=True).fill_null("")  # NaN of a lost case, too
    if column.kind == "number":
        values = values.astype(np.float64, copy=False)  # NaN stays NaN and does not become null
    kind = ARROW_TYPES[column.kind]
    if values.dtype != _PLAIN.get(column.kind):
        return pa.array(values, kind)
    plain = np.packbits(values, bitorder="little") if column.kind == "switch" else np.ascontiguousarray(values)
    return pa.Array.from_buffers(kind, values.size, [None, pa.py_buffer(plain)], null_count=0)


def _only_word(values: np.ndarray) -> str | None:
    """The word that all of these values are, as a rule those of statuses and reasons."""
    if not values.size or not isinstance(values[0], str):
        return None
    # a list counts its items three times as fast as an array of words compares them, and other threads wait meanwhile
    is_only = values.strides == (0,) or values.tolist().count(values[0]) == values.size
    return str(values[0]) if is_only else None


def _word_array(words: Sequence[str], positions: np.ndarray) -> pa.Array:
    """The words at these positions."""
    texts = [word.encode() for word in words]
    ends = np.append(0, np.array([len(text) for text in texts], dtype=np.int64)[positions].cumsum())
    if ends[-1] > _MOST_BYTES:
        raise ValueError(f"its words have more than {_MOST_BYTES:,} bytes")
    data = texts[0] * positions.size if len(texts) == 1 else b"".join(texts[place] for place in positions.tolist())
    buffers = [None, pa.py_buffer(ends.astype(np.int32)), pa.py_buffer(data)]
    return pa.Array.from_buffers(pa.string(), positions.size, buffers, null_count=0)


def numbers_in(column: pa.ChunkedArray) -> np.ndarray:
    """The numbers of a column that has one in every row, as they are; unlike `to_numpy` it does not import pandas."""
    chunks = [np.from_dlpack(chunk) for chunk in column.chunks]
    return chunks[0] if len(chunks) == 1 else np.concatenate(chunks)


def rows_with(column: pa.ChunkedArray, word: str) -> np.ndarray:
    """Mask of the rows of a column of words that hold this one; without pandas, as `numbers_in`."""
    import pyarrow.compute as pc  # whose import takes a tenth of a second

    (wanted,) = _word_array([word], np.zeros(1, dtype=np.int64))
    return numbers_in(pc.equal(column, wanted).cast(pa.uint8())).astype(bool)


def parquet_bytes(table: pa.Table, history: bool = False) -> bytes:
    """The bytes of a Parquet file of `table`; history : see `_parquet_view`."""
    return bytes(_parquet_view(table, history))


def _parquet_view(table: pa.Table, history: bool = False) -> memoryview:
    """The bytes of a Parquet file of `table`, not copied: other threads would wait meanwhile.

    The numbers of cases are written as streams, the first byte of each, the second and so on: LZ4 makes less of these
    than zstd makes of whole numbers, in half of the time.  history : of time histories, which hold many numbers over
    some rows; zstd finds these, and makes two thirds of what LZ4 makes of the streams.
    """
    words = [field.name for field in table.schema if field.type == pa.string()]
    streams = {field.name: _STREAMS[field.type] for field in table.schema if field.type in _STREAMS}
    sink = pa.BufferOutputStream()
    pq.write_table(
        table,
        sink,
        compression="zstd" if history else "lz4",
        compression_level=1 if history else None,
        column_encoding=None if history else streams,
        use_dictionary=words or False,
        write_statistics=["case_id"] if "case_id" in table.column_names else False,
        write_page_checksum=True,
        write_batch_size=_ROWS_AT_ONCE,
    )
    return memoryview(sink.getvalue())


def is_part_file(file: str) -> bool:
    """True if `file`, relative to the run directory, is the name of a part, as the engine gives them."""
    return _HISTORY_PART.fullmatch(file) is not None or cases_in_name(file) is not None


def cases_in_name(file: str) -> tuple[int, int] | None:
    """The cases (first, stop) of a part by its name, relative to the run directory; None for any other name."""
    match = _CASE_PART.fullmatch(file)
    if match is None:
        return None
    first, last = int(match[1]), int(match[2])
    return (first, last + 1) if file.startswith(f"cases/part-{first:010d}-{last:010d}.") and first <= last else None


def part_name(first: int, rows: int) -> str:
    """File name of the part of cases first .. first + rows - 1; names sort as the cases do."""
    return f"part-{first:010d}-{first + rows - 1:010d}.parquet"


def revised_name(file: str) -> str:
    """The name of the part that replaces `file`: part-….r1.parquet for part-….parquet, then part-….r2.parquet."""
    stem, revision = re.fullmatch(r"(.*?)(?:\.r(\d+))?\.parquet", file).groups()  # type: ignore[union-attr]
    return f"{stem}.r{int(revision or 0) + 1}.parquet"


def write_aside(
    run: Path, columns: Sequence[Column], first: int, count: int, arrays: Mapping[str, Any], file: str | None = None
) -> Written:
    """Write one range of cases under a temporary name, for the writer of the run to publish.

    Needs neither lock nor journal; workers write their parts so and send only the receipt.  The name is unique, since
    two workers may write the same chunk if one was taken for dead.  It ends in the first half of the SHA-256, by which
    `finished_parts` recognises a complete part (half, because Windows limits a path to 260 characters).
    first : NOMINAL_CASE for the nominal case, whose receipt counts no status.
    file : name of the part, relative to the run directory, if not the usual one.
    """
    table = _part_table(run, columns, first, count, arrays)
    content = _parquet_view(table)
    file = file or (NOMINAL if first == NOMINAL_CASE else f"cases/{part_name(first, count)}")
    digest = sha256(content).hexdigest()
    status = {} if first == NOMINAL_CASE else _status_counts(np.asarray(arrays["status"]))
    temporary = temporary_name(f"{file}.{uuid.uuid4().hex[:8]}.{digest[:32]}")
    write_synced(run, temporary, content, file)
    return Written(Part(file, first, count, len(content), digest, status), temporary)


def _status_counts(statuses: np.ndarray) -> dict[str, int]:
    """Status -> how many rows have it, in the order of the alphabet.  statuses : words, or their numbers."""
    if statuses.dtype.kind in "iu":
        codes, counts = np.unique(statuses, return_counts=True)
        return dict(
            sorted((STATUS_NAME[code], count) for code, count in zip(codes.tolist(), counts.tolist(), strict=True))
        )
    if (word := _only_word(statuses)) is not None:
        return {word: statuses.size}
    return dict(sorted(Counter(statuses.tolist()).items()))


def _part_table(run: Path, columns: Sequence[Column], first: int, count: int, arrays: Mapping[str, Any]) -> pa.Table:
    if count < 1 or (first < 0 and (first, count) != (NOMINAL_CASE, 1)):
        raise StoreError(f"{run}: a part cannot have {count} cases from case {first}")
    case_ids = np.arange(first, first + count, dtype=np.int64)
    if "case_id" in arrays and not np.array_equal(arrays["case_id"], case_ids):
        raise StoreError(f"{run}: case_id does not count from {first} to {first + count - 1}")
    return arrow_table(columns, {**arrays, "case_id": case_ids}, count, run)


def write_table(run: Path, file: str, table: pa.Table) -> Part:
    """Write the table of time histories durably as `run`/`file`."""
    content = _parquet_view(table, history=True)
    write_inside(run, file, content)
    return Part(file, 0, table.num_rows, len(content), sha256(content).hexdigest(), {})


def read_part(run: Path, part: Part, columns: Sequence[Column] | None = None) -> pa.Table:
    """The table of a part, with all its columns or with these.

    StoreError that names the file if a byte of it changed, if a column is missing, or if rows or columns are others
    than the receipt and `columns` say.
    """
    path, advice = run / part.file, f"{_SEE} {shell_word(run)}` names all damage"
    try:
        content = read_inside(run, part.file, part.bytes + 1)
    except DiskError:
        raise
    except StoreError as error:
        raise StoreError(f"{error}{advice}") from None
    if problem := content_problem(content, part):
        raise StoreError(f"{path}: {problem}{advice}")
    names = None if columns is None else [column.name for column in columns]
    try:
        table = parquet_table(content, names)
    except ValueError as error:
        raise StoreError(f"{path}: {error}{advice}") from None
    present = set(table.column_names)
    if missing := [name for name in names or () if name not in present]:
        named = "; ".join(f'the column "{name}" is missing' for name in missing)
        raise StoreError(f"{path}: {named}{advice}")
    if table.num_rows != part.rows or not (columns is None or table.schema.equals(arrow_schema(columns))):
        raise StoreError(f"{path}: is no part of this run, it has other rows or columns{advice}")
    return table


def problem_of(path: Path, read: Callable[[], object]) -> str:
    """The problem that `read` raises for the part in `path`; empty if it can be read."""
    try:
        read()
    except StoreError as error:
        return str(error).removeprefix(f"{path}: ").partition(_SEE)[0]
    return ""


def parquet_table(content: Any, names: Sequence[str] | None = None, most: int = MOST_CELLS) -> pa.Table:
    """The table in a Parquet file, with all columns or those of `names` that it has.

    content : its bytes, or an open file.  ValueError if it is no Parquet file, or if its metadata, which are read
    first, give more cells than `most`.
    """
    # Not `pyarrow.parquet.read_table`: it leaves a thread behind, which can abort a process that is about to end.
    try:
        source = pa.BufferReader(content) if isinstance(content, bytes) else content
        file = pq.ParquetFile(source, pre_buffer=False, page_checksum_verification=True)
        sizes = [file.metadata.row_group(k).total_byte_size for k in range(file.metadata.num_row_groups)]
        if max(file.metadata.num_rows * file.metadata.num_columns, *sizes, sum(sizes) // 16, 0) > most:
            raise ValueError(f"it has more than the {most:,} cells that are read at once")
        table = file.read(names, use_threads=False)
        table.validate(full=True)  # words are UTF-8, and offsets lie inside
        return table
    except (pa.ArrowException, OSError, KeyError, OverflowError) as error:
        raise ValueError(f"no readable Parquet file: {next(iter(str(error).splitlines()), '')}") from error


def content_problem(content: bytes, part: Part) -> str:
    """What is wrong with the bytes of a part; empty if they are those that were written."""
    if len(content) > part.bytes:  # `read_part` reads one byte more than the receipt gives
        return f"damaged, more than the {part.bytes} bytes that were written"
    if len(content) < part.bytes:
        return f"damaged, {len(content)} bytes where {part.bytes} were written"
    if sha256(content).hexdigest() != part.sha256:
        return "damaged, its SHA-256 is not the one in the journal"
    return ""
