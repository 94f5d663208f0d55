"""Data files that a model reads from its own folder: an aerodynamic table, a gravity field.

They decide its numbers as its sources do, and a run directory keeps a copy of them.  What opens them is not asked: a
hook of the interpreter notes every file that is opened, below code of a model, in a folder that is watched.
"""

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

USER = "mc_engine_user_"  # begins the name of every module from a campaign's folder
_READ: dict[str, set[Path]] = {}  # by folder
_AT_LOAD: dict[Path, dict[Path, bytes]] = {}  # by model file: what its import read, with the contents
_LOADING = threading.local()  # .found : what the import that is under way in this thread has read
_SOURCES = (".py", ".pyc")


@contextmanager
def loading(model: Path) -> Iterator[None]:
    """Within, the model in this file is imported: remember what that reads, and note from now on what it reads later.

    Only what this import reads counts as its source: what others read from the folder, or it reads in flight, is not
    known to the process that carries a run on.
    """
    if not _READ:
        sys.addaudithook(_note)
    _READ.setdefault(str(model.parent), set())
    _LOADING.found = set()
    try:
        yield
        _AT_LOAD[model] = {path: path.read_bytes() for path in sorted(_LOADING.found) if path.is_file()}
    finally:
        del _LOADING.found


def data_read(folder: Path) -> list[Path]:
    """Files below `folder` that models have read in this process and that are still there."""
    return sorted(path for path in _READ.get(str(folder), ()) if path.is_file())


def data_at_load(model: Path) -> list[Path]:
    """Files that the import of a model reads: their numbers may be compiled into its kernel."""
    return sorted(_AT_LOAD.get(model, {}))


def has_changed(model: Path) -> bool:
    """Whether a file that the import of the model read has other contents now."""
    return any(not path.is_file() or path.read_bytes() != content for path, content in _AT_LOAD.get(model, {}).items())


def _note(event: str, arguments: tuple[Any, ...]) -> None:
    if event != "open" or not isinstance(arguments[0], str) or set(arguments[1] or "") & set("wax+"):
        return
    path = os.path.abspath(arguments[0])
    for folder, found in list(_READ.items()):
        if path.startswith(folder + os.sep) and not path.endswith(_SOURCES) and _below_a_model(sys._getframe(1)):
            found.add(Path(path))
            getattr(_LOADING, "found", found).add(Path(path))


def _below_a_model(frame: FrameType | None) -> bool:
    while frame is not None:
        if str(frame.f_globals.get("__name__", "")).startswith(USER):
            return True
        frame = frame.f_back
    return False
