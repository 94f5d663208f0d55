"""Files that are whole or absent, also after a power cut.

Content goes to a temporary name, is synced and renamed, and the folder is synced.  Temporary names start with a
dot and end in `.tmp`, so that neither Arrow's nor DuckDB's reading of a folder takes them for parts.
Every OSError leaves here as a StoreError that names the path.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from mc_engine.errors import StoreError


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Turn an OSError of the block into a StoreError whose text begins with `path`."""
    try:
        yield
    except OSError as error:
        raise StoreError(f"{path}: {error.strerror or error}") from error


def temporary_name(path: Path) -> Path:
    """Where the content of `path` stands until it is whole."""
    return path.with_name(f".{path.name}.tmp")


def is_temporary(name: str) -> bool:
    """True for the names that `temporary_name` makes."""
    return name.startswith(".") and name.endswith(".tmp")


def write_durably(path: Path, content: bytes) -> None:
    """Replace `path` by `content`; on return both the bytes and the name are on the disk."""
    temporary = temporary_name(path)
    with naming(path):
        try:
            with open(temporary, "wb", buffering=0) as file:
                _write_all(file.fileno(), content)
                os.fsync(file.fileno())
            os.replace(temporary, path)
        except OSError:
            with suppress(OSError):  # a full disk gets its space back; the first error is the one to report
                os.unlink(temporary)
            raise
    sync_folder(path.parent)


def _write_all(descriptor: int, content: bytes) -> None:
    view = memoryview(content)
    while view:
        view = view[os.write(descriptor, view) :]


def make_folder(path: Path) -> None:
    """Create `path` with its parents and sync the names that are new."""
    new = [folder for folder in (path, *path.parents) if not folder.exists()]
    with naming(path):
        path.mkdir(parents=True, exist_ok=True)
    for folder in new:
        sync_folder(folder.parent)


def sync_folder(path: Path) -> None:
    """Make the names in `path` durable.  Windows cannot open a folder; its renames are journaled by the system."""
    if os.name == "nt":
        return
    with naming(path):
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def read_file(path: Path) -> bytes:
    """The whole content of `path`."""
    with naming(path):
        return path.read_bytes()
