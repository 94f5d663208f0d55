"""Stopping a run from outside: the first Ctrl-C (or SIGTERM) lets what is in flight land, the second breaks off."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

# Windows has Ctrl-Break beside Ctrl-C, and SIGTERM in name only.
SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGBREAK") if hasattr(signal, name))


@contextmanager
def stop_signal() -> Iterator[threading.Event]:
    """Event that is set by the first SIGINT or SIGTERM; a second one raises KeyboardInterrupt.

    Outside the main thread, where Python takes no signals, the event is never set.
    """
    stop = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return

    def ask(number: int, frame: FrameType | None) -> None:
        if stop.is_set():
            raise KeyboardInterrupt
        stop.set()

    before: dict[int, Any] = {number: signal.signal(number, ask) for number in SIGNALS}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def unsignalled_children() -> Iterator[None]:
    """Processes begun in this block do not hear a terminal's Ctrl-C; this process hears it when the block ends.

    Where signals cannot be held back (Windows) the block does nothing.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
