"""Data files that a model reads from its own folder: an aerodynamic table, a gravity field.

They decide its numbers as its sources do, and a run directory keeps a copy of them.  What opens them is not asked: a
hook of the interpreter notes every file that is opened, below code of a model, in a folder that is watched.
"""

import os
import sys
from pathlib import Path
from types import FrameType
from typing import Any

USER = "mc_engine_user_"  # begins the name of every module from a campaign's folder
_READ: dict[str, set[Path]] = {}  # by folder
_AT_LOAD: dict[Path, dict[Path, bytes]] = {}  # by model file: what its import read, with the contents
_SOURCES = (".py", ".pyc")


def watch(folder: Path) -> None:
    """Note from now on what models read below `folder`."""
    if not _READ:
        sys.addaudithook(_note)
    _READ.setdefault(str(folder), set())


def data_read(folder: Path) -> list[Path]:
    """Files below `folder` that models have read in this process and that are still there."""
    return sorted(path for path in _READ.get(str(folder), ()) if path.is_file())


def note_load(model: Path) -> None:
    """Remember what the import of the model in this file has read just now, `watch` having been called before."""
    _AT_LOAD[model] = {path: path.read_bytes() for path in data_read(model.parent)}


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


def _below_a_model(frame: FrameType | None) -> bool:
    while frame is not None:
        if str(frame.f_globals.get("__name__", "")).startswith(USER):
            return True
        frame = frame.f_back
    return False
