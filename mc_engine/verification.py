"""Verification of a run directory: every byte against what the journal says was written.

Reads only.  Unlike opening a store, it goes on after the first damage and reports all of it.
"""

import json
from dataclasses import fields
from hashlib import sha256
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from mc_engine.companions import companion_problems
from mc_engine.errors import StoreError
from mc_engine.journal import Scan, scan
from mc_engine.parts import PART_FOLDERS, Column, Part, arrow_schema, content_problem, is_part_file
from mc_engine.receipts import counted_nominal, counted_parts, history_receipts
from mc_engine.store import CAMPAIGN, JOURNAL, MANIFEST, is_run_directory
from mc_engine.writer_lock import holder


def damage(run: Path) -> list[str]:
    """A sentence per damage, beginning with the file's name in `run`; empty if all is as written.

    While a writer is at work, a torn last line and parts without a line are its own business and not reported.
    """
    if not is_run_directory(run):
        raise StoreError(f"{run}: is no run directory")
    busy = holder(run) is not None
    found = sorted(_part_files(run))  # before the journal: a part committed in between has its line by then
    try:
        journal = scan((run / JOURNAL).read_bytes())
    except OSError as error:
        return [f"{JOURNAL}: {error.strerror}"]
    problems = _journal_problems(journal, busy)
    head_problems = _head_problems(run, journal)
    problems += head_problems
    columns = None if head_problems else _columns(run)
    committed = counted_parts(journal.entries)
    for part in committed:
        problems += _part_problems(run, part, columns, is_cases=True)
    problems += _overlaps(committed)
    nominal = counted_nominal(journal.entries)
    others = [*([nominal] if nominal else []), *history_receipts(journal.entries)[-1:]]
    for part in others:
        problems += _part_problems(run, part, None, is_cases=False)
    if not busy:
        counted = {part.file for part in (*committed, *others)}
        problems += [f"{file}: has no line in the journal and does not count" for file in found if file not in counted]
    return problems


def _part_files(run: Path) -> list[str]:
    files = [f"{folder}/{path.name}" for folder in PART_FOLDERS for path in (run / folder).glob("*")]
    return [file for file in files if is_part_file(file)]


def _journal_problems(journal: Scan, busy: bool) -> list[str]:
    problems = [f"{JOURNAL}, line {number}: damaged" for number in journal.damaged]
    if journal.torn and not busy:
        last = len(journal.entries) + len(journal.damaged) + 1
        problems.append(f"{JOURNAL}, line {last}: torn; the next writer cuts it off")
    return problems


def _head_problems(run: Path, journal: Scan) -> list[str]:
    """Manifest and campaign against the digests in the journal's first line."""
    if not journal.entries or journal.entries[0].event != "created":
        return [f"{JOURNAL}: its first line, the creation, is lost; {MANIFEST} and {CAMPAIGN} cannot be verified"]
    problems = []
    for key, name in (("manifest", MANIFEST), ("campaign", CAMPAIGN)):
        try:
            if sha256((run / name).read_bytes()).hexdigest() != journal.entries[0].facts[key]:
                problems.append(f"{name}: damaged or edited, its SHA-256 is not the one in the journal")
        except OSError as error:
            problems.append(f"{name}: {error.strerror}")
    return problems + companion_problems(run, journal.entries[0].facts)


def _columns(run: Path) -> list[Column]:
    """The columns of the case table by an undamaged manifest."""
    known = {field.name for field in fields(Column)}
    records = json.loads((run / MANIFEST).read_bytes())["columns"]
    return [Column(**{key: value for key, value in record.items() if key in known}) for record in records]


def part_damage(run: Path, part: Part) -> str:
    """What is wrong with the file of a part; empty if its bytes are those that were written."""
    return _content(run, part)[1]


def _content(run: Path, part: Part) -> tuple[bytes, str]:
    try:
        content = (run / part.file).read_bytes()
    except OSError as error:
        return b"", error.strerror or str(error)
    return content, content_problem(content, part)


def _part_problems(run: Path, part: Part, columns: list[Column] | None, is_cases: bool) -> list[str]:
    content, problem = _content(run, part)
    if problem:
        return [f"{part.file}: {problem}"]
    # From here on only a faulty writer can have done it: the bytes are those that were written.
    try:
        table = pq.read_table(pa.BufferReader(content), page_checksum_verification=True, use_threads=False)
    except (pa.ArrowException, OSError) as error:
        return [f"{part.file}: no readable Parquet file: {error}"]
    problems = []
    if table.num_rows != part.rows:
        problems.append(f"{part.file}: {table.num_rows} rows where the journal says {part.rows}")
    if columns is not None and not table.schema.equals(arrow_schema(columns), check_metadata=True):
        problems.append(f"{part.file}: its columns are not those of the manifest")
    if is_cases and not np.array_equal(table.column("case_id").to_numpy(), np.arange(part.first, part.stop)):
        problems.append(f"{part.file}: its case_id does not count from {part.first} to {part.stop - 1}")
    return problems


def _overlaps(committed: list[Part]) -> list[str]:
    problems: list[str] = []
    furthest: Part | None = None
    for part in sorted(committed, key=lambda part: part.first):
        if furthest is not None and part.first < furthest.stop:
            problems.append(f"{part.file}: repeats cases of {furthest.file}")
        if furthest is None or part.stop > furthest.stop:
            furthest = part
    return problems
