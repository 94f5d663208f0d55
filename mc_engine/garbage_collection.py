"""Python's search for unreachable objects: rare in a process that ends with its command, and none in a compilation."""

import atexit
import gc
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Lock

_NEW_OBJECTS = 500_000  # before a search; most commands end with fewer
_IS_RARE = Event()


def collect_rarely() -> None:
    """Search for garbage only after many new objects, and not at the end of the process, whose memory goes with it.

    A command makes objects by the ten thousand and hardly any garbage.  As the interpreter ends it would search all of
    them several times, which takes longer than to load numpy.  What `atexit` and `weakref.finalize` registered still
    runs; `__del__` of objects in cycles that are there at the end does not, which Python does not promise either.
    """
    gc.set_threshold(_NEW_OBJECTS)
    atexit.register(gc.freeze)
    _IS_RARE.set()


@contextmanager
def without_collection() -> Iterator[None]:
    """Compile without a search among the objects that numba makes by the million: it takes up to a tenth longer.

    A compilation holds some tens of megabytes more.  After `collect_rarely` they are not searched behind it either;
    what it leaves is found before the next compilation of the process, which few have.  Threads may compile at once.
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
