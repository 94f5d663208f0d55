"""Files of a simulator's cases in a run directory: rows that are not yet in a part, and folders of failed cases.

A case of a simulator may take minutes, and a part contains many.  Because its row is recorded, a resumed run does not
fly it again.  Each row is a line, with a checksum, in a file for its part; the file is removed when the part is
written.  Rows survive a kill of the engine.  A power cut may lose the last rows, which are then flown again.
"""

import json
import os
import re
import stat
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

from mc_engine import durable_file as disk
from mc_engine.errors import DiskError, StoreError
from mc_engine.store.run_files import NOMINAL_CASE, SIMULATOR

MOST_KEPT = 1000  # folders of failed cases in a run
Row = dict[str, Any]
_NAME = re.compile(r"\.rows-(-1|[0-9]{1,18})-([0-9]{1,18})\.tmp")


class RowLog:
    """The rows of the cases first .. stop - 1 of a run.

    The process that flies a case records its row before it reports the case and before it flies the next one.
    """

    def __init__(self, run: Path, first: int, stop: int, case_ids: np.ndarray | None = None):
        self._run, self._first, self._stop, self._case_ids = run, first, stop, case_ids
        self._name = f"{SIMULATOR}/.rows-{first}-{stop}.tmp"
        self._descriptor: int | None = None

    def rows(self) -> dict[int, Row]:
        """The recorded rows of these cases, by case; a line that was not written whole is left out."""
        recorded: dict[int, Row] = {}
        for name in _logs(self._run, self._first, self._stop):
            for line in disk.read_inside(self._run, name).splitlines():
                mark, _, text = line.partition(b" ")
                if mark == _mark(text):
                    row = json.loads(text)
                    if self._first <= row["case_id"] < self._stop:
                        recorded[row["case_id"]] = row
        return recorded

    def of(self, case_ids: np.ndarray) -> "RowLog":
        """The same log, for cases that are named by their place in `case_ids`; it can be sent to another process."""
        return RowLog(self._run.absolute(), self._first, self._stop, case_ids)

    def at(self, places: Sequence[int]) -> "RowLog":
        """The same log for some of these cases."""
        assert self._case_ids is not None  # of `of`
        return self.of(self._case_ids[places])

    def add(self, place: int, row: Row) -> None:
        """Record the row of the case at a place."""
        assert self._case_ids is not None  # of `of`
        text = json.dumps({"case_id": int(self._case_ids[place]), **row}).encode()
        try:
            disk.write_all(self._opened(), _mark(text) + b" " + text + b"\n")
        except OSError as error:
            raise DiskError(f"{self._run / self._name}: {error.strerror or error}") from error

    def _opened(self) -> int:
        if self._descriptor is None:
            self._descriptor = disk.open_to_append(self._run, self._name)
            disk.write_all(self._descriptor, b"\n")  # after a line that a kill cut short
        return self._descriptor

    def close(self) -> None:
        """Close the file, to which further rows may be added."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None

    def remove(self) -> None:
        """Forget the rows, which a part holds now."""
        self.close()
        if os.path.lexists(self._run / SIMULATOR):
            disk.remove_file(self._run, self._name)


def recorded_cases(run: Path) -> int:
    """How many cases have a row that no part holds yet."""
    return len(RowLog(run, 0, 2**62).rows())


def rows_so_far(run: Path) -> tuple[int, int]:
    """(rows, those of failed cases) that no part of a flying run holds yet; counted only, which takes little time."""
    rows = ok = 0
    for name in _logs(run, 0, 2**62):
        with suppress(StoreError):  # removed meanwhile: a part holds its rows now
            content = disk.read_inside(run, name)
            rows += content.count(b' {"case_id": ')
            ok += content.count(b', "status": "ok", ')
    return rows, rows - ok


def is_log(name: str) -> bool:
    """True for the name of a file with rows, as it is in a run directory."""
    return _NAME.fullmatch(name.removeprefix(f"{SIMULATOR}/")) is not None


def remove_logs(run: Path) -> None:
    """Remove all logs of a run whose cases are complete, and their folder if nothing else is in it."""
    for name in _logs(run, NOMINAL_CASE, 2**62):
        disk.remove_file(run, name)
    if os.path.lexists(run / SIMULATOR) and not disk.names_in(run, SIMULATOR):
        disk.remove_folder(run, SIMULATOR)


def _logs(run: Path, first: int, stop: int) -> Iterator[str]:
    """Names of the files with rows of any of the cases first .. stop - 1."""
    for name in disk.names_in(run, SIMULATOR) if os.path.lexists(run / SIMULATOR) else ():
        match = _NAME.fullmatch(name)
        if match is not None and int(match[1]) < stop and first < int(match[2]):
            yield f"{SIMULATOR}/{name}"


def _mark(text: bytes) -> bytes:
    return f"{crc32(text):08x}".encode()


def keep_case(run: Path, name: str, folder: Path, texts: Mapping[str, bytes], most: int | None = MOST_KEPT) -> None:
    """Keep the files of a case, in place of those of an earlier flight of it.

    name : of its folder in the run.  folder : of its files, of which the regular ones are copied; it may be missing.
    texts : contents of further files by name.  most : folders that a run may have, or None.
    """
    disk.make_way(run, f"{SIMULATOR}/{name}")
    if most is not None and len(disk.names_in(run, SIMULATOR)) >= most:
        return
    disk.remove_folder(run, f"{SIMULATOR}/{name}")
    for path, kept in _regular_files(folder):
        if kept.split("/")[0] not in texts:
            disk.copy_into(run, f"{SIMULATOR}/{name}/{kept}", path)
    for file, text in texts.items():
        disk.make_way(run, f"{SIMULATOR}/{name}/{file}")
        disk.leave(run, f"{SIMULATOR}/{name}/{file}", text)


def _regular_files(folder: Path) -> Iterator[tuple[Path, str]]:
    """The regular files in a folder that can be read, and their names from there, if a run directory can hold them."""
    for way, _, names in os.walk(folder):  # which enters no folder by a link
        for name in sorted(names):
            path = Path(way) / name
            with suppress(ValueError, OSError):
                inner = path.relative_to(folder).as_posix()
                if stat.S_ISREG(path.lstat().st_mode) and os.access(path, os.R_OK) and disk.inner_names(inner):
                    yield path, inner
