"""Interruption by Ctrl-C or SIGTERM.

While cases fly, the first signal lets the chunks in flight complete, or gives up cases in flight that may take long,
and the second one stops at once.  At any other time the first signal ends the command, and the second one the process.
The exit status is INTERRUPTED, and the message names the command that continues.  This module imports very little, so
that the command line can install its handlers before it loads the rest.

Python runs signal handlers in its main thread, between two bytecodes.  A kernel or the compiler would delay them, so
the main thread of a command leaves both to other threads, a worker pool or `in_threads`, and waits.
"""

import atexit
import os
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from types import FrameType
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

from mc_engine.text import clean

if TYPE_CHECKING:
    from concurrent.futures import Future

S = TypeVar("S")
T = TypeVar("T")
INTERRUPTED = 4  # the exit status
_MODEL_FAULT = 2  # the exit status of a faulty model
NOTHING_BEGUN = "interrupted; nothing was begun, give the same command again"
ONCE_MORE = "interrupted; the same command begins again from the start"
COMPLETING = "interrupted; the cases in flight are completed first, a second signal stops at once"
GIVING_UP = "interrupted; the cases in flight are given up, a second signal stops at once"

_LOOK_EVERY_S = 0.2
_ONE_SIGNAL_S = 0.05  # signals closer than this are one: `timeout` signals a process and then its group

# Windows has Ctrl-Break beside Ctrl-C, and SIGTERM in name only.
SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGBREAK") if hasattr(signal, name))


class Interrupted(KeyboardInterrupt):
    """Raised by a signal.

    Not a plain KeyboardInterrupt: Python remembers one that passes through `exec`, as in the making of a dataclass, and
    would then end the process by SIGINT, whatever its exit status.
    """


Advice = Callable[[], str]
_leave = os._exit


@dataclass
class _CommandLine:
    """State of the signal handlers.  A process has one set of handlers, and so one such object.

    installed : the handlers are those of the command line, in process `process`.  signals : how many came since then.
    last_s : time of the last one.  under_way : a command is running, which an exception may unwind.
    done : the command has ended.  abandoned : a kernel or the compiler may still run, and nobody waits for it.
    """

    installed: bool = False
    process: int = 0
    signals: int = 0
    last_s: float = -_ONE_SIGNAL_S
    under_way: bool = False
    done: bool = False
    abandoned: bool = False
    advice: Advice = lambda: NOTHING_BEGUN

    def count(self) -> bool:
        """Count one more signal; False for one that belongs to the signal before it."""
        last, self.last_s = self.last_s, time.monotonic()
        if self.last_s - last < _ONE_SIGNAL_S:
            return False
        if self.installed:
            self.signals += 1
        return True

    def on_signal(self, number: int, frame: FrameType | None) -> None:
        if not self.count():
            return
        if self.signals > 1:
            self.leave_at_once()
        if self.done:
            return  # the command is complete; only the interpreter has yet to end
        if self.under_way:
            raise Interrupted
        self.leave_at_once()

    def leave_at_once(self) -> None:
        _write_error(interruption_message())
        _leave(INTERRUPTED)


def _write_error(message: str) -> None:
    """Write a line to standard error; not through sys.stderr, which a signal may have interrupted."""
    with suppress(OSError):
        begin = "\n" if os.isatty(2) else ""  # after ^C and a progress bar
        os.write(2, f"{begin}{clean(message)}\n".encode())


_COMMAND_LINE = _CommandLine()


def install_handlers() -> None:
    """Install the signal handlers of the command line in this process."""
    _COMMAND_LINE.installed, _COMMAND_LINE.process = True, os.getpid()
    for number in SIGNALS:
        signal.signal(number, _COMMAND_LINE.on_signal)
    os._exit = _report_exit
    atexit.register(_at_exit)  # the first one registered is the last one called


def _report_exit(status: int) -> NoReturn:
    """Replaces `os._exit`, with which a model could end a command without a message and with any exit status."""
    if os.getpid() == _COMMAND_LINE.process:  # not in a process that was forked from it
        caller = sys._getframe(1)
        place = f"{os.path.basename(caller.f_code.co_filename)}, line {caller.f_lineno}"
        _write_error(f"{place}: os._exit({status}) ends the program; a model only computes")
        status = _MODEL_FAULT
    _leave(status)


def ignore_signals() -> None:
    """Ignore all SIGNALS in this process from now on."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def _at_exit() -> None:
    """Let no late signal change the exit status of a command that is complete."""
    ignore_signals()
    if _COMMAND_LINE.abandoned:  # a kernel that may still run needs the interpreter: end without taking it down
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):
                stream.flush()
        _leave(INTERRUPTED)


def in_threads(work: Callable[[S], T], items: Sequence[S], workers: int = 1) -> list[T]:
    """What `work` returns for each of the items, by up to `workers` daemon threads, which delay no end of the process.

    Raises the first that `work` raises, once those under way have ended; items not begun by then are left.  A signal is
    handled at once.
    """
    from concurrent.futures import FIRST_EXCEPTION, Future, wait

    outcomes: list[Future[T]] = [Future() for _ in items]
    queue = deque((partial(work, item), outcome) for item, outcome in zip(items, outcomes, strict=True))

    def work_off() -> None:
        with suppress(IndexError):  # of the empty queue; an error of `work` is in its outcome
            while True:
                _settle(*queue.popleft())

    try:
        threads = [threading.Thread(target=work_off, daemon=True) for _ in range(min(workers, len(items)))]
        for thread in threads:
            thread.start()
        while True:
            done, waiting = wait(outcomes, _LOOK_EVERY_S, FIRST_EXCEPTION)  # Windows handles no signal in one long wait
            if failed := [outcome for outcome in done if outcome.exception() is not None]:
                queue.clear()
                for thread in threads:
                    while thread.is_alive():
                        thread.join(_LOOK_EVERY_S)
                failed[0].result()
            if not waiting:
                return [outcome.result() for outcome in outcomes]
    except KeyboardInterrupt:
        _COMMAND_LINE.abandoned = True
        raise
    finally:
        queue.clear()


def _settle(work: Callable[[], T], outcome: "Future[T]") -> None:
    try:
        outcome.set_result(work())
    except BaseException as error:
        outcome.set_exception(error)


@contextmanager
def under_way() -> Iterator[None]:
    """Within the block a command runs, and the first signal raises KeyboardInterrupt."""
    _COMMAND_LINE.advice = lambda: ONCE_MORE
    try:
        _COMMAND_LINE.under_way = True
        yield
    finally:
        _COMMAND_LINE.under_way = False
        _COMMAND_LINE.done = True


def advise(advice: Advice) -> None:
    """Set the function that gives the message of an interruption from here on."""
    _COMMAND_LINE.advice = advice


def interruption_message() -> str:
    """The message of an interrupted command: the state of the work, and the command that continues it."""
    try:
        return _COMMAND_LINE.advice()
    except Exception:  # the signal may have come at any moment, with the run's folder in any state
        return ONCE_MORE


def raise_if_signalled() -> None:
    """Raise KeyboardInterrupt if a signal has had no effect yet: it came after the last case, or in a callback."""
    if signalled():
        raise Interrupted


def signalled() -> bool:
    """Whether the command line has had a signal.  A library may raise an error of its own in place of Interrupted."""
    return _COMMAND_LINE.signals > 0


@contextmanager
def stop_signal(message: str = COMPLETING) -> Iterator[threading.Event]:
    """An event that the first SIGINT or SIGTERM sets, with a message; a second one raises KeyboardInterrupt.

    Outside the main thread, where Python handles no signals, the event is never set.
    """
    stop = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return

    def set_stop(number: int, frame: FrameType | None) -> None:
        if not _COMMAND_LINE.count():
            return
        if stop.is_set():
            _COMMAND_LINE.abandoned = True
            raise Interrupted
        stop.set()
        if _COMMAND_LINE.installed:
            _write_error(message)

    before: dict[int, Any] = {number: signal.signal(number, set_stop) for number in SIGNALS}
    if _COMMAND_LINE.signals:  # one that came before the event existed
        stop.set()
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def unsignalled_children() -> Iterator[None]:
    """Processes started in this block ignore Ctrl-C; this process handles one at the end of the block.

    Where signals cannot be blocked (Windows) the block has no effect.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
