"""Opening of a run, in a directory or on an object store."""

from pathlib import Path

from mc_engine.store.object_store import local_copy
from mc_engine.store.store import Store


def open_store(path: str | Path) -> Store:
    """Open a run directory, or a copy of the published run at a URL.

    path : str or Path

    Returns a Store, for reading; its methods that write take the lock of the directory.

    Raises StoreError if there is no run, or it is damaged.

    >>> open_store("runs/small").nominal()["status"]
    'ok'
    """
    return Store(local_copy(path))
