"""Data files that a model reads from its own folder: an aerodynamic table, a gravity field.

They decide its numbers as its sources do, and a run directory keeps a copy of them.  What opens them is not asked: a
hook of the interpreter notes every file that is opened, below code of a model, in a folder that is watched.
"""

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import Any

USER = "mc_engine_user_"  # begins the name of every module from a campaign's folder
_READ: dict[str, set[Path]] = {}  # by folder
_LOADING = threading.local()  # .found : (folder, contents) of the import that is under way in this thread
_SOURCES = (".py", ".pyc")


@contextmanager
def data_within(folder: Path, contents: dict[Path, bytes]) -> Iterator[None]:
    """Within, a model in `folder` is imported: keep the contents of what that reads, as they are when it is opened, and
    note from now on what it reads later.

    Only what this import reads counts as its source: what others read from the folder, or it reads in flight, is not
    known to the process that carries a run on.
    """
    if not _READ:
        sys.addaudithook(_note)
    _READ.setdefault(str(folder), set())
    _LOADING.found = (folder, contents)
    try:
        yield
    finally:
        _LOADING.found = None


def data_read(folder: Path) -> list[Path]:
    """Files below `folder` that models have read in this process and that are still there."""
    return sorted(path for path in _READ.get(str(folder), ()) if path.is_file())


def _note(event: str, arguments: tuple[Any, ...]) -> None:
    if event != "open" or not isinstance(arguments[0], str) or set(arguments[1] or "") & set("wax+"):
        return
    path = os.path.abspath(arguments[0])
    for folder, found in list(_READ.items()):
        if path.startswith(folder + os.sep) and not path.endswith(_SOURCES) and _below_a_model(sys._getframe(1)):
            found.add(Path(path))
            _keep(Path(path))


def _keep(path: Path) -> None:
    loading, _LOADING.found = getattr(_LOADING, "found", None), None  # this reading is not the model's
    try:
        if loading is not None and loading[0] in path.parents and path.is_file():
            with suppress(OSError):
                loading[1][path] = path.read_bytes()
    finally:
        _LOADING.found = loading


def _below_a_model(frame: FrameType | None) -> bool:
    while frame is not None:
        if str(frame.f_globals.get("__name__", "")).startswith(USER):
            return True
        frame = frame.f_back
    return False
