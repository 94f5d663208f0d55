"""Python's garbage collection: rare in a process that ends with its command, and off during compilation."""

import atexit
import gc
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Lock

_NEW_OBJECTS = 500_000  # before a search; most commands end with fewer
_IS_RARE = Event()


def collect_rarely() -> None:
    """Collect garbage only after many new objects, and not at the end of the process, which frees all memory.

    A command makes tens of thousands of objects and hardly any garbage.  When the interpreter ends, it would search all
    of them several times, which takes longer than loading numpy.  Functions registered by `atexit` and
    `weakref.finalize` still run; `__del__` of objects then in cycles does not, which Python does not promise either.
    """
    gc.set_threshold(_NEW_OBJECTS)
    atexit.register(gc.freeze)
    _IS_RARE.set()


@contextmanager
def without_collection() -> Iterator[None]:
    """Within the block, no garbage collection among the millions of objects of numba, which saves up to a tenth.

    A compilation takes some tens of megabytes more.  After `collect_rarely` they are not collected afterwards either,
    but before the next compilation of the process, which few have.  Several threads may compile at the same time.
    """
    _SEARCH.stop()
    try:
        yield
    finally:
        _SEARCH.go_on()


class _Search:
    """Stopped by the first of several threads, and going on after the last."""

    def __init__(self) -> None:
        self._lock, self._stopped_by, self._was_on = Lock(), 0, False

    def stop(self) -> None:
        with self._lock:
            self._stopped_by += 1
            if self._stopped_by > 1:
                return
            self._was_on = gc.isenabled()
            gc.disable()
            if _IS_RARE.is_set() and gc.get_freeze_count():
                gc.unfreeze()
                gc.collect()

    def go_on(self) -> None:
        with self._lock:
            self._stopped_by -= 1
            if self._stopped_by:
                return
            if _IS_RARE.is_set():
                gc.freeze()
            if self._was_on:
                gc.enable()


_SEARCH = _Search()
