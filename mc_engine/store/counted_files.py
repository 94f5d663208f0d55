"""Files that count by a journal, each of whose lines names some with their bytes and SHA-256.

    {"n": 2, ..., "event": "files", "files": [{"file": "report.html", "bytes": 4711, "sha256": ...}], "removed": []}

The directories of `tune` and `rare` are kept so, and in every directory the reports and replays made of it.  Files that
are written together change together: each stands complete under a temporary name when the line is written that names
them all, and takes its own name afterwards.  A kill leaves the old files or the new ones: one that counts and still
has its temporary name is read there, and the next writer names it.
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
    """What counts by the content of a journal.  damage : what is wrong with a line, by its number."""

    content: bytes
    found: Scan
    receipts: Mapping[str, _Receipt]
    damage: Mapping[int, str]


class CountedFiles:
    """The files of the directory `root` that the journal of this name counts.

    names : what they can be called, with slashes.  folders : those in the directory that hold nothing else.
    """

    def __init__(
        self, root: Path, journal: str, names: re.Pattern[str], folders: Collection[str] = (), lock: str = LOCK_NAME
    ):
        self.root, self.journal, self.folders = root, journal, folders
        self._names, self._lock = names, lock

    def are_called(self, name: str) -> bool:
        """Can one of these files have this name, or is it what they are kept with?"""
        return name in (self.journal, self._lock, *self.folders) or self._is_one(name)

    def _is_one(self, name: str) -> bool:
        return self._names.fullmatch(name) is not None

    # ---- reading

    def read(self, names: Iterable[str] | None = None) -> dict[str, bytes]:
        """The contents of these files, or of all that count, as they were together at one moment.

        StoreError naming one that is damaged, or does not count.
        """
        while True:
            state = self._state()
            looked = {name: self._look(state, name) for name in (state.receipts if names is None else names)}
            wrong = [(name, why) for name, (_, why) in looked.items() if why]
            if not wrong:
                return {name: content for name, (content, _) in looked.items()}
            if self._bytes() == state.content:  # nobody has replaced them meanwhile
                raise StoreError(f"{self.root / wrong[0][0]}: {wrong[0][1]}")

    def read_with_journal(self) -> dict[str, bytes]:
        """All that counts, and last the journal that says so; empty without one."""
        while True:
            before, contents = self._bytes(), self.read()
            if self._bytes() == before:
                return {**contents, self.journal: before} if before else {}

    def problems(self, others: Collection[str] = ()) -> list[tuple[str, str]]:
        """All that is wrong: the name of a file of the directory, and what it is.

        others : files that lie in the folders for another reason.
        """
        while True:
            try:
                state, busy = self._state(), holder(self.root, self._lock, self.journal) is not None
            except StoreError as error:  # no regular file
                return [self._parted(error)]
            found = [(f"{self.journal}, line {number}", f"damaged{why}") for number, why in state.damage.items()]
            if state.found.torn and not busy:
                found.append((f"{self.journal}, line {len(state.found.entries) + 1}", "damaged, or torn by a crash"))
            found += [(name, why) for name in state.receipts if (why := self._look(state, name)[1])]
            found += [] if busy else [one for one in self._strays(state) if one[0] not in others]
            if not found or self._bytes() == state.content:
                return found

    def _bytes(self) -> bytes:
        path = self.root / self.journal
        return read_journal(path) if os.path.lexists(path) else b""

    def _state(self) -> _State:
        content = self._bytes()
        found, receipts = scan(content), dict[str, _Receipt]()
        damage = dict.fromkeys(found.damaged, "")
        for entry in found.entries:
            try:
                line = _Line.model_validate(entry.facts)
            except ValidationError:
                line = None
            if line is None or not all(self._is_one(one.file) for one in line.files):
                damage[entry.number] = ", as no engine writes it"
                continue
            receipts.update({one.file: one for one in line.files})
            for name in line.removed:
                receipts.pop(name, None)
        return _State(content, found, receipts, damage)

    def _look(self, state: _State, name: str) -> tuple[bytes, str]:
        """The content of a file that counts, or else what is wrong with it."""
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

    def _strays(self, state: _State) -> Iterator[tuple[str, str]]:
        try:
            for name in self._lying():
                if not is_temporary(name.rpartition("/")[2]) and name not in state.receipts:
                    yield name, f"does not count, {self.journal} does not name it"
        except StoreError as error:  # a folder that is a symbolic link
            yield self._parted(error)

    def _parted(self, error: StoreError) -> tuple[str, str]:
        """Name and sentence of an error that begins with a path in the directory."""
        name, _, why = str(error).removeprefix(f"{self.root}/").partition(": ")
        return name, why

    def _lying(self) -> Iterator[str]:
        """All that lies in the folders, and in the directory what these files are called."""
        for name in names_in(self.root):
            if name in self.folders:
                yield from (f"{name}/{inner}" for inner in names_in(self.root, name))
            elif self._is_one(_final(name)):
                yield name

    # ---- writing

    def write(self, files: Mapping[str, bytes], alone_in: str | None = None, lock: WriterLock | None = None) -> None:
        """Let these files count, in place of those of the same names; and in the folder `alone_in` no others.

        lock : of the directory, where the caller has it.
        """
        if lock is not None:
            lock.check()
        with nullcontext() if lock is not None else WriterLock(self.root, self._lock, self.journal):
            self._settle()
            lying = [name for name in self._lying() if name.partition("/")[0] == alone_in]
            gone = [name for name in lying if name not in files and self._is_one(name)]
            self._write_aside(files)
            self._append({name: _receipt(name, content) for name, content in files.items()}, gone)
            for name in files:
                publish(self.root, temporary_name(name), name)
            for name in gone:
                remove_file(self.root, name)

    def _settle(self) -> None:
        """Finish what a writer that was killed began: name what counts already, remove what does not."""
        state = self._state()
        for name in list(self._lying()):
            file = _final(name)
            if file == name or not self._is_one(file):
                continue
            receipt = state.receipts.get(file)
            with suppress(StoreError):
                if receipt is not None and _receipt(file, read_inside(self.root, name, receipt.bytes + 1)) == receipt:
                    publish(self.root, name, file)
                    continue
            remove_file(self.root, name)

    def _write_aside(self, files: Mapping[str, bytes]) -> None:
        try:
            for name, content in files.items():
                make_way(self.root, name)
                write_synced(self.root, temporary_name(name), content, name)
        except BaseException:
            for name in files:
                with suppress(StoreError):
                    remove_file(self.root, temporary_name(name))
            raise

    def _append(self, receipts: Mapping[str, _Receipt], gone: Collection[str]) -> None:
        """One line more; where another is damaged, a new journal of all that counts."""
        state, journal = self._state(), (self.root, self.journal)
        if state.found.entries and not state.damage:
            line = _Line(files=[*receipts.values()], removed=[*gone])
            content = encode(len(state.found.entries) + 1, utc_now(), _EVENT, line.model_dump())
            append_synced(*journal, state.found.length, content)
        else:
            counted = {**state.receipts, **receipts}
            line = _Line(files=[one for name, one in counted.items() if name not in gone])
            write_inside(*journal, encode(1, utc_now(), _EVENT, line.model_dump()))


def _receipt(name: str, content: bytes) -> _Receipt:
    return _Receipt(file=name, bytes=len(content), sha256=sha256(content).hexdigest())


def _final(name: str) -> str:
    """The name that a file is to have, from its own or its temporary one."""
    folder, slash, last = name.rpartition("/")
    return f"{folder}{slash}{last[1:].removesuffix('.tmp')}" if is_temporary(last) else name
