"""One writer per run directory.

The lock is the operating system's own on the file `.lock`, which holds the writer's process number, machine and
start time for messages.  It falls with its process, so a lock left by a kill is stale at once; whoever takes it
over learns whose it was.  The file stays, empty, when the writer leaves: removing it would let two processes hold
a lock on two files of one name.

File systems without locks (some cluster mounts) are judged by the record alone: a process that lives here, or any
on another machine, keeps its lock until the file is deleted by hand.
"""

import errno
import json
import os
import socket
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from mc_engine.durable_file import naming, open_regular
from mc_engine.errors import StoreError
from mc_engine.journal import utc_now

LOCK_NAME = ".lock"
PATIENCE_S = 0.25  # a reader asking `holder` has the lock for an instant; a writer has it for longer
_UNSUPPORTED = {errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOLCK, errno.ENOTSUP}


class WriterLock:
    """The lock of one run directory; `acquire` and `release` come in pairs."""

    def __init__(self, folder: Path):
        self.path = folder / LOCK_NAME
        self._descriptor: int | None = None

    @property
    def held(self) -> bool:
        """True while this object holds the lock."""
        return self._descriptor is not None

    def acquire(self) -> dict[str, Any] | None:
        """Take the lock; the record of its last holder if that one died with it, else None.

        Raises StoreError within a second, naming the path, if another writer is at work.
        """
        with naming(self.path):
            descriptor = open_regular(self.path, os.O_RDWR | os.O_CREAT)
            try:
                before = self._wait(descriptor)
                record = {"pid": os.getpid(), "host": socket.gethostname(), "since": utc_now()}
                _overwrite(descriptor, json.dumps(record).encode())
            except BaseException:
                os.close(descriptor)
                raise
        self._descriptor = descriptor
        return before

    def _wait(self, descriptor: int) -> dict[str, Any] | None:
        deadline = time.monotonic() + PATIENCE_S
        while not _take(descriptor):
            if time.monotonic() > deadline:
                raise StoreError(f"{self.path.parent}: {described(_read(descriptor))} is writing here")
            time.sleep(0.02)
        return _read(descriptor)

    def release(self) -> None:
        """Give the lock back.  The lock falls even if the record cannot be emptied."""
        if self._descriptor is None:
            return
        descriptor, self._descriptor = self._descriptor, None
        try:
            with suppress(OSError):
                _overwrite(descriptor, b"")
                _system_unlock(descriptor)
        finally:
            os.close(descriptor)


def holder(folder: Path) -> dict[str, Any] | None:
    """The record of the writer now at work in `folder`; None if there is none."""
    try:
        descriptor = open_regular(folder / LOCK_NAME, os.O_RDWR)
    except (OSError, StoreError):
        return None  # no lock file, or a directory we may only read: nobody to be told of
    try:
        return None if _take(descriptor) else (_read(descriptor) or {})
    except OSError:
        return None
    finally:
        os.close(descriptor)


def _take(descriptor: int) -> bool:
    """Try for the system's lock; True if it is ours."""
    try:
        _system_lock(descriptor)
        return True
    except OSError as error:
        if error.errno in _UNSUPPORTED:
            return not _seems_alive(_read(descriptor))
        if error.errno in (errno.EAGAIN, errno.EACCES, errno.EDEADLK):
            return False
        raise


if os.name == "nt":
    import msvcrt

    def _system_lock(descriptor: int) -> None:
        # Windows locks bytes against reading too: one far behind the record leaves the record readable.
        os.lseek(descriptor, 1 << 20, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined, unused-ignore]

    def _system_unlock(descriptor: int) -> None:
        os.lseek(descriptor, 1 << 20, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_UNLCK, 1)  # type: ignore[attr-defined, unused-ignore]
else:
    import fcntl

    def _system_lock(descriptor: int) -> None:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def _system_unlock(descriptor: int) -> None:
        # Closing alone would leave the lock with a forked child that still has the descriptor.
        fcntl.flock(descriptor, fcntl.LOCK_UN)


def _seems_alive(record: dict[str, Any] | None) -> bool:
    if record is None:
        return False
    if record.get("host") != socket.gethostname() or os.name == "nt":
        return True
    try:
        os.kill(int(record["pid"]), 0)
    except ProcessLookupError:
        return False
    except (OSError, KeyError, ValueError, OverflowError):
        return True
    return True


def _read(descriptor: int) -> dict[str, Any] | None:
    os.lseek(descriptor, 0, os.SEEK_SET)
    content = os.read(descriptor, 4096)
    if not content.strip(b"\0 \n"):
        return None
    try:
        record = json.loads(content)
    except (ValueError, RecursionError):
        return {}
    return record if isinstance(record, dict) else {}


def _overwrite(descriptor: int, content: bytes) -> None:
    os.ftruncate(descriptor, 0)
    os.lseek(descriptor, 0, os.SEEK_SET)
    if content:
        os.write(descriptor, content)


def described(record: dict[str, Any] | None) -> str:
    """The holder of a lock in words."""
    if not record:
        return "another writer"
    pid, host, since = (json.dumps(str(record.get(name))[:100])[1:-1] for name in ("pid", "host", "since"))
    return f"process {pid} on {host} (since {since})"
