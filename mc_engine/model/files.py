"""Files in the folder of a campaign file or a model, named relative to it."""

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mc_engine.durable_file import open_regular
from mc_engine.errors import StoreError

_LONGEST_NAME = 60  # written out in one
_OF_RUN = "journal.jsonl"  # a folder with it is a run directory, see store.run_files


class FileFault(Exception):
    """What is wrong with the file, as one sentence; the reader of the campaign file adds the place."""


def resolve_beside(directory: Path, reference: str, owner: str = "the campaign file") -> Path:
    """The file `reference`, which must stand in `directory` or below it, and be named from there.

    owner : whose directory it is.  A run directory holds a copy of the file under the same name, which must lead to the
    copy; so a link keeps its own name.
    """
    home = directory.resolve()
    name = json.dumps(reference if len(reference) <= _LONGEST_NAME else f"{reference[:57]}...", ensure_ascii=False)
    try:
        path = (home / reference).resolve()
        is_file = path.is_file()
    except (OSError, ValueError, RuntimeError):  # too long, with a zero byte, links that go round
        raise FileFault(f"{name} is no name that a file can have") from None
    if not path.is_relative_to(home):
        raise FileFault(f"{name} lies outside the folder of {owner}; put it beside {owner}")
    if os.path.isabs(reference) or Path(os.path.normpath(reference)).parts[:1] == ("..",):
        here = json.dumps(path.relative_to(home).as_posix(), ensure_ascii=False)
        raise FileFault(f"{name} leads through other folders than that of {owner}; write {here}")
    if not is_file:
        raise FileFault(f"there is no file {name} beside {owner}")
    return home / os.path.normpath(reference)


def sources_in(folder: Path) -> Iterator[Path]:
    """The Python files of a folder and of those in it, without the copies of sources that a run directory keeps."""
    runs = [journal.parent for journal in folder.rglob(_OF_RUN)]
    return (file for file in folder.rglob("*.py") if not any(file.is_relative_to(run) for run in runs))


@contextmanager
def open_beside(path: Path, most: int) -> Iterator[Any]:
    """The file, to be read as bytes; FileFault where it has more than `most`, or the system refuses."""
    try:
        with os.fdopen(open_regular(path.resolve(), os.O_RDONLY), "rb") as file:  # a link in one's own folder counts
            size = os.fstat(file.fileno()).st_size
            if size > most:
                raise FileFault(f'"{path.name}" has {size:,} bytes; at most {most:,} are read of such a file')
            yield file
    except (OSError, StoreError) as error:
        raise FileFault(f'"{path.name}" cannot be read: {getattr(error, "strerror", None) or error}') from None
