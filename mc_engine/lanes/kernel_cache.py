"""Compiled kernels on disk.  A file that cannot be read or written costs a compilation and ends no flight.

Each file holds one compiled kernel and its digest, which is checked before loading: damaged machine code may crash or
give wrong numbers.  The file's name contains all that the kernel was compiled for.  Files are replaced as a whole.
A lock per file keeps two processes from compiling the same kernel.
"""

import logging
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from hashlib import blake2b
from pathlib import Path
from typing import Any

from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile
from numba.core.serialize import dumps, loads

try:
    import fcntl
except ImportError:  # Windows: processes that start together may compile the same kernel, each for itself
    fcntl = None  # type: ignore[assignment]

_DIGEST_BYTES = 32


class _KernelData(CompileResultCacheImpl):
    """What is kept of a compiled kernel."""

    def reduce(self, result: Any) -> Any:
        """Without the empty environments of the physics inside it.

        No compiled code reads them, and each would import the model's module under the name that it had then.
        """
        *data, environments = super().reduce(result)
        return (*data, tuple(environment for environment in environments if environment.consts))


class KernelCache(FunctionCache):
    """numba's cache of one function, whose failures end no flight."""

    _impl_class = _KernelData

    def __init__(self, function: Any):
        super().__init__(function)
        self._cache_file = _Files(self._cache_path, self._impl.filename_base, None)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled function; None, to be compiled, where there is none or its file is damaged."""
        try:
            return super().load_overload(sig, target_context)
        except _Damaged:
            _warn(self.cache_path, "a compiled kernel is damaged there", "the model is compiled again")
        except Exception as error:  # the disk's, or of what another machine compiled
            _warn(self.cache_path, _reason(error), "a compiled kernel cannot be read there, and is compiled again")
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled function; a warning with the folder where the disk refuses."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            _refused(self.cache_path, error)

    @contextmanager
    def compiling(self, sig: Any, target_context: Any) -> Iterator[None]:
        """Hold a kernel's lock unless it is on disk: of processes that ask together one compiles, the others load."""
        path = self._cache_file.path(self._index_key(sig, target_context.codegen()))
        if path.exists():
            yield
        else:
            with _locked(path.with_suffix(".lock")):
                yield


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Hold the system's lock on a file, which ends with its process.  Where the system has none, go on without.

    The file is deleted at the end: who waits for it finds the kernel on disk when the lock is theirs.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = path.open("ab")
    except OSError:
        yield
        return
    with file:
        with suppress(OSError, AttributeError):
            fcntl.flock(file, fcntl.LOCK_EX)
        try:
            yield
        finally:
            with suppress(OSError):
                path.unlink()
            with suppress(OSError, AttributeError):  # closing alone would leave it to a child that was forked meanwhile
                fcntl.flock(file, fcntl.LOCK_UN)


class _Damaged(Exception):
    """A file is not what was written."""


class _Files(IndexDataCacheFile):
    """A file for each key, without an index, which processes that write at once would take from each other."""

    def load(self, key: Any) -> Any:
        try:
            content = self.path(key).read_bytes()
        except FileNotFoundError:
            return None
        digest, data = content[:_DIGEST_BYTES], content[_DIGEST_BYTES:]
        if digest != _digest(key, data):
            raise _Damaged
        return loads(data)

    def save(self, key: Any, data: Any) -> None:
        content = dumps(data)
        with self._open_for_write(str(self.path(key))) as file:
            file.write(_digest(key, content) + content)

    def path(self, key: Any) -> Path:
        """The file of a key."""
        name = self._data_name(0).removesuffix(".0.nbc")
        return Path(self._cache_path) / f"{name}.{_digest(key, b'').hex()[:16]}.nbc"


def _digest(key: Any, content: bytes) -> bytes:
    return blake2b(repr(key).encode() + content, digest_size=_DIGEST_BYTES).digest()


def keep_on_disk(dispatcher: Any) -> Any:
    """The dispatcher, which from now on keeps what it compiles next to its file.

    As numba's `cache=True`, but a disk that fails ends no flight, and two processes never compile the same kernel.
    """
    try:
        dispatcher._cache = kept = KernelCache(dispatcher.py_func)
    except RuntimeError as error:  # numba finds no folder that it may write to
        _refused("kernels", error)
        return dispatcher
    compile_alone = dispatcher.compile

    def compile_once(sig: Any) -> Any:
        with kept.compiling(sig, dispatcher.targetctx):
            return compile_alone(sig)

    dispatcher.compile = compile_once
    return dispatcher


def _refused(folder: str, error: Exception) -> None:
    what = "compiled kernels cannot be kept there, and will be compiled again; make room, or name another folder in "
    _warn(folder, _reason(error), f"{what}MC_ENGINE_CACHE")


def _reason(error: Exception) -> str:
    return str(getattr(error, "strerror", None) or error)


def _warn(folder: str, reason: str, what: str) -> None:
    logging.getLogger("mc_engine").warning("%s: %s; %s", folder, reason, what)
