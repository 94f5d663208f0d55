"""The writer lock: at most one process writes to the directory of a run, a tuning or a rare event.

It is a lock of the operating system on the file `.lock` and, if there is one, on the journal, so that deleting `.lock`
does not release it.  It ends with its process.  `.lock` contains the writer's record, for messages and for the writer
that takes over after a kill; the file is empty while nobody writes.

On file systems without locks (some cluster mounts) the record itself is the lock.  The process that creates the file
`.lock.claim`, exclusively, may check the record and replace it by its own.  The record of a process that has ended is
ignored; that of a process on another machine holds until a person deletes the file.  A writer checks before each step
that it still has the lock.
"""

import errno
import json
import os
import secrets
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Any

from mc_engine.durable_file import disk_errors, make_folder, open_regular, read_short
from mc_engine.errors import StoreError
from mc_engine.store.journal import utc_now
from mc_engine.store.run_files import JOURNAL

LOCK_NAME, CLAIM = ".lock", ".lock.claim"
LOCK_FILES = frozenset({LOCK_NAME, CLAIM})
PATIENCE_S = 0.25  # `holder` takes the lock for an instant, which must not be taken for a writer
_UNSUPPORTED = {errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOLCK, errno.ENOTSUP}
_CONTESTED = {errno.EAGAIN, errno.EACCES, errno.EDEADLK}


class _BusyError(Exception):
    """Another process has the lock."""


class WriterLock:
    """The lock of one directory; `acquire` and `release` come in pairs, or a `with` block does both."""

    def __init__(self, folder: Path, name: str = LOCK_NAME, journal: str = JOURNAL):
        """name, journal : of the lock file, and of the journal that it is for, in `folder`."""
        self.path = folder / name
        self._names = _locked_files(name, journal)
        self._locked: list[int] = []  # descriptors; none on a file system without locks
        self._record = b""  # what `.lock` holds while this object has the lock
        self._held = ExitStack()

    def __enter__(self) -> dict[str, Any] | None:
        return self.acquire()

    def __exit__(self, *_: object) -> None:
        self.release()

    @property
    def held(self) -> bool:
        """True while this object holds the lock."""
        return bool(self._record)

    def acquire(self) -> dict[str, Any] | None:
        """Take the lock.  Returns the record of the last writer if it was killed, else None.

        Raises StoreError, which names the path, within a second if another process is writing.
        """
        deadline = time.monotonic() + PATIENCE_S
        while True:
            try:
                with disk_errors(self.path):
                    return self._take()
            except _BusyError as error:
                if time.monotonic() > deadline:
                    raise StoreError(f"{self.path.parent}: {error}") from None
            time.sleep(0.02)

    def _take(self) -> dict[str, Any] | None:
        with ExitStack() as held:
            locked = _system_locks(self.path.parent, self._names, held, os.O_CREAT)
            with nullcontext() if locked else _claimed(self.path.with_name(CLAIM)):
                before = _read(self.path)
                if _is_at_work(before, locked):
                    way_out = f"this file system has no locks: if that process is over, delete {self.path}"
                    raise _BusyError(f"{described(before)} is writing here; {way_out}")
                record = {"pid": os.getpid(), **_here(), "since": utc_now(), "start": _start(os.getpid())}
                own = secrets.token_hex(4)  # the next writer may be of the same process and instant
                content = json.dumps({**record, "locks": bool(locked), "own": own}).encode()
                _overwrite(self.path, locked, content)
            self._locked, self._record, self._held = locked, content, held.pop_all()
        return before

    def check(self) -> None:
        """StoreError if this object took the lock and has lost it since."""
        with disk_errors(self.path):
            if not self.held or self._is_ours():
                return
        lost = f"was moved or removed, or its {self.path.name} was deleted or taken over"
        raise StoreError(f"{self.path.parent}: {lost}, while this process was writing there; it has stopped")

    def _is_ours(self) -> bool:
        if self._locked:
            return _is_at(self.path.with_name(self._names[len(self._locked) - 1]), self._locked[-1])
        return self.path.exists() and read_short(self.path) == self._record

    def release(self) -> None:
        """Release the lock, even if the record cannot be emptied.  The record of another writer is not changed."""
        with self._held, suppress(OSError, StoreError):
            if self.held and self._is_ours():
                _overwrite(self.path, self._locked, b"")
        self._record = b""


@contextmanager
def writer_of_new(folder: Path, refuse: Callable[[], None]) -> Iterator[WriterLock]:
    """Create the directory `folder` and hold its lock within the block; it is removed if the block leaves it empty.

    refuse : raises StoreError if the directory is occupied.
    """
    refuse()
    make_folder(folder)
    with (lock := WriterLock(folder)):
        refuse()  # again, with the lock: another process may have been faster
        done = False
        try:
            yield lock
            done = True
        finally:
            with suppress(OSError):
                if done or os.listdir(folder) == [LOCK_NAME]:
                    lock.path.unlink()
                    folder.rmdir()  # where it is empty


def holder(folder: Path, name: str = LOCK_NAME, journal: str = JOURNAL) -> dict[str, Any] | None:
    """The record of the process that is writing in `folder`; None if there is none."""
    with suppress(OSError, StoreError), ExitStack() as held:  # no rights to lock: the writer cannot be determined
        try:
            locked = _system_locks(folder, _locked_files(name, journal), held)
        except _BusyError:
            return _read(folder / name) or {}
        record = _read(folder / name)
        return record if _is_at_work(record, locked) else None
    return None


def is_left_by_dead(folder: Path) -> bool:
    """True if the last writer in `folder` was killed; called while no process writes there."""
    with suppress(StoreError):
        return _read(folder / LOCK_NAME) is not None
    return False


def _system_locks(folder: Path, names: tuple[str, ...], held: ExitStack, flags: int = 0) -> list[int]:
    """Descriptors of the lock file and the journal, with the system's lock; none on a file system without locks.

    flags : O_CREAT, to create the lock file if it is missing.  held : closing it releases the locks.
    """
    locked: list[int] = []
    for name in names:
        path = folder / name
        creation = flags if name == names[0] else 0
        if not creation and not path.exists():
            continue
        with disk_errors(path):
            descriptor = open_regular(path, os.O_RDWR | creation)
        held.callback(_let_go, descriptor)
        try:
            _system_lock(descriptor, take=True)
        except OSError as error:
            if error.errno in _UNSUPPORTED:
                return []
            if error.errno not in _CONTESTED:
                raise
            raise _BusyError(f"{described(_read(folder / names[0]))} is writing here") from None
        if not _is_at(path, descriptor):
            raise _BusyError("another writer is writing here")  # it replaced the file before we had the lock
        locked.append(descriptor)
    return locked


@contextmanager
def _claimed(path: Path) -> Iterator[None]:
    """Create the file `path`, which only one process can do, and remove it at the end of the block."""
    try:
        os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
    except FileExistsError:
        way_out = f"if none is, one was killed at that moment: delete {path}"
        raise _BusyError(f"another writer is about to begin here; {way_out}") from None
    try:
        yield
    finally:
        path.unlink(missing_ok=True)


def _is_at(path: Path, descriptor: int) -> bool:
    """Whether `path` is the name of the open file."""
    try:
        return os.path.samestat(os.stat(path, follow_symlinks=False), os.fstat(descriptor))
    except FileNotFoundError:
        return False


def _let_go(descriptor: int) -> None:
    with suppress(OSError):  # closing alone would leave the lock with a forked child that still has the descriptor
        _system_lock(descriptor, take=False)
    os.close(descriptor)


if os.name == "nt":
    import msvcrt

    def _locked_files(name: str, journal: str) -> tuple[str, ...]:
        return (name,)  # an open file can neither be deleted nor replaced here

    def _system_lock(descriptor: int, take: bool) -> None:
        # Windows locks bytes against reading, too: a byte far behind the record keeps the record readable.
        os.lseek(descriptor, 1 << 20, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK if take else msvcrt.LK_UNLCK, 1)  # type: ignore[attr-defined, unused-ignore]
else:
    import fcntl

    def _locked_files(name: str, journal: str) -> tuple[str, ...]:
        return (name, journal)

    def _system_lock(descriptor: int, take: bool) -> None:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB if take else fcntl.LOCK_UN)


def _is_at_work(record: dict[str, Any] | None, locked: list[int]) -> bool:
    """Whether the writer of a record may be running.  locked : the system's locks, if this process has them."""
    if record is None or (locked and record.get("locks", True)):
        return False
    elsewhere = any(record.get(key, value) != value for key, value in _here().items())
    if elsewhere or os.name == "nt":  # on Windows `os.kill` would end the process
        return True
    try:
        pid = int(record["pid"])
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except (OSError, KeyError, ValueError, TypeError, OverflowError):
        return True
    start = _start(pid)  # the number may belong to a later process
    return start is None or start == record.get("start", start)


def _here() -> dict[str, str]:
    """What identifies the space of process numbers: this machine, and the container on it."""
    host = {"host": socket.gethostname()}
    with suppress(OSError):
        return {**host, "numbers": os.readlink("/proc/self/ns/pid")}
    return host


def _start(pid: int) -> int | None:
    """Start of a process in ticks since the start of its machine; -1 if it has ended, None without /proc."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()
    except OSError:
        return None
    return -1 if fields[0] in (b"Z", b"X") else int(fields[19])


def _read(path: Path) -> dict[str, Any] | None:
    """The record in a lock file; None if the file is empty, {} if it holds anything else."""
    try:
        content = read_short(path) if os.path.lexists(path) else b""
    except StoreError:
        if os.path.lexists(path):
            raise
        content = b""  # it was deleted meanwhile
    try:
        record = json.loads(content) if content.strip(b"\0 \n") else None
    except (ValueError, RecursionError):
        return {}
    return record if record is None or isinstance(record, dict) else {}


def _overwrite(path: Path, locked: list[int], content: bytes) -> None:
    # On Windows only the descriptor that has the lock can write.  Without locks, the writer that made the directory may
    # have removed the file since it was looked for.
    descriptor = locked[0] if locked else open_regular(path, os.O_WRONLY | os.O_CREAT)
    try:
        os.ftruncate(descriptor, 0)
        os.lseek(descriptor, 0, os.SEEK_SET)
        if content:
            os.write(descriptor, content)
    finally:
        if not locked:
            os.close(descriptor)


def described(record: dict[str, Any] | None) -> str:
    """The holder of a lock, for messages."""
    if not record:
        return "another writer"
    pid, host, since = (json.dumps(str(record.get(name))[:100])[1:-1] for name in ("pid", "host", "since"))
    return f"process {pid} on {host} (since {since})"
