"""The cache folder, for what can be computed again: compiled kernels, designs of models, nominal flights of `check`."""

import os
import stat
import sys
import tempfile
from functools import cache
from pathlib import Path


def cache_folder() -> Path:
    """Folder of compiled kernels and designs: MC_ENGINE_CACHE, or the user's cache folder, or a temporary one."""
    if chosen := os.environ.get("MC_ENGINE_CACHE"):
        return Path(chosen)
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = base / "mc-engine"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            return folder
    except OSError:
        pass  # a read-only home: kernels are then compiled once per temporary folder
    return _own_temporary_folder()


def _own_temporary_folder() -> Path:
    """A temporary folder that only this user can write to, since code in it is run."""
    user = os.getuid() if hasattr(os, "getuid") else 0  # Windows has a temporary folder for every user
    folder = Path(tempfile.gettempdir()) / f"mc-engine-{user}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        about = folder.lstat()
        if not hasattr(os, "getuid") or (about.st_uid == user and stat.S_ISDIR(about.st_mode)):
            return folder
    except OSError:
        pass  # somebody else's file has the name
    return _temporary_folder_of_this_process()


@cache
def _temporary_folder_of_this_process() -> Path:
    return Path(tempfile.mkdtemp(prefix="mc-engine-"))
