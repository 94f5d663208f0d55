"""The disk as the engine meets it: every operation below one folder is told to a listener, which may let it fail.

Stands in the calls of Python that the engine writes with; Arrow writes to memory and never to a file.
"""

import builtins
import errno
import io
import os
import threading
from contextlib import contextmanager
from pathlib import Path


class Listener:
    """Hears of operations before they are done; an OSError raised here is theirs.

    kind : open, write, sync, rename, truncate, unlink, mkdir.
    """

    def before(self, kind, path):
        """Called with each operation and what it touches."""

    def after(self, kind, path, **facts):
        """Called when it is done.  facts : of open: fresh; of write: at, data; of truncate: size; of rename: to."""


class FailingCall(Listener):
    """Lets the n-th operation of a kind fail, counted from 0, and every later one too if it is to last."""

    def __init__(self, kind, n, number, lasting=False):
        self._kind, self._n, self._number, self._lasting = kind, n, number, lasting
        self.counted, self.failed = 0, []

    def before(self, kind, path):
        if kind != self._kind:
            return
        now, self.counted = self.counted, self.counted + 1
        if now == self._n or (self._lasting and now > self._n):
            self.failed.append(path)
            raise OSError(self._number, os.strerror(self._number), str(path))


@contextmanager
def watched_disk(root, listener):
    """Tell `listener` of every operation on the files and folders below `root`, one at a time."""
    watch = _Watch(Path(root).absolute(), listener)
    seams = [(os, name) for name in ("open", "write", "fsync", "replace", "ftruncate", "unlink", "mkdir", "close")]
    seams += [(builtins, "open"), (io, "open")]
    genuine = [(module, name, getattr(module, name)) for module, name in seams]
    try:
        for module, name in seams:
            setattr(module, name, getattr(watch, "open_file" if module is not os else name))
        yield listener
    finally:
        for module, name, call in genuine:
            setattr(module, name, call)


class _Watch:
    def __init__(self, root, listener):
        self._root, self._listener = root, listener
        self._lock = threading.RLock()
        self._paths = {}  # by descriptor
        self._os = {name: getattr(os, name) for name in dir(os) if callable(getattr(os, name))}
        self._open_file = io.open

    def _inside(self, path, folder=None):
        """The path below the root, or None.  folder : descriptor of the one that a name stands for a file in."""
        if isinstance(path, int) or (folder is not None and folder not in self._paths):
            return None
        path = (self._paths[folder] / path) if folder is not None else Path(os.fsdecode(path)).absolute()
        return path if path.is_relative_to(self._root) else None

    def _do(self, kind, path, call, facts=dict):
        with self._lock:
            self._listener.before(kind, path)
            result = call()
            self._listener.after(kind, path, **facts())
            return result

    def open(self, path, flags, mode=0o777, **options):
        inside = self._inside(path, options.get("dir_fd"))
        if inside is None:
            descriptor = self._os["open"](path, flags, mode, **options)
            self._paths.pop(descriptor, None)
            return descriptor
        if flags & os.O_DIRECTORY:  # on the way to a file, whose own opening is told
            self._paths[descriptor := self._os["open"](path, flags, mode, **options)] = inside
            return descriptor
        fresh = bool(flags & os.O_CREAT) and not os.path.exists(inside)
        with self._lock:
            descriptor = self._do("open", inside, lambda: self._os["open"](path, flags, mode, **options),
                                  lambda: {"fresh": fresh})  # fmt: skip
            self._paths[descriptor] = inside
        return descriptor

    def open_file(self, file, mode="r", buffering=-1, *more, **options):
        inside = self._inside(file)
        if inside is None:
            return self._open_file(file, mode, buffering, *more, **options)
        if mode in ("rb", "r"):
            return self._do("open", inside, lambda: self._open_file(file, mode, buffering, *more, **options),
                            lambda: {"fresh": False})  # fmt: skip
        assert buffering == 0, f"{inside}: written through a buffer, out of this test's sight"
        return _WatchedFile(self, inside, mode)

    def close(self, descriptor):
        self._paths.pop(descriptor, None)
        return self._os["close"](descriptor)

    def write(self, descriptor, data):
        path = self._paths.get(descriptor)
        if path is None:
            return self._os["write"](descriptor, data)
        at = os.lseek(descriptor, 0, os.SEEK_CUR)
        content = bytes(data)
        return self._do("write", path, lambda: self._os["write"](descriptor, data),
                        lambda: {"at": at, "data": content})  # fmt: skip

    def ftruncate(self, descriptor, size):
        path = self._paths.get(descriptor)
        if path is None:
            return self._os["ftruncate"](descriptor, size)
        return self._do("truncate", path, lambda: self._os["ftruncate"](descriptor, size), lambda: {"size": size})

    def fsync(self, descriptor):
        path = self._paths.get(descriptor)
        if path is None:
            return self._os["fsync"](descriptor)
        return self._do("sync", path, lambda: self._os["fsync"](descriptor))

    def replace(self, source, target, **options):
        path, to = (self._inside(name, options.get("src_dir_fd")) for name in (source, target))
        if path is None:
            return self._os["replace"](source, target, **options)
        return self._do("rename", path, lambda: self._os["replace"](source, target, **options), lambda: {"to": to})

    def unlink(self, path, **options):
        inside = self._inside(path, options.get("dir_fd"))
        if inside is None:
            return self._os["unlink"](path, **options)
        return self._do("unlink", inside, lambda: self._os["unlink"](path, **options))

    def mkdir(self, path, mode=0o777, **options):
        inside = self._inside(path, options.get("dir_fd"))
        if inside is None:
            return self._os["mkdir"](path, mode, **options)
        return self._do("mkdir", inside, lambda: self._os["mkdir"](path, mode, **options))


class _WatchedFile(io.FileIO):
    """A file without a buffer whose writes are seen."""

    def __init__(self, watch, path, mode):
        self._watch = watch
        fresh = "w" in mode and not os.path.exists(path)
        with watch._lock:
            watch._do("open", path, lambda: super(_WatchedFile, self).__init__(path, mode), lambda: {"fresh": fresh})
            if "w" in mode and not fresh:
                watch._listener.after("truncate", path, size=0)
            watch._paths[self.fileno()] = path

    def write(self, data):
        return self._watch.write(self.fileno(), data)

    def truncate(self, size=None):
        size = self.tell() if size is None else size
        self._watch.ftruncate(self.fileno(), size)
        return size

    def close(self):
        if not self.closed:
            self._watch._paths.pop(self.fileno(), None)
        super().close()


FULL, BROKEN, FORBIDDEN = errno.ENOSPC, errno.EIO, errno.EACCES
