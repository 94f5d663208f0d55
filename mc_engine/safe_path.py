"""The import path of the processes that the engine starts: never the folder in which they are started."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

SAFE_PATH = {"PYTHONSAFEPATH": "1"}  # `python -m` and `python -c` then put no folder before the standard library


@contextmanager
def safe_import_path() -> Iterator[None]:
    """Processes that this process starts in the block, whichever library starts them, have a safe import path."""
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
