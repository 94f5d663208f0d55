"""Opening a run for reading, wherever it lies."""

from pathlib import Path

from mc_engine.store.object_store import local_copy
from mc_engine.store.store import Store


def open_store(path: str | Path) -> Store:
    """The run in directory `path`, or a copy of the one at that URL, for reading; writing methods take the lock."""
    return Store(local_copy(path))
