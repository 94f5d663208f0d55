"""A safe import path for the processes that the engine starts: without the folder in which they are started."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

SAFE_PATH = {"PYTHONSAFEPATH": "1"}  # then `python -m` and `python -c` put no folder before the standard library


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
