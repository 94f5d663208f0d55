"""A safe import path for the processes that the engine starts: without the folder in which they are started."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

SAFE_PATH = {"PYTHONSAFEPATH": "1"}  # then `python -m` and `python -c` put no folder before the standard library


def safe_environment() -> dict[str, str]:
    """Environment of a Python process that finds the packages of this one, but none in the current folder.

    In an interactive session the import path begins with an empty entry, which stands for the current folder.
    """
    own = str(Path(__file__).resolve().parents[1])
    entries = [entry for entry in sys.path if entry]
    return {**os.environ, **SAFE_PATH, "PYTHONPATH": os.pathsep.join(entries if own in entries else [*entries, own])}


@contextmanager
def safe_import_path() -> Iterator[None]:
    """Processes that are started within the block, by any library, have a safe import path."""
    before = {name: os.environ.get(name) for name in SAFE_PATH}
    os.environ.update(SAFE_PATH)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
