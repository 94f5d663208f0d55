"""Files that are whole or absent, also after a power cut.

Content goes to a temporary name, is synced and renamed, and the folder is synced.  Temporary names start with a
dot and end in `.tmp`, so that neither Arrow's nor DuckDB's reading of a folder takes them for parts.
Every OSError leaves here as a DiskError that names the path, or as a StoreError where a file is gone.

A directory may come from anyone: what is read or written is a regular file, never what a symbolic link leads to,
a pipe or a device.
"""

import errno
import hashlib
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from mc_engine.errors import DiskError, StoreError

_FULL_SYNC: int | None = None  # of macOS
if os.name != "nt":
    import fcntl

    _FULL_SYNC = getattr(fcntl, "F_FULLFSYNC", None)

# A file that someone made longer than any of its kind must not fill the memory of whoever reads it whole.
MOST_OF_TEXT, MOST_OF_JOURNAL, MOST_OF_FILE = 2**28, 2**30, 2**34  # bytes

_LINK = "is a symbolic link; only files of its own count in a directory"
# A pipe without a writer must not keep the reader waiting.  Windows has neither flag.
_PLAINLY = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Turn an OSError of the block into a DiskError whose text begins with `path`.

    A StoreError instead where no other disk would help: the file is not there, or is a symbolic link.
    """
    try:
        yield
    except FileNotFoundError as error:
        raise StoreError(f"{path}: {error.strerror or error}") from error
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise StoreError(f"{path}: {_LINK}") from error
        raise DiskError(f"{path}: {error.strerror or error}") from error


@contextmanager
def _refusing_folder(path: Path) -> Iterator[None]:
    """Where the system refuses, in whatever words, because `path` is a folder, a StoreError that says so."""
    try:
        yield
    except OSError as error:
        if path.is_dir() and not path.is_symlink():
            raise StoreError(f"{path}: is a folder, and a file has to be there; move it away") from error
        raise


def open_regular(path: Path, flags: int) -> int:
    """Descriptor of the file `path`, as `os.open` gives it; StoreError if it is there and no regular file."""
    with _refusing_folder(path):
        descriptor = os.open(path, flags | _PLAINLY, 0o666)
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise StoreError(f"{path}: is no regular file")
    return descriptor


def plainly(path: str, flags: int) -> int:
    return open_regular(Path(path), flags)


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
            with open(path, "wb", buffering=0, opener=plainly) as file:
                write_all(file.fileno(), content)
                sync(file.fileno())
        except OSError:
            _discard(path)
            raise


def sync(descriptor: int) -> None:
    """On return the bytes of a file, or the names in a folder, are on the disk.

    The fsync of macOS leaves them in the memory of the drive; its F_FULLFSYNC does not, where the volume knows it.
    """
    if _FULL_SYNC is not None:
        with suppress(OSError):
            fcntl.fcntl(descriptor, _FULL_SYNC)
            return
    os.fsync(descriptor)


def sync_file(path: Path) -> None:
    """On return the bytes of `path` are on the disk."""
    with naming(path), open(path, "r+b", buffering=0, opener=plainly) as file:
        sync(file.fileno())


def publish(temporary: Path, path: Path) -> None:
    """Give a synced file its name, in place of what had it; on return the name is on the disk."""
    with naming(path):
        try:
            with _refusing_folder(path):
                os.replace(temporary, path)
        except (OSError, StoreError):
            _discard(temporary)
            raise
    sync_folder(path.parent)


def remove_file(path: Path) -> None:
    """Remove the file `path`, if it is there."""
    with naming(path), _refusing_folder(path):
        path.unlink(missing_ok=True)


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
            sync(descriptor)
        finally:
            os.close(descriptor)


def read_file(path: Path, most: int | None = None, limit: int = MOST_OF_FILE) -> bytes:
    """The content of the regular file `path`, or its first `most` bytes.

    limit : StoreError if there are more bytes to be read than that, or than the memory takes.
    """
    with naming(path), open(path, "rb", opener=plainly) as file:
        size = os.fstat(file.fileno()).st_size
        wanted = size if most is None else min(most, size)
        if wanted > limit:
            raise StoreError(f"{path}: damaged, {size:,} bytes where no such file has more than {limit:,}")
        try:
            return file.read() if most is None else file.read(wanted)
        except MemoryError as error:
            raise StoreError(f"{path}: has {size:,} bytes, which the memory does not take") from error


def read_short(path: Path) -> bytes:
    """The content of a file that people read too, such as a campaign or a manifest."""
    return read_file(path, limit=MOST_OF_TEXT)


def sha256_inside(folder: Path, name: str) -> str:
    """SHA-256 of the file `name` of a directory, read piece by piece; errors as those of `read_inside`."""
    _check_inside(folder, name)
    path = folder / name
    with naming(path), open(path, "rb", buffering=0, opener=plainly) as file:
        size = os.fstat(file.fileno()).st_size
        if size > MOST_OF_FILE:
            raise StoreError(f"{path}: damaged, {size:,} bytes where no such file has more than {MOST_OF_FILE:,}")
        return hashlib.file_digest(file, "sha256").hexdigest()


def read_inside(folder: Path, name: str, most: int | None = None) -> bytes:
    """The content of the file `name` of a directory, or its first `most` bytes.

    name : relative to `folder`, with slashes.  StoreError if it lies elsewhere, be it by a symbolic link on the way.
    """
    _check_inside(folder, name)
    return read_file(folder / name, most)


def _check_inside(folder: Path, name: str) -> None:
    with naming(folder / name):
        if os.path.realpath(folder / name) != os.path.join(os.path.realpath(folder), *name.split("/")):
            raise StoreError(f"{folder / name}: lies outside the directory, or {_LINK}")
