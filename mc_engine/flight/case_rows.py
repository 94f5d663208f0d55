"""Rows of complete cases that no part holds yet, so that a killed run does not fly them again.

A case of a simulator may take minutes, and a part holds many.  Each row is a line of a file of its part, with a check
sum; the file is removed when the part is written.  A row is on the disk as soon as the system writes it, which a kill
of the engine does not prevent; a power cut may cost the last rows, which are then flown again.
"""

import json
import os
import re
from collections.abc import Iterator
from pathlib import Path
from zlib import crc32

import numpy as np

from mc_engine.durable_file import open_regular
from mc_engine.errors import DiskError
from mc_engine.flight.flyer import OnRow, Row

FOLDER = "simulator"  # of a run directory: these rows, and what cases of a simulator left behind
_NAME = re.compile(r"\.rows-([0-9]{1,18})-([0-9]{1,18})\.tmp")


class RowLog:
    """The rows of the cases first .. stop - 1 of a run."""

    def __init__(self, run: Path, first: int, stop: int):
        self._folder, self._first, self._stop = run / FOLDER, first, stop
        self._path = self._folder / f".rows-{first}-{stop}.tmp"
        self._descriptor: int | None = None

    def rows(self) -> dict[int, Row]:
        """The recorded rows of these cases, by case; a line that was not written whole is left out."""
        found: dict[int, Row] = {}
        for path in _logs(self._folder, self._first, self._stop):
            for line in path.read_bytes().splitlines():
                mark, _, text = line.partition(b" ")
                if mark == _mark(text):
                    row = json.loads(text)
                    if self._first <= row["case_id"] < self._stop:
                        found[row["case_id"]] = row
        return found

    def adding(self, case_ids: np.ndarray) -> OnRow:
        """A function that records the row of the case at a place of `case_ids`."""

        def add(place: int, row: Row) -> None:
            text = json.dumps({"case_id": int(case_ids[place]), **row}).encode()
            try:
                os.write(self._opened(), _mark(text) + b" " + text + b"\n")
            except OSError as error:
                raise DiskError(f"{self._path}: {error.strerror or error}") from error

        return add

    def _opened(self) -> int:
        if self._descriptor is None:
            self._folder.mkdir(exist_ok=True)
            self._descriptor = open_regular(self._path, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
            os.write(self._descriptor, b"\n")  # after a line that a kill cut short
        return self._descriptor

    def remove(self) -> None:
        """Forget the rows, which a part holds now."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None
        self._path.unlink(missing_ok=True)


def remove_logs(run: Path) -> None:
    """Remove all logs of a run whose cases are complete, and their folder if it is empty then."""
    for path in _logs(run / FOLDER, 0, 2**62):
        path.unlink(missing_ok=True)
    try:
        (run / FOLDER).rmdir()
    except OSError:  # not there, or the folders of cases are in it
        pass


def _logs(folder: Path, first: int, stop: int) -> Iterator[Path]:
    """Files with rows of any of the cases first .. stop - 1."""
    for path in sorted(folder.glob(".rows-*.tmp")) if folder.is_dir() else ():
        match = _NAME.fullmatch(path.name)
        if match is not None and int(match[1]) < stop and first < int(match[2]) and not path.is_symlink():
            yield path


def _mark(text: bytes) -> bytes:
    return f"{crc32(text):08x}".encode()
