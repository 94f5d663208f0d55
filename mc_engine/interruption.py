"""Stopping from outside, by Ctrl-C or SIGTERM.

While cases fly, the first signal lets what is in flight land, the second breaks off.  At all other times of the command
line the first one ends what it is at, the second one the process, whatever it does.  Either way the exit status is
INTERRUPTED, and the last words are the command that goes on.  This module loads next to nothing: the command line
listens before it loads the rest of itself.

Python hands signals to its main thread, between two steps of its own.  Kernels and the compiler hold them off for as
long as they work, so the main thread of the command line calls them by `in_another_thread`, and waits.
"""

import atexit
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from types import FrameType
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

from mc_engine.text import clean

if TYPE_CHECKING:
    from concurrent.futures import Future

T = TypeVar("T")
INTERRUPTED = 4  # the exit status
_MODEL_FAULT = 2  # the exit status of all that is wrong with a model
NOTHING_BEGUN = "interrupted; nothing was begun, and the same command begins it"
ONCE_MORE = "interrupted; the same command does it all once more"
LANDING = "interrupted; what flies lands first, a second signal ends it at once"

_LOOK_EVERY_S = 0.2
_ONE_SIGNAL_S = 0.05  # what comes so soon after another was sent along with it: to the process, and to its group

# Windows has Ctrl-Break beside Ctrl-C, and SIGTERM in name only.
SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGBREAK") if hasattr(signal, name))


class Interrupted(KeyboardInterrupt):
    """What a signal raises.

    Of a kind of its own: Python remembers a plain KeyboardInterrupt that passes through `exec`, as in the making of a
    dataclass, and would end the process by SIGINT at the end of all, whatever its exit status.
    """


Advice = Callable[[], str]
_leave = os._exit


@dataclass
class _CommandLine:
    """What the signals of this process find: there is one set of handlers in a process, and so one of these.

    process : that listens.  heard : how many signals came since then.  last_s : when the last one came.
    under_way : a command is at work, which an exception may unwind.  done : the command has ended.
    abandoned : a kernel or the compiler is still at work, for nobody.
    """

    listening: bool = False
    process: int = 0
    heard: int = 0
    last_s: float = -_ONE_SIGNAL_S
    under_way: bool = False
    done: bool = False
    abandoned: bool = False
    advice: Advice = lambda: NOTHING_BEGUN

    def count(self) -> bool:
        """Count one more signal; false for one that was sent along with the last."""
        last, self.last_s = self.last_s, time.monotonic()
        if self.last_s - last < _ONE_SIGNAL_S:
            return False
        if self.listening:
            self.heard += 1
        return True

    def hear(self, number: int, frame: FrameType | None) -> None:
        if not self.count():
            return
        if self.heard > 1:
            self.leave_at_once()
        if self.done:
            return  # all was said and written; leaving takes a moment
        if self.under_way:
            raise Interrupted
        self.leave_at_once()

    def leave_at_once(self) -> None:
        _tell(last_words())
        _leave(INTERRUPTED)


def _tell(words: str) -> None:
    """A line on standard error; not through sys.stderr, in the middle of whose writing a signal may have come."""
    with suppress(OSError):
        begin = "\n" if os.isatty(2) else ""  # behind ^C and a bar of progress
        os.write(2, f"{begin}{clean(words)}\n".encode())


_COMMAND_LINE = _CommandLine()


def listen() -> None:
    """From here on the signals of this process are those of its command line."""
    _COMMAND_LINE.listening, _COMMAND_LINE.process = True, os.getpid()
    for number in SIGNALS:
        signal.signal(number, _COMMAND_LINE.hear)
    os._exit = _exit_with_a_word
    atexit.register(_end)  # the first one registered is the last one called


def _exit_with_a_word(status: int) -> NoReturn:
    """In place of `os._exit`, by which a model would end a command with its own status and without a word."""
    if os.getpid() == _COMMAND_LINE.process:  # not in a process that was forked from it
        caller = sys._getframe(1)
        place = f"{os.path.basename(caller.f_code.co_filename)}, line {caller.f_lineno}"
        _tell(f"{place}: os._exit({status}) ends the program; a model only computes")
        status = _MODEL_FAULT
    _leave(status)


def _end() -> None:
    """What comes while the interpreter is taken down must not turn the exit status of work that is done."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    if _COMMAND_LINE.abandoned:  # and what is still at work must not lose the interpreter under it
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):
                stream.flush()
        _leave(INTERRUPTED)


def in_another_thread(work: Callable[[], T]) -> T:
    """What `work` returns or raises.  The main thread of the command line hears signals meanwhile, and may leave it."""
    if not _COMMAND_LINE.listening or threading.current_thread() is not threading.main_thread():
        return work()
    from concurrent.futures import Future, wait

    outcome: Future[T] = Future()
    threading.Thread(target=_settle, args=(work, outcome), daemon=True).start()
    try:
        while not wait([outcome], _LOOK_EVERY_S).done:  # Windows hears nothing in a wait without an end
            pass
    except BaseException:
        _COMMAND_LINE.abandoned = True
        raise
    return outcome.result()


def _settle(work: Callable[[], T], outcome: "Future[T]") -> None:
    try:
        outcome.set_result(work())
    except BaseException as error:
        outcome.set_exception(error)


@contextmanager
def under_way() -> Iterator[None]:
    """A command is at work: the first signal raises KeyboardInterrupt in it."""
    _COMMAND_LINE.advice = lambda: ONCE_MORE
    try:
        _COMMAND_LINE.under_way = True
        yield
    finally:
        _COMMAND_LINE.under_way = False
        _COMMAND_LINE.done = True


def advise(advice: Advice) -> None:
    """What the command would say from here on, if it were interrupted."""
    _COMMAND_LINE.advice = advice


def last_words() -> str:
    """The sentence to leave with after an interruption."""
    try:
        return _COMMAND_LINE.advice()
    except Exception:  # in a process that was stopped in the middle of anything, with its folders in any state
        return ONCE_MORE


def heed() -> None:
    """Raise KeyboardInterrupt if a signal came that nobody has heeded: after the last case, or lost in a callback."""
    if _COMMAND_LINE.heard:
        raise Interrupted


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
        if not _COMMAND_LINE.count():
            return
        if stop.is_set():
            raise Interrupted
        stop.set()
        if _COMMAND_LINE.listening:
            _tell(LANDING)

    before: dict[int, Any] = {number: signal.signal(number, ask) for number in SIGNALS}
    if _COMMAND_LINE.heard:  # before there was this event to set
        stop.set()
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
