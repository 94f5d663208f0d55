"""One writer per directory of a run, a tuning or a rare event.

The lock is the operating system's own, on the file `.lock` and, where there is one, on the journal: deleting `.lock`
lets nobody in.  It falls with its process.  `.lock` holds the writer's record, for messages and for whoever takes over
after a kill, and is empty when nobody writes.

On file systems without locks (some cluster mounts) that record is the lock.  Who makes the file `.lock.claim`, which
the system lets one process do, may judge the record and put its own in place.  A writer whose process is over does not
count; one that cannot be seen from here keeps its lock until a person deletes the file.  A writer looks before each
step whether the lock is still its own.
"""

import errno
import json
import os
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Any

from mc_engine.durable_file import make_folder, naming, open_regular, read_short
from mc_engine.errors import StoreError
from mc_engine.store.journal import utc_now
from mc_engine.store.run_files import JOURNAL

LOCK_NAME, CLAIM = ".lock", ".lock.claim"
LOCK_FILES = frozenset({LOCK_NAME, CLAIM})
PATIENCE_S = 0.25  # a reader asking `holder` has the lock for an instant; a writer has it for longer
_UNSUPPORTED = {errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOLCK, errno.ENOTSUP}
_CONTESTED = {errno.EAGAIN, errno.EACCES, errno.EDEADLK}


class _BusyError(Exception):
    """Somebody else has the lock."""


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
        """Take the lock; the record of its last holder if that one died with it, else None.

        Raises StoreError within a second, naming the path, if another writer is at work.
        """
        deadline = time.monotonic() + PATIENCE_S
        while True:
            try:
                with naming(self.path):
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
                content = json.dumps({**record, "locks": bool(locked)}).encode()
                _overwrite(self.path, locked, content)
            self._locked, self._record, self._held = locked, content, held.pop_all()
        return before

    def check(self) -> None:
        """StoreError if this object took the lock, and the lock is no more that of the directory."""
        with naming(self.path):
            if not self.held or self._is_ours():
                return
        lost = f"was moved or removed, or its {self.path.name} was deleted or taken over"
        raise StoreError(f"{self.path.parent}: {lost}, while this process was writing there; it has stopped")

    def _is_ours(self) -> bool:
        if self._locked:
            return _is_at(self.path.with_name(self._names[len(self._locked) - 1]), self._locked[-1])
        return self.path.exists() and read_short(self.path) == self._record

    def release(self) -> None:
        """Give the lock back.  It falls even if the record cannot be emptied; that of a lock lost is left as it is."""
        with self._held, suppress(OSError, StoreError):
            if self.held and self._is_ours():
                _overwrite(self.path, self._locked, b"")
        self._record = b""


@contextmanager
def writer_of_new(folder: Path, refuse: Callable[[], None]) -> Iterator[WriterLock]:
    """Be the one writer of the new directory `folder`, which is gone again if the block leaves nothing there.

    refuse : raises StoreError where it is occupied.
    """
    refuse()
    make_folder(folder)
    with (lock := WriterLock(folder)):
        refuse()  # again: two may have come this far
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
    """The record of the writer now at work in `folder`; None if there is none."""
    with suppress(OSError, StoreError), ExitStack() as held:  # a directory we may only read: nobody to be told of
        try:
            locked = _system_locks(folder, _locked_files(name, journal), held)
        except _BusyError:
            return _read(folder / name) or {}
        record = _read(folder / name)
        return record if _is_at_work(record, locked) else None
    return None


def is_left_by_dead(folder: Path) -> bool:
    """True if the last writer in `folder`, where none is at work now, was killed."""
    with suppress(StoreError):
        return _read(folder / LOCK_NAME) is not None
    return False


def _system_locks(folder: Path, names: tuple[str, ...], held: ExitStack, flags: int = 0) -> list[int]:
    """Descriptors with the system's lock, of the lock file and the journal; none on a file system without locks.

    flags : O_CREAT, to make the lock file where it is not there.  held : closed to let them go.
    """
    locked: list[int] = []
    for name, more in ((name, flags * (name == names[0])) for name in names):
        path = folder / name
        if not more and not path.exists():
            continue
        with naming(path):
            descriptor = open_regular(path, os.O_RDWR | more)
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
            raise _BusyError("another writer is writing here")  # it replaced the file before the lock was ours
        locked.append(descriptor)
    return locked


@contextmanager
def _claimed(path: Path) -> Iterator[None]:
    """Have made the file `path`, which one process can."""
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
    """Whether the open file is the one that has this name now."""
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
        # Windows locks bytes against reading too: one far behind the record leaves the record readable.
        os.lseek(descriptor, 1 << 20, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK if take else msvcrt.LK_UNLCK, 1)  # type: ignore[attr-defined, unused-ignore]
else:
    import fcntl

    def _locked_files(name: str, journal: str) -> tuple[str, ...]:
        return (name, journal)

    def _system_lock(descriptor: int, take: bool) -> None:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB if take else fcntl.LOCK_UN)


def _is_at_work(record: dict[str, Any] | None, locked: list[int]) -> bool:
    """Whether the writer of a record may be at work, as it cannot be if it had the system's locks that are ours now."""
    if record is None or (locked and record.get("locks", True)):
        return False
    elsewhere = any(record.get(key, value) != value for key, value in _here().items())
    if elsewhere or os.name == "nt":  # where to ask for a process may end it
        return True
    try:
        pid = int(record["pid"])
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except (OSError, KeyError, ValueError, TypeError, OverflowError):
        return True
    start = _start(pid)  # its number may have been given to another process since
    return start is None or start == record.get("start", start)


def _here() -> dict[str, str]:
    """Where a process number means what it does here: on this machine, and in its container."""
    host = {"host": socket.gethostname()}
    with suppress(OSError):
        return {**host, "numbers": os.readlink("/proc/self/ns/pid")}
    return host


def _start(pid: int) -> int | None:
    """When a process began, in ticks since its machine did; -1 if it is dead, None where the system does not say."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()
    except OSError:
        return None
    return -1 if fields[0] in (b"Z", b"X") else int(fields[19])


def _read(path: Path) -> dict[str, Any] | None:
    """The record in a lock file; {} if it holds anything else, None if nothing."""
    try:
        content = read_short(path) if os.path.lexists(path) else b""
    except StoreError:
        if os.path.lexists(path):
            raise
        content = b""  # somebody deleted it meanwhile
    try:
        record = json.loads(content) if content.strip(b"\0 \n") else None
    except (ValueError, RecursionError):
        return {}
    return record if record is None or isinstance(record, dict) else {}


def _overwrite(path: Path, locked: list[int], content: bytes) -> None:
    # Windows lets only the descriptor with the lock write.
    descriptor = locked[0] if locked else open_regular(path, os.O_WRONLY)
    try:
        os.ftruncate(descriptor, 0)
        os.lseek(descriptor, 0, os.SEEK_SET)
        if content:
            os.write(descriptor, content)
    finally:
        if not locked:
            os.close(descriptor)


def described(record: dict[str, Any] | None) -> str:
    """The holder of a lock in words."""
    if not record:
        return "another writer"
    pid, host, since = (json.dumps(str(record.get(name))[:100])[1:-1] for name in ("pid", "host", "since"))
    return f"process {pid} on {host} (since {since})"
