"""Sets of files that a journal records, so that files written together are replaced together.

    {"n": 2, ..., "event": "files", "files": [{"file": "report.html", "bytes": 4711, "sha256": ...}], "removed": []}

Used for the results of `tune` and `rare`, and for reports and replays in any directory.  Each file is first written
completely under a temporary name, then one journal line records them all, then each file is renamed.  After a kill or
a power cut either the old or the new files are valid: a recorded file that still has its temporary name is read under
that name, and the next writer renames it.
"""

import os
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from mc_engine.durable_file import (
    append_synced,
    is_temporary,
    make_way,
    names_in,
    publish,
    read_inside,
    remove_file,
    sync_names,
    temporary_name,
    write_inside,
    write_synced,
)
from mc_engine.errors import StoreError
from mc_engine.store.journal import Scan, encode, read_journal, scan, utc_now
from mc_engine.store.receipts import Digest
from mc_engine.store.writer_lock import LOCK_NAME, WriterLock, holder

_EVENT = "files"


class _Receipt(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)

    file: str
    bytes: Annotated[int, Field(ge=0)]
    sha256: Digest


class _Line(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)

    files: list[_Receipt]
    removed: list[str] = []


@dataclass(frozen=True)
class _State:
    """Content of a journal, the receipts of the files that it records, and by line number what is damaged."""

    content: bytes
    lines: Scan
    receipts: Mapping[str, _Receipt]
    damage: Mapping[int, str]


class CountedFiles:
    """The files of the directory `root` that the journal of this name records.

    names : pattern of the files' names, relative to `root`.  folders : folders in `root` that hold only such files.
    """

    def __init__(
        self, root: Path, journal: str, names: re.Pattern[str], folders: Collection[str] = (), lock: str = LOCK_NAME
    ):
        self.root, self.journal, self.folders = root, journal, folders
        self._names, self._lock = names, lock

    def are_called(self, name: str) -> bool:
        """True for names that such files can have, and for the journal, its lock and the folders."""
        return name in (self.journal, self._lock, *self.folders) or self._is_name(name)

    def _is_name(self, name: str) -> bool:
        return self._names.fullmatch(name) is not None

    # ---- reading

    def read(self, names: Iterable[str] | None = None) -> dict[str, bytes]:
        """Contents by name of these files, or of all recorded ones, as of one state of the journal.

        StoreError that names a file which is damaged or not recorded.
        """
        while True:
            state = self._state()
            files = {name: self._verified(state, name) for name in (state.receipts if names is None else names)}
            problems = [(name, problem) for name, (_, problem) in files.items() if problem]
            if not problems:
                return {name: content for name, (content, _) in files.items()}
            if self._bytes() == state.content:  # else another process has replaced the files meanwhile
                raise StoreError(f"{self.root / problems[0][0]}: {problems[0][1]}")

    def read_with_journal(self) -> dict[str, bytes]:
        """Contents by name of all recorded files, and last of the journal; empty if there is no journal."""
        while True:
            before, contents = self._bytes(), self.read()
            if self._bytes() == before:
                return {**contents, self.journal: before} if before else {}

    def problems(self, others: Collection[str] = ()) -> list[tuple[str, str]]:
        """All problems, each as the name of a file and what is wrong with it.

        others : files that may lie in the folders although the journal does not record them.
        """
        while True:
            try:
                state, busy = self._state(), holder(self.root, self._lock, self.journal) is not None
            except StoreError as error:  # no regular file
                return [self._name_and_problem(error)]
            problems = [(f"{self.journal}, line {number}", f"damaged{why}") for number, why in state.damage.items()]
            if state.lines.torn and not busy:
                last = f"{self.journal}, line {len(state.lines.entries) + 1}"
                problems.append((last, "damaged, or torn by a crash"))
            problems += [(name, why) for name in state.receipts if (why := self._verified(state, name)[1])]
            if not busy:
                problems += [(name, why) for name, why in self._unrecorded(state) if name not in others]
            if not problems or self._bytes() == state.content:
                return problems

    def _bytes(self) -> bytes:
        path = self.root / self.journal
        return read_journal(path) if os.path.lexists(path) else b""

    def _state(self) -> _State:
        content = self._bytes()
        lines, receipts = scan(content), dict[str, _Receipt]()
        damage = dict.fromkeys(lines.damaged, "")
        for entry in lines.entries:
            try:
                line = _Line.model_validate(entry.facts)
            except ValidationError:
                line = None
            if line is None or not all(self._is_name(receipt.file) for receipt in line.files):
                damage[entry.number] = ", as no engine writes it"
                continue
            receipts.update({receipt.file: receipt for receipt in line.files})
            for name in line.removed:
                receipts.pop(name, None)
        return _State(content, lines, receipts, damage)

    def _verified(self, state: _State, name: str) -> tuple[bytes, str]:
        """The content of a recorded file and "", or b"" and what is wrong with the file."""
        receipt, why = state.receipts.get(name), ""
        if receipt is None:
            return b"", f"does not count, {self.journal} does not name it"
        for place in (name, temporary_name(name)):
            try:
                content = read_inside(self.root, place, receipt.bytes + 1)
            except StoreError as error:
                why = why or str(error).removeprefix(f"{self.root / place}: ").removeprefix(f"{self.root}/")
                continue
            if _receipt(name, content) == receipt:
                return content, ""
            why = why or f"damaged, its SHA-256 is not the one in {self.journal}"
        return b"", why

    def _unrecorded(self, state: _State) -> Iterator[tuple[str, str]]:
        for entry in names_in(self.root):
            try:
                names = list(self._files_at(entry))
            except StoreError as error:  # a folder that is a symbolic link; what follows it is read all the same
                yield self._name_and_problem(error)
                continue
            for name in names:
                if not is_temporary(name.rpartition("/")[2]) and name not in state.receipts:
                    yield name, f"does not count, {self.journal} does not name it"

    def _name_and_problem(self, error: StoreError) -> tuple[str, str]:
        """An error that begins with a path in the directory, as the file's name and the problem."""
        name, _, why = str(error).removeprefix(f"{self.root}/").partition(": ")
        return name, why

    def _present(self) -> Iterator[str]:
        """Names of all files in the folders, and of those in the directory that have a name of such a file."""
        for entry in names_in(self.root):
            yield from self._files_at(entry)

    def _files_at(self, entry: str) -> Iterator[str]:
        """Of one entry of the directory: all files in it where it is one of the folders, or its own name."""
        if entry in self.folders:
            yield from (f"{entry}/{inner}" for inner in names_in(self.root, entry))
        elif self._is_name(_final(entry)):
            yield entry

    # ---- writing

    def write(self, files: Mapping[str, bytes], alone_in: str | None = None, lock: WriterLock | None = None) -> None:
        """Write and record these files, in place of those with the same names.

        alone_in : a folder from which all other files are removed.  lock : the directory's, if the caller holds it.
        """
        if lock is not None:
            lock.check()
        with nullcontext() if lock is not None else WriterLock(self.root, self._lock, self.journal):
            self._complete_interrupted_write()
            present = [name for name in self._present() if name.partition("/")[0] == alone_in]
            obsolete = [name for name in present if name not in files and self._is_name(name)]
            self._write_temporary(files)
            self._record({name: _receipt(name, content) for name, content in files.items()}, obsolete)
            for name in files:
                publish(self.root, temporary_name(name), name)
            for name in obsolete:
                remove_file(self.root, name)

    def _complete_interrupted_write(self) -> None:
        """Rename the recorded files that a killed writer left under temporary names, and remove the others."""
        state = self._state()
        for name in list(self._present()):
            file = _final(name)
            if file == name or not self._is_name(file):
                continue
            receipt = state.receipts.get(file)
            with suppress(StoreError):
                if receipt is not None and _receipt(file, read_inside(self.root, name, receipt.bytes + 1)) == receipt:
                    publish(self.root, name, file)
                    continue
            remove_file(self.root, name)

    def _write_temporary(self, files: Mapping[str, bytes]) -> None:
        try:
            for name, content in files.items():
                make_way(self.root, name)
                write_synced(self.root, temporary_name(name), content, name)
            for name in {name.rpartition("/")[0]: name for name in files}.values():  # one in each folder
                sync_names(self.root, name)
        except BaseException:
            for name in files:
                with suppress(StoreError):
                    remove_file(self.root, temporary_name(name))
            raise

    def _record(self, receipts: Mapping[str, _Receipt], obsolete: Collection[str]) -> None:
        """Append a line to the journal; if one is damaged, write a new journal of all recorded files."""
        state, journal = self._state(), (self.root, self.journal)
        if state.lines.entries and not state.damage:
            line = _Line(files=[*receipts.values()], removed=[*obsolete])
            content = encode(len(state.lines.entries) + 1, utc_now(), _EVENT, line.model_dump())
            append_synced(*journal, state.lines.length, content)
        else:
            recorded = {**state.receipts, **receipts}
            line = _Line(files=[receipt for name, receipt in recorded.items() if name not in obsolete])
            write_inside(*journal, encode(1, utc_now(), _EVENT, line.model_dump()))


def _receipt(name: str, content: bytes) -> _Receipt:
    return _Receipt(file=name, bytes=len(content), sha256=sha256(content).hexdigest())


def _final(name: str) -> str:
    """The final name of a file, from its final or its temporary name."""
    folder, slash, last = name.rpartition("/")
    return f"{folder}{slash}{last[1:].removesuffix('.tmp')}" if is_temporary(last) else name
