"""Machine code of kernels on disk, which is a convenience: where it cannot be read or kept, kernels are compiled again.

numba's own cache takes every failure of the disk for the program's; its files stand beside that of the kernel.
"""

import logging
from contextlib import suppress
from typing import Any

from numba.core.caching import FunctionCache


class KernelCache(FunctionCache):
    """numba's cache of one function, whose failures end no flight."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled function; None, to be compiled, where a file of the cache is broken."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # a file that was cut or overwritten ends in errors of almost any kind
            self._forget()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled function; a warning with the folder where the disk refuses."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            _refused(self.cache_path, error)

    def _forget(self) -> None:
        with suppress(OSError):  # then it is broken for the next one, too
            self.flush()


def keep_on_disk(dispatcher: Any) -> Any:
    """The dispatcher, which from now on keeps what it compiles beside its file: numba's `cache=True`, but forgiving."""
    try:
        dispatcher._cache = KernelCache(dispatcher.py_func)
    except RuntimeError as error:  # numba finds no folder that it may write to
        _refused("kernels", error)
    return dispatcher


def _refused(folder: str, error: Exception) -> None:
    logging.getLogger("mc_engine").warning(
        "%s: %s; compiled kernels cannot be kept there, and will be compiled again; make room, or name another folder "
        "in MC_ENGINE_CACHE",
        folder,
        getattr(error, "strerror", None) or error,
    )
