"""Files that are whole or absent, also after a power cut.

Content goes to a temporary name, is synced and renamed, and the folder is synced.  Temporary names start with a
dot and end in `.tmp`, so that neither Arrow's nor DuckDB's reading of a folder takes them for parts.
Every OSError leaves here as a DiskError that names the path, or as a StoreError where a file is gone.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from mc_engine.errors import DiskError, StoreError


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Turn an OSError of the block into a DiskError whose text begins with `path`; a StoreError if it is not there."""
    try:
        yield
    except FileNotFoundError as error:
        raise StoreError(f"{path}: {error.strerror or error}") from error
    except OSError as error:
        raise DiskError(f"{path}: {error.strerror or error}") from error


def temporary_name(path: Path) -> Path:
    """Where the content of `path` stands until it is whole."""
    return path.with_name(f".{path.name}.tmp")


def is_temporary(name: str) -> bool:
    """True for the names that `temporary_name` makes."""
    return name.startswith(".") and name.endswith(".tmp")


def write_durably(path: Path, content: bytes) -> None:
    """Replace `path` by `content`; on return both the bytes and the name are on the disk."""
    temporary = temporary_name(path)
    write_synced(temporary, content, path)
    publish(temporary, path)


def write_synced(path: Path, content: bytes, place: Path | None = None) -> None:
    """Write a new file whose bytes, but not yet whose name, are on the disk.  `place` is for messages."""
    with naming(place or path):
        try:
            with open(path, "wb", buffering=0) as file:
                write_all(file.fileno(), content)
                os.fsync(file.fileno())
        except OSError:
            _discard(path)
            raise


def sync_file(path: Path) -> None:
    """On return the bytes of `path` are on the disk."""
    with naming(path), open(path, "r+b", buffering=0) as file:
        os.fsync(file.fileno())


def publish(temporary: Path, path: Path) -> None:
    """Give a synced file its name, in place of what had it; on return the name is on the disk."""
    with naming(path):
        try:
            os.replace(temporary, path)
        except OSError:
            _discard(temporary)
            raise
    sync_folder(path.parent)


def _discard(path: Path) -> None:
    """A full disk gets its space back; the first error is the one to report."""
    with suppress(OSError):
        os.unlink(path)


def write_all(descriptor: int, content: bytes) -> None:
    """Write every byte; the system may take fewer at a time."""
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
