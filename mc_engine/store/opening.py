"""Opening of a run, in a directory or on an object store."""

from pathlib import Path

from mc_engine.store.object_store import local_copy
from mc_engine.store.store import Store


def open_store(path: str | Path) -> Store:
    """The run in the directory `path`, or a local copy of the run at that URL.

    Reading takes no lock; the methods of the Store that write take the writer lock.  StoreError if it is no run.
    """
    return Store(local_copy(path))
