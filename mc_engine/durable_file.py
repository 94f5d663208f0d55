"""Durable files: complete or absent, also after a power cut.  The engine writes all its files through this module.

Content is written to a temporary name, synced and renamed, and the folder is synced.  Temporary names start with a dot
and end in `.tmp`, so that Arrow and DuckDB do not read them as parts.  Every OSError becomes a DiskError that names the
path, or a StoreError if a file is missing.

Functions with `root` and `name` are for directories of unknown origin: `root` is the directory as the user named it,
which may be a symbolic link, and `name` is a path in it, with slashes.  Below `root` no link is followed: each folder
is opened relative to its parent, or, where the system cannot do that, its resolved path is compared.  Only regular
files are read or written, no pipes and no devices.
"""

import errno
import os
import shutil
import stat
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from mc_engine.errors import DiskError, StoreError

_FULL_SYNC: int | None = None  # of macOS
if os.name != "nt":
    import fcntl

    _FULL_SYNC = getattr(fcntl, "F_FULLFSYNC", None)

# Largest files that are read at once, so that an oversized one cannot fill the memory.
MOST_OF_TEXT, MOST_OF_JOURNAL, MOST_OF_FILE = 2**28, 2**30, 2**34  # bytes
_PIECE = 2**20  # bytes that are copied at a time

_LINK = "is a symbolic link; put the file itself there"
# Opening follows no link, and does not wait for the writer of a pipe.  Windows has neither flag.
_REGULAR = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
_NEW = os.O_WRONLY | os.O_CREAT | os.O_TRUNC
_HOLDS_FOLDERS = os.open in os.supports_dir_fd and hasattr(os, "O_NOFOLLOW")  # not on Windows


@contextmanager
def disk_errors(path: Path) -> Iterator[None]:
    """Turn an OSError of the block into a DiskError whose text begins with `path`.

    If the file is missing or is a symbolic link, or a folder on the way to it is no folder, it becomes a StoreError,
    since the disk is not the cause.
    """
    try:
        yield
    except (FileNotFoundError, NotADirectoryError) as error:
        raise StoreError(f"{path}: {error.strerror or error}") from error
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise StoreError(f"{path}: {_LINK}") from error
        raise DiskError(f"{path}: {error.strerror or error}") from error


@contextmanager
def _refusing_folder(path: Path) -> Iterator[None]:
    """Turn an OSError of the block into a plain StoreError if its cause is that `path` is a folder."""
    try:
        yield
    except OSError as error:
        if path.is_dir() and not path.is_symlink():
            raise StoreError(f"{path}: is a folder, and a file has to be there; move it away") from error
        raise


# ---- folders, opened without following links


class _Folder(NamedTuple):
    """A folder, with its descriptor where the system opens files by that."""

    path: Path
    descriptor: int | None

    def of(self, name: str) -> str:
        """The path to pass to the system, together with the descriptor, for a name in this folder."""
        return str(self.path / name) if self.descriptor is None else name


def inner_names(name: str) -> list[str]:
    """The folders on the path to a file of a directory, and the file's name; ValueError if it may lie outside."""
    names = name.split("/")
    forbidden = "\0\\:" if os.name == "nt" else "\0"
    if any(part in ("", ".", "..") or {*part} & {*forbidden} for part in names):
        raise ValueError("lies outside the directory")
    return names


@contextmanager
def _parent(root: Path, name: str, shown: str | None = None, make: bool = False) -> Iterator[tuple[_Folder, str]]:
    """The folder of the file `name` of a directory, and the file's name in that folder.

    shown : name for messages, if not `name`.  make : create missing folders.
    """
    path = root / (shown or name)
    try:
        *folders, last = inner_names(name)
    except ValueError as error:
        raise StoreError(f"{path}: {error}") from None
    with disk_errors(path), _held(root, folders, make) as folder:
        yield folder, last


@contextmanager
def _held(root: Path, folders: Sequence[str] = (), make: bool = False) -> Iterator[_Folder]:
    if not _HOLDS_FOLDERS:
        yield _resolved(root, folders, make)
        return
    path, descriptor = root, os.open(root, os.O_RDONLY | os.O_DIRECTORY)
    try:
        for name in folders:
            inner = _entered(_Folder(path, descriptor), name, make)
            os.close(descriptor)
            path, descriptor = path / name, inner
        yield _Folder(path, descriptor)
    finally:
        os.close(descriptor)


def _entered(folder: _Folder, name: str, make: bool) -> int:
    """Descriptor of a folder in this one."""
    if make:
        with suppress(FileExistsError):
            os.mkdir(name, dir_fd=folder.descriptor)
            _sync_names(folder)
    try:
        return os.open(name, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW, dir_fd=folder.descriptor)
    except NotADirectoryError:
        is_link = stat.S_ISLNK(os.stat(name, dir_fd=folder.descriptor, follow_symlinks=False).st_mode)
        raise StoreError(f"{folder.path / name}: {_LINK if is_link else 'is no folder'}") from None


def _resolved(root: Path, folders: Sequence[str], make: bool) -> _Folder:
    path = root.joinpath(*folders)
    if os.path.realpath(path) != os.path.join(os.path.realpath(root), *folders):
        raise StoreError(f"{path}: lies outside the directory, or {_LINK}")
    if make:
        path.mkdir(parents=True, exist_ok=True)
    return _Folder(path, None)


def open_regular(path: Path, flags: int, folder: _Folder | None = None) -> int:
    """Descriptor of the file `path`, as `os.open` gives it; StoreError if it is there and no regular file."""
    folder = folder or _Folder(path.parent, None)
    with _refusing_folder(path):
        descriptor = os.open(folder.of(path.name), flags | _REGULAR, 0o666, dir_fd=folder.descriptor)
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise StoreError(f"{path}: is no regular file")
    return descriptor


@contextmanager
def _opened(root: Path, name: str, flags: int, shown: str | None = None) -> Iterator[int]:
    """Descriptor of the file `name` of a directory."""
    with _parent(root, name, shown) as (folder, last):
        descriptor = open_regular(folder.path / last, flags, folder)
        try:
            yield descriptor
        finally:
            os.close(descriptor)


# ---- writing


def temporary_name(name: str) -> str:
    """The name under which the content of the file `name` is written until it is complete."""
    folder, slash, last = name.rpartition("/")
    return f"{folder}{slash}.{last}.tmp"


def is_temporary(name: str) -> bool:
    """True for the names that `temporary_name` makes."""
    return name.startswith(".") and name.endswith(".tmp")


def write_durably(path: Path, content: bytes) -> None:
    """Replace the file `path`, as the user named it; on return both the bytes and the name are on the disk."""
    write_inside(path.parent, path.name, content)


def write_inside(root: Path, name: str, content: bytes | memoryview) -> None:
    """Replace the file `name` of a directory; on return both the bytes and the name are on the disk."""
    write_synced(root, temporary_name(name), content, name)
    publish(root, temporary_name(name), name)


def write_synced(root: Path, name: str, content: bytes | memoryview, shown: str | None = None) -> None:
    """Write a new file and sync its bytes, but not its name.  shown : name for messages, if not `name`."""
    try:
        with _opened(root, name, _NEW, shown) as descriptor:
            write_all(descriptor, content)
            sync(descriptor)
    except DiskError:
        _discard(root, name)
        raise


def leave(root: Path, name: str, content: bytes = b"") -> None:
    """Write a file without syncing it; a power cut may remove it."""
    with _opened(root, name, _NEW) as descriptor:
        write_all(descriptor, content)


def append_synced(root: Path, name: str, at: int, content: bytes) -> None:
    """Write `content` after the first `at` bytes of a file, and sync it.  After an error the file ends at `at`."""
    with _opened(root, name, os.O_RDWR) as descriptor:
        os.ftruncate(descriptor, at)
        os.lseek(descriptor, at, os.SEEK_SET)
        try:
            write_all(descriptor, content)
            sync(descriptor)
        except OSError:
            with suppress(OSError):  # content that was written but not synced must not be read
                os.ftruncate(descriptor, at)
            raise


def publish(root: Path, temporary: str, name: str) -> None:
    """Rename a synced file within its folder, replacing a file of that name; on return the name is on the disk."""
    publish_all(root, [(temporary, name)])


def publish_all(root: Path, names: Sequence[tuple[str, str]]) -> None:
    """Rename synced files within one folder, as `publish`; the folder is synced once.  names : (temporary, final)."""
    with _parent(root, names[0][1]) as (folder, _):
        for temporary, name in names:
            before, last, held = temporary.rpartition("/")[2], name.rpartition("/")[2], folder.descriptor
            try:
                with disk_errors(root / name), _refusing_folder(folder.path / last):
                    os.replace(folder.of(before), folder.of(last), src_dir_fd=held, dst_dir_fd=held)
            except StoreError:
                _discard(root, temporary)
                raise
        _sync_names(folder)


def remove_file(root: Path, name: str) -> None:
    """Remove the file `name` of a directory, if it exists; a symbolic link is removed, not its target."""
    with _parent(root, name) as (folder, last), _refusing_folder(folder.path / last), suppress(FileNotFoundError):
        os.unlink(folder.of(last), dir_fd=folder.descriptor)


def open_to_append(root: Path, name: str) -> int:
    """Descriptor at the end of the file `name` of a directory; the file and the folders on its path are created."""
    with _parent(root, name, make=True) as (folder, last):
        return open_regular(folder.path / last, os.O_WRONLY | os.O_CREAT | os.O_APPEND, folder)


def copy_into(root: Path, name: str, source: Path) -> None:
    """Write a copy of the regular file `source` as the file `name` of a directory, and create the folders on its path.

    It is not synced.  Long stretches of zeros, such as those of a sparse file, take no room.
    """
    make_way(root, name)
    with disk_errors(source), open(open_regular(source, os.O_RDONLY), "rb") as file:
        with _opened(root, name, _NEW) as descriptor:
            while piece := file.read(_PIECE):
                if piece == bytes(len(piece)):
                    os.lseek(descriptor, len(piece), os.SEEK_CUR)
                else:
                    write_all(descriptor, piece)
            os.ftruncate(descriptor, os.lseek(descriptor, 0, os.SEEK_CUR))


def remove_if_empty(folder: Path) -> None:
    """Remove a folder, unless something is in it, or it is the working folder, a link or a mount."""
    with suppress(OSError):
        folder.rmdir()


def remove_folder(root: Path, name: str) -> None:
    """Remove the folder `name` of a directory with all that is in it, if it exists; of a symbolic link, the link."""
    with _parent(root, name) as (folder, last), suppress(FileNotFoundError):
        if stat.S_ISDIR(os.stat(folder.of(last), dir_fd=folder.descriptor, follow_symlinks=False).st_mode):
            shutil.rmtree(folder.of(last), dir_fd=folder.descriptor)
        else:
            os.unlink(folder.of(last), dir_fd=folder.descriptor)


def _discard(root: Path, name: str) -> None:
    """Remove a file that could not be written; further errors are ignored, since the first one is reported."""
    with suppress(StoreError):
        remove_file(root, name)


def write_all(descriptor: int, content: bytes | memoryview) -> None:
    """Write every byte; the system may take fewer at a time."""
    view = memoryview(content)
    while view:
        view = view[os.write(descriptor, view) :]


def sync(descriptor: int) -> None:
    """On return the bytes of a file, or the names in a folder, are on the disk.

    On macOS fsync leaves them in the drive's cache; F_FULLFSYNC does not, where the volume supports it.
    """
    if _FULL_SYNC is not None:
        with suppress(OSError):
            fcntl.fcntl(descriptor, _FULL_SYNC)
            return
    os.fsync(descriptor)


def sync_file(root: Path, name: str) -> None:
    """On return the bytes of the file `name` of a directory are on the disk."""
    with _opened(root, name, os.O_RDWR) as descriptor:
        sync(descriptor)


def make_folder(path: Path) -> None:
    """Create the folder `path`, as the user named it, with its parents, and sync the names that are new."""
    new = [folder for folder in (path, *path.parents) if not folder.exists()]
    with disk_errors(path):
        path.mkdir(parents=True, exist_ok=True)
    for folder in new:
        sync_folder(folder.parent)


def make_way(root: Path, name: str) -> None:
    """Create the folders on the path to the file `name` of a directory, and sync their names."""
    with _parent(root, name, make=True):
        pass


def sync_folder(path: Path) -> None:
    """Make the names in the folder `path`, as the user named it, durable."""
    with disk_errors(path), _held(path) as folder:
        _sync_names(folder)


def sync_names(root: Path, name: str) -> None:
    """Make the names in the folder of the file `name` of a directory durable."""
    with _parent(root, name) as (folder, _):
        _sync_names(folder)


def _sync_names(folder: _Folder) -> None:
    """Sync the names in a folder.  Windows cannot open a folder; there the file system journals renames."""
    if folder.descriptor is not None:
        sync(folder.descriptor)


# ---- reading


def names_in(root: Path, inner: str = "") -> list[str]:
    """Names of all that is in the folder `inner` of a directory, or in the directory itself."""
    with _parent(root, f"{inner}/*".lstrip("/"), inner or ".") as (folder, _):
        return sorted(os.listdir(folder.path if folder.descriptor is None else folder.descriptor))


def read_file(path: Path, limit: int = MOST_OF_FILE) -> bytes:
    """The content of the regular file `path`, as the user named it.

    StoreError if more than `limit` bytes would be read, or more than the memory can hold.
    """
    return read_inside(path.parent, path.name, limit=limit)


def read_short(path: Path) -> bytes:
    """The content of a text file, such as a campaign or a manifest."""
    return read_file(path, limit=MOST_OF_TEXT)


def read_inside(root: Path, name: str, most: int | None = None, limit: int = MOST_OF_FILE) -> bytes:
    """The content of the file `name` of a directory, or its first `most` bytes; limit : as of `read_file`."""
    with _opened(root, name, os.O_RDONLY) as descriptor:
        size = _size(descriptor, root / name, most, limit)
        try:
            with os.fdopen(descriptor, "rb", closefd=False) as file:
                return file.read() if most is None else file.read(min(most, size))
        except MemoryError as error:
            raise StoreError(f"{root / name}: has {size:,} bytes, which do not fit into the memory") from error


def _size(descriptor: int, path: Path, most: int | None, limit: int) -> int:
    size = os.fstat(descriptor).st_size
    if (size if most is None else min(most, size)) > limit:
        raise StoreError(f"{path}: damaged, {size:,} bytes where no such file has more than {limit:,}")
    return size
