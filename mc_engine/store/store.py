"""The run directory: the results of a run, and the only interface between engine and reports.

    campaign.toml   manifest.json   journal.jsonl   nominal.parquet   cases/part-*.parquet   history/part-*.parquet

A part is committed once its journal line is synced.  A part without a line was left by a kill: readers ignore it, and
the next writer removes it.  (`pandas.read_parquet(run / "cases")` does not read the journal and includes such a part,
whose rows are correct.)  Manifest and campaign file never change; later events are in the journal.  A `Store` is for
one thread, and one process at a time may write.
"""

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from mc_engine import durable_file as disk
from mc_engine.errors import StoreError
from mc_engine.shell_words import shell_word
from mc_engine.store import parts
from mc_engine.store.finished_parts import count_finished, leave_receipts
from mc_engine.store.histories import history_columns, history_table, read_histories
from mc_engine.store.journal import PUT_BACK, Entry, Journal, damaged_line, encode, utc_now
from mc_engine.store.manifest_file import cases_in, columns_in, edited_files, manifest_bytes, parse_manifest
from mc_engine.store.parts import CASE_COLUMNS, PART_FOLDERS, Column, Part, Written, is_part_file
from mc_engine.store.receipts import Range, receipts_of
from mc_engine.store.run_files import (
    CAMPAIGN,
    CUT_SHORT,
    JOURNAL,
    MANIFEST,
    NO_FOLDER,
    NOMINAL,
    is_run_directory,
    path_of,
)
from mc_engine.store.writer_lock import LOCK_FILES, LOCK_NAME, WriterLock, writer_of_new

if TYPE_CHECKING:
    import pandas as pd

_OURS_BEFORE_THE_JOURNAL = {*LOCK_FILES, CAMPAIGN, MANIFEST, *PART_FOLDERS}


def create_store(
    path: str | Path,
    manifest: Mapping[str, Any],
    campaign_text: str,
    columns: Sequence[Column],
    companions: Mapping[str, bytes] | None = None,
) -> "Store":
    """Make `path` the directory of a new run; its `manifest["columns"]` are set from `columns`.

    columns : of the case table; case_id, status and reason are put first if they are not in it.
    companions : contents by name of files that the campaign reads from its own folder; the run keeps copies.
    StoreError if the directory is not empty, unless an interrupted creation left the files in it.
    """
    path, companions = Path(path), companions or {}
    with writer_of_new(path, lambda: refuse_occupied(path, companions)) as lock:
        names = {column.name for column in CASE_COLUMNS}
        columns = [*CASE_COLUMNS, *(column for column in columns if column.name not in names)]
        record = {**manifest, "columns": [asdict(column) for column in columns]}
        content = manifest_bytes(record)
        text = campaign_text.encode()
        for name, companion in companions.items():
            disk.make_way(path, name)
            disk.write_inside(path, name, companion)
        disk.write_inside(path, CAMPAIGN, text)
        disk.write_inside(path, MANIFEST, content)
        for folder in PART_FOLDERS:
            disk.make_way(path, f"{folder}/*")
        # The journal is written last: a directory without it is no run.
        digests: dict[str, Any] = {"manifest": sha256(content).hexdigest(), "campaign": sha256(text).hexdigest()}
        digests["companions"] = {name: sha256(companion).hexdigest() for name, companion in companions.items()}
        lock.check()
        disk.write_inside(path, JOURNAL, encode(1, utc_now(), "created", digests))
    return Store(path)


def refuse_occupied(path: Path, companions: Iterable[str] = ()) -> None:
    """StoreError if `path` contains a run or any other files, so that no new run can be made there.

    companions : names of files that an interrupted attempt may have left there.
    """
    expected = _OURS_BEFORE_THE_JOURNAL | {Path(name).parts[0] for name in companions}
    with disk.disk_errors(path):
        names = {entry.name for entry in path.iterdir()} if path.exists() else set()
    if JOURNAL in names and is_run_directory(path):
        raise StoreError(f"{path}: holds a run already; `resume` or `extend` it, or choose another folder")
    cut_short = LOCK_NAME in names and all(name in expected or disk.is_temporary(name) for name in names)
    if names and not cut_short:
        raise StoreError(f"{path}: is not empty and holds no run; empty it, or choose another folder")


class Store:
    """A run directory: the case table, the saved time histories, and the journal that records the valid files.

    Its methods raise StoreError for missing or damaged data.  A Store is for one thread, and one process at a time may
    write.  Ranges of cases are half open: (first, stop).

    path : Path, the run directory; `open_store` also takes the URL of a published run

    >>> store = open_store("runs/small")
    >>> store.n_cases, store.missing(), store.status_counts()
    (8, [], {'ok': 8})
    >>> store.cases(["case_id", "apogee_altitude_km"]).attrs["units"]
    {'case_id': '', 'apogee_altitude_km': 'km'}
    """

    def __init__(self, path: str | Path):
        self.path = path = path_of(path, "a run is opened by its path, and {} is none")
        if not is_run_directory(path):
            raise StoreError(f"{path}: is no run directory" if path.exists() else f"{path}: there is no such folder")
        self._lock = WriterLock(path)
        self._read_journal()
        try:
            self.manifest = parse_manifest(self._original(MANIFEST, "manifest"))
        except ValueError as error:
            raise StoreError(f"{path / MANIFEST}: {error}") from None
        self.columns = columns_in(self.manifest)

    def __repr__(self) -> str:
        return f"Store({str(self.path)!r})"

    def _original(self, name: str, fact: str) -> bytes:
        if not os.path.lexists(self.path / name):
            raise StoreError(f"{self.path / name}: is gone; {PUT_BACK}")
        content = disk.read_short(self.path / name)
        if sha256(content).hexdigest() != self._created[fact]:
            why = "damaged or edited, it is not the one this run began with"
            raise StoreError(f"{self.path / name}: {why}; {PUT_BACK}")
        return content

    def _read_journal(self) -> None:
        if not (self.path / JOURNAL).exists():
            raise StoreError(f"{self.path}: has no {JOURNAL}, and so no committed case; `run` the campaign anew")
        self._journal = Journal(self.path / JOURNAL)
        if not self._journal.entries or self._journal.entries[0].event != "created":
            raise damaged_line(self.path / JOURNAL, 1, 'it is not the event "created"')
        self._counted, wrong = receipts_of(self._journal.entries)
        for number, why in wrong.items():
            raise damaged_line(self.path / JOURNAL, number, why)
        self._created = self._journal.entries[0].facts

    def _record(self, event: str, *facts: dict[str, Any]) -> None:
        self._lock.check()
        while facts:
            entries = self._journal.append(event, *facts)
            for entry in entries:
                self._counted.take(entry)
            facts = facts[len(entries) :]

    @property
    def campaign_text(self) -> str:
        """The campaign file as it was flown; StoreError if it has changed since."""
        try:
            return self._original(CAMPAIGN, "campaign").decode()
        except UnicodeDecodeError as error:
            raise StoreError(f"{self.path / CAMPAIGN}: is no text: {error}") from None

    def check_originals(self) -> None:
        """StoreError if manifest, campaign file or a file that the campaign reads has changed since the run began."""
        self._original(MANIFEST, "manifest")
        self._original(CAMPAIGN, "campaign")
        for problem in edited_files(self.path, self._created.get("companions", {})):
            raise StoreError(f"{self.path}/{problem}; {PUT_BACK}")

    # ---- the state of the run, from the journal

    @property
    def parts(self) -> list[Part]:
        """Receipts of all committed parts, in the order of their first case."""
        return list(self._counted.parts)

    @property
    def nominal_part(self) -> Part | None:
        """Receipt of the nominal case, if it was written."""
        return self._counted.nominal

    @property
    def history_part(self) -> Part | None:
        """Receipt of the saved time histories, if any were written."""
        return self._counted.histories

    def notes(self, event: str | None = None) -> list[Entry]:
        """Journal entries in order, all or those of one event."""
        return [entry for entry in self._journal.entries if event is None or entry.event == event]

    @property
    def n_cases(self) -> int:
        """Number of cases of the run, after all extensions."""
        return self._counted.cases(self.manifest["campaign"]["cases"])

    @property
    def wanted(self) -> range:
        """The cases that this directory holds when it is complete: all cases, or those of its shard."""
        return cases_in(self.manifest, self.n_cases)

    def committed(self) -> list[Range]:
        """The committed cases, as merged ranges in order."""
        return self._counted.committed()

    def missing(self, cases: int | range | None = None) -> list[Range]:
        """The ranges that are not committed: among the first `cases`, in a range, or of all expected cases (None)."""
        expected = self.wanted if cases is None else cases if isinstance(cases, range) else range(cases)
        return self._counted.missing(expected)

    def status_counts(self) -> dict[str, int]:
        """Number of committed cases by status, from the journal alone."""
        counts: dict[str, int] = {}
        for part in self.parts:
            for word, count in part.status.items():
                counts[word] = counts.get(word, 0) + count
        return counts

    def lost_files(self) -> list[str]:
        """Names of committed parts and of folders that are missing; `verify` also finds all other damage."""
        files = [*PART_FOLDERS, *(part.file for part in self._counted.all_parts())]
        return [file for file in files if not (self.path / file).exists()]

    @property
    def units(self) -> dict[str, str]:
        """Unit of every column of `cases`."""
        return {column.name: column.unit for column in self.columns}

    # ---- reading

    def cases(self, columns: Sequence[str] | None = None) -> "pd.DataFrame":
        """The case table: one row per committed case, by case_id, with all columns or the named ones.

        `attrs["units"]`, `["descriptions"]` and `["roles"]` describe the columns.  StoreError if a part is damaged.
        """
        if isinstance(columns, str) or not isinstance(columns, Iterable | None):
            raise StoreError(f"{self.path}: {columns!r} is no list of names of columns")
        chosen = self.columns if columns is None else tuple(self._column(name) for name in dict.fromkeys(columns))
        tables = [parts.read_part(self.path, part, chosen) for part in self.parts]
        return _data_frame(tables, chosen)

    def _column(self, name: str) -> Column:
        if named := [column for column in self.columns if column.name == name]:
            return named[0]
        raise StoreError(f'{self.path}: there is no column "{name}"; there are {", ".join(self.units)}')

    def row(self, case_id: int) -> dict[str, Any]:
        """The row of one case, by column name; StoreError if the case is not committed."""
        if not isinstance(case_id, int | np.integer):
            raise StoreError(f"{self.path}: case {case_id!r} is not there; cases are whole numbers, from 0 on")
        for part in self.parts:
            if part.first <= case_id < part.stop:
                return parts.read_part(self.path, part, self.columns).slice(case_id - part.first, 1).to_pylist()[0]
        raise StoreError(f"{self.path}: case {case_id} is not there")

    def nominal(self) -> dict[str, Any]:
        """The nominal case by column name (case_id is -1); empty if none was written."""
        receipt = self.nominal_part
        return parts.read_part(self.path, receipt, self.columns).to_pylist()[0] if receipt else {}

    def histories(self) -> "pd.DataFrame":
        """The saved time histories: case_id, t_s and the outputs; no rows if none were written."""
        quantities, receipt = self.manifest.get("quantities", []), self.history_part
        tables = [read_histories(self.path, receipt, quantities)] if receipt else []
        names = tables[0].column_names if tables else [quantity["name"] for quantity in quantities]
        return _data_frame(tables, history_columns(names, quantities))

    # ---- writing

    @contextmanager
    def lock(self) -> Iterator["Store"]:
        """Hold the writer lock of this directory within the block; blocks may be nested.

        At its start, the complete parts that a killed writer left are committed, and its other files are removed.
        StoreError if another process is writing.
        """
        if self._lock.held:
            self._lock.check()
            yield self
            return
        with self._lock as dead:
            self._read_journal()  # another process may have written since this object was made
            if dead is not None:
                self._record("lock-taken-over", {"from": dead})
                count_finished(self)
            self.sweep()
            yield self

    def sweep(self) -> None:
        """Remove temporary files and parts without a journal line.  The caller holds the lock."""
        self._lock.check()
        if not self._journal.certain:
            self._read_journal()  # after a failed append, only the file tells which parts are committed
        counted = {part.file for part in self._counted.all_parts()}
        for folder in PART_FOLDERS:
            if not (self.path / folder).exists():
                repair = f"`mc-engine resume {shell_word(self.path)} --repair`"
                raise StoreError(f"{self.path / folder}: {NO_FOLDER}; {repair} makes it anew")
            for file in (f"{folder}/{name}" for name in disk.names_in(self.path, folder)):
                if disk.is_temporary(Path(file).name) or (is_part_file(file) and file not in counted):
                    disk.remove_file(self.path, file)
        for name in disk.names_in(self.path):  # not every temporary file: another process may be writing reports
            stray = (name == NOMINAL and self.nominal_part is None) or name in CUT_SHORT
            if stray or (name.startswith(f".{NOMINAL}.") and disk.is_temporary(name)):
                disk.remove_file(self.path, name)

    def append(self, first: int, count: int, columns: Mapping[str, Any]) -> None:
        """Commit the cases first .. first + count - 1; on return they survive a power cut.

        columns : an array of `count` values for each column but case_id; status as words or codes.
        """
        with self.lock():
            self._refuse_overlap(first, count)
            written = parts.write_aside(self.path, self.columns, first, count, columns)
            self._rename(written)
            self._record("part", asdict(written.part))

    def publish(self, *written: Written) -> None:
        """Commit parts that workers wrote by `parts.write_aside`; on return they survive a power cut.

        The names of all parts are synced together, and so are the journal lines of a page.
        """
        with self.lock():
            if written[0].part.file == NOMINAL:
                self._publish_nominal(*written)
                return
            receipts = sorted((one.part for one in written), key=lambda part: part.first)
            for part, before in zip(receipts, (None, *receipts), strict=False):
                self._refuse_overlap(part.first, part.rows, before.stop if before else 0)
            leave_receipts(self.path, receipts)
            self._rename(*written)
            self._record("part", *map(asdict, receipts))

    def _publish_nominal(self, written: Written) -> None:
        if self.nominal_part is not None:
            # Otherwise a kill between file and line would leave the new file with the old line.
            self._record("nominal-withdrawn", {})
        self._rename(written)
        self._record("nominal", asdict(written.part))

    def replace(self, before: Part, written: Written) -> None:
        """Commit a part by `parts.write_aside` in place of `before`, which has the same cases and another name."""
        with self.lock():
            self._rename(written)
            self._record("part-replaced", {**asdict(written.part), "replaces": before.file})
            self._remove(before)

    def _remove(self, before: Part) -> None:
        with suppress(StoreError):  # it is withdrawn already, and the next writer tries again
            disk.remove_file(self.path, before.file)

    def _rename(self, *written: Written) -> None:
        for one in written:
            if not (self.path / one.temporary).exists():
                raise StoreError(
                    f"{self.path / one.part.file}: a worker has written it, and it is not here; all workers must see "
                    "the run directory under the same path"
                )
        disk.publish_all(self.path, [(one.temporary, one.part.file) for one in written])

    def withdraw(self, part: Part) -> None:
        """Withdraw a part, so that its cases are missing again."""
        with self.lock():
            self._record("part-withdrawn", {"file": part.file})
            self._remove(part)

    def _refuse_overlap(self, first: int, count: int, least: int = 0) -> None:
        wanted = [(first, first + count)]
        if count > 0 and (first < least or self.missing(range(*wanted[0])) != wanted):
            raise StoreError(f"{self.path}: some of the cases {first} to {first + count - 1} are committed already")

    def note(self, event: str, /, **facts: Any) -> None:
        """Append another event to the journal: "started", "finished", "extended" (with cases), ..."""
        with self.lock():
            self._record(event, facts)

    def write_nominal(self, row: Mapping[str, Any]) -> None:
        """Commit the nominal case.  row : a value for each column but case_id."""
        arrays = {name: np.asarray([value]) for name, value in {**row, "case_id": -1}.items()}
        with self.lock():
            self.publish(parts.write_aside(self.path, self.columns, -1, 1, arrays))

    def write_histories(self, table: "pd.DataFrame | Mapping[str, Any]") -> None:
        """Commit time histories (case_id, t_s and outputs, one row per sample) in place of earlier ones."""
        arrow = history_table(table, self.manifest.get("quantities", []), self.path / "history")
        with self.lock():
            before = self.history_part
            file = f"history/part-{int(Path(before.file).stem[5:]) + 1 if before else 0:05d}.parquet"
            self._record("history", asdict(parts.write_table(self.path, file, arrow)))
            if before is not None:
                self._remove(before)


def _data_frame(tables: Sequence[pa.Table], columns: Sequence[Column]) -> "pd.DataFrame":
    table = pa.concat_tables(tables) if tables else parts.arrow_schema(columns).empty_table()
    frame = table.to_pandas(use_threads=False)
    frame.attrs.update(parts.attributes(columns))
    return frame
