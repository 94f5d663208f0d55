"""Verification of a run directory: every byte against what the journal says was written.

Reads only.  Unlike opening a store, it goes on after the first damage and reports all of it.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from mc_engine.companions import companion_problems
from mc_engine.durable_file import is_temporary, read_file, read_inside
from mc_engine.errors import StoreError
from mc_engine.journal import Scan, scan
from mc_engine.manifest_file import columns_in, parse_manifest
from mc_engine.parts import PART_FOLDERS, Column, Part, arrow_schema, content_problem, is_part_file
from mc_engine.receipts import Receipts, receipts_of
from mc_engine.store import CAMPAIGN, JOURNAL, MANIFEST, NOMINAL, is_run_directory
from mc_engine.writer_lock import holder

# What mends a damage, with the directory of the run in braces.
REPAIR = "`mc-engine resume {0} --repair` flies bad parts again, and removes what does not count"
ORIGINAL = "put back the original of {1}, or fetch a copy of the run; without it no repair can fly anything again"
AWAY = "move {1} out of the run: whatever reads its folder takes it for cases"


@dataclass(frozen=True)
class Damage:
    """What is wrong with a file of the run, in words that begin with its name, and what mends it."""

    what: str
    mended_by: str

    @property
    def file(self) -> str:
        """The file's name in the run directory."""
        return self.what.partition(": ")[0]


def damage(run: Path) -> list[str]:
    """A sentence per damage, beginning with the file's name in `run`; empty if all is as written.

    While a writer is at work, a torn last line and parts without a line are its own business and not reported.
    """
    return [one.what for one in damages(run)]


def remedies(run: Path | str, found: list[Damage]) -> list[str]:
    """A sentence for each kind of damage with what mends it; first what has to be done before all else."""
    sentences = []
    for remedy in (ORIGINAL, AWAY, REPAIR):
        files = list(dict.fromkeys(one.file for one in found if one.mended_by == remedy))
        if files:
            sentences.append(remedy.format(run, ", ".join(files)))
    return sentences


def damages(run: Path) -> list[Damage]:
    """All damage in the directory, with what mends it."""
    if not is_run_directory(run):
        raise StoreError(f"{run}: is no run directory")
    busy = holder(run) is not None
    lying = sorted(_lying(run))  # before the journal: a part committed in between has its line by then
    try:
        journal = scan(read_file(run / JOURNAL))
    except StoreError as error:
        return [Damage(_inner(run, error), ORIGINAL)]
    problems = [Damage(text, ORIGINAL) for text in _head_problems(run, journal)]
    columns, begun_with = (None, None) if problems else _table_of(run)
    counted, wrong = receipts_of(journal.entries, begun_with)
    problems += _line_problems(journal, wrong, busy)
    for part in counted.parts:
        problems += [Damage(text, REPAIR) for text in _part_problems(run, part, columns, is_cases=True)]
        if counted.cases is not None and part.stop > counted.cases:
            problems.append(Damage(f"{part.file}: has cases beyond the {counted.cases} of the run", REPAIR))
    others = [part for part in (counted.nominal, counted.histories) if part is not None]
    for part in others:
        problems += [Damage(text, REPAIR) for text in _part_problems(run, part, None, is_cases=False)]
    if not busy:
        problems += _uncounted(lying, counted)
        problems += _unfinished(journal, counted)
    return problems


def _inner(run: Path, error: StoreError) -> str:
    """The sentence of an error, with the file's name in the run."""
    return str(error).removeprefix(f"{run}/")


def _lying(run: Path) -> Iterator[str]:
    """All that lies where parts do, but for what the next writer removes."""
    if (run / NOMINAL).exists():
        yield NOMINAL
    for folder in PART_FOLDERS:
        if (run / folder).is_symlink() or not (run / folder).is_dir():
            yield folder
            continue
        for path in (run / folder).iterdir():
            if not is_temporary(path.name) or path.is_dir():
                yield f"{folder}/{path.name}"


def _uncounted(lying: list[str], counted: Receipts) -> Iterator[Damage]:
    files = {part.file for part in counted.all_parts()}
    for file in lying:
        if file in PART_FOLDERS:
            yield Damage(f"{file}: is no folder of this run's own", ORIGINAL)
        elif file not in files and (file == NOMINAL or is_part_file(file)):
            yield Damage(f"{file}: has no line in the journal and does not count", REPAIR)
        elif file not in files:
            yield Damage(f"{file}: is not of this run", AWAY)


def _unfinished(journal: Scan, counted: Receipts) -> Iterator[Damage]:
    """A run that has all its cases, and whose session neither came to its end nor said that it was interrupted."""
    told = [entry.event for entry in journal.entries if entry.event in ("started", "rerun", "finished", "interrupted")]
    if counted.cases is None or not told or told[-1] in ("finished", "interrupted"):
        return
    if not counted.missing(range(counted.cases)):
        yield Damage(f"{JOURNAL}: all cases are there, and no line says that the run was finished", REPAIR)


def _line_problems(journal: Scan, wrong: dict[int, str], busy: bool) -> Iterator[Damage]:
    lines = {number: "" for number in journal.damaged} | {number: f", {why}" for number, why in wrong.items()}
    for number, why in sorted(lines.items()):
        yield Damage(f"{JOURNAL}, line {number}: damaged{why}", REPAIR if number > 1 else ORIGINAL)
    if journal.torn and not busy:
        last = len(journal.entries) + len(journal.damaged) + 1
        yield Damage(f"{JOURNAL}, line {last}: torn; the next writer cuts it off", REPAIR)


def _head_problems(run: Path, journal: Scan) -> list[str]:
    """Manifest and campaign against the digests in the journal's first line."""
    if not journal.entries or journal.entries[0].number != 1 or receipts_of(journal.entries[:1])[1]:
        return [f"{JOURNAL}: its first line, the creation, is lost; {MANIFEST} and {CAMPAIGN} cannot be verified"]
    problems, created = [], journal.entries[0].facts
    for key, name in (("manifest", MANIFEST), ("campaign", CAMPAIGN)):
        try:
            content = read_file(run / name)
            if sha256(content).hexdigest() != created[key]:
                problems.append(f"{name}: damaged or edited, its SHA-256 is not the one in the journal")
            elif name == MANIFEST:
                parse_manifest(content)
        except StoreError as error:
            problems.append(_inner(run, error))
        except ValueError as error:
            problems.append(f"{name}: {error}")
    return problems + companion_problems(run, created)


def _table_of(run: Path) -> tuple[tuple[Column, ...], int]:
    """Columns of the case table, and number of cases, by an undamaged manifest."""
    manifest = parse_manifest(read_file(run / MANIFEST))
    return columns_in(manifest), manifest["campaign"]["cases"]


def part_damage(run: Path, part: Part) -> str:
    """What is wrong with the file of a part; empty if its bytes are those that were written."""
    return _content(run, part)[1]


def _content(run: Path, part: Part) -> tuple[bytes, str]:
    try:
        content = read_inside(run, part.file, part.bytes + 1)
    except StoreError as error:
        return b"", str(error).removeprefix(f"{run / part.file}: ")
    return content, content_problem(content, part)


def _part_problems(run: Path, part: Part, columns: tuple[Column, ...] | None, is_cases: bool) -> list[str]:
    content, problem = _content(run, part)
    if problem:
        return [f"{part.file}: {problem}"]
    # From here on only a faulty writer can have done it: the bytes are those that were written.
    try:
        table = pq.read_table(pa.BufferReader(content), page_checksum_verification=True, use_threads=False)
    except (pa.ArrowException, OSError) as error:
        return [f"{part.file}: no readable Parquet file: {error}"]
    if table.num_rows != part.rows:
        return [f"{part.file}: {table.num_rows} rows where the journal says {part.rows}"]
    if columns is not None and not table.schema.equals(arrow_schema(columns), check_metadata=True):
        return [f"{part.file}: its columns are not those of the manifest"]
    return _row_problems(part, table) if is_cases and columns is not None else []


def _row_problems(part: Part, table: pa.Table) -> list[str]:
    problems = []
    if not np.array_equal(table.column("case_id").to_numpy(), np.arange(part.first, part.stop)):
        problems.append(f"{part.file}: its case_id does not count from {part.first} to {part.stop - 1}")
    if Counter(table.column("status").to_pylist()) != part.status:
        problems.append(f"{part.file}: its cases did not end as the journal says")
    return problems
