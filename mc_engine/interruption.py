"""Stopping from outside, by Ctrl-C or SIGTERM.

While cases fly, the first signal lets what is in flight land, the second breaks off.  At all other times of the command
line the first one ends what it is at, the second one the process, whatever it does.  Either way the exit status is
INTERRUPTED, and the last words are the command that goes on.  This module loads next to nothing: the command line
listens before it loads the rest of itself.

Python hands signals to its main thread, between two steps of its own; a kernel that flies there holds them off for as
long as it flies.  So a thread of the command line hears them too: it says at once that the first one was heard, and
ends the process where the main thread does not heed the second.
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
from typing import Any, NoReturn

from mc_engine.text import clean

INTERRUPTED = 4  # the exit status
_MODEL_FAULT = 2  # the exit status of all that is wrong with a model
NOTHING_BEGUN = "interrupted; nothing was begun, and the same command begins it"
ONCE_MORE = "interrupted; the same command does it all once more"
LANDING = "interrupted; what flies lands first, a second signal ends it at once"
BUSY = "interrupted; what is being worked out ends first, a second signal ends it at once"

_PROMPT_S = 0.5  # what the main thread may take to heed a signal
_LEAVING_S = 5.0  # and to end its workers after the second one
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

    process : that listens.  heard : how many the main thread has heeded.  noticed : how many came, as the watch
    counts them.
    under_way : a verb is at work, which an exception may unwind.  landing : what flies is let land before.
    done : the verb has ended.
    """

    listening: bool = False
    process: int = 0
    heard: int = 0
    noticed: int = 0
    under_way: bool = False
    landing: bool = False
    done: bool = False
    advice: Advice = lambda: NOTHING_BEGUN

    def hear(self, number: int, frame: FrameType | None) -> None:
        self.heard += 1
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

    def notice(self) -> None:
        """What the watch does about a signal; the main thread may be free to hear it, or not."""
        self.noticed += 1
        if self.noticed == 1 and self.landing:
            _tell(LANDING)
        elif self.noticed == 1:
            _later(_PROMPT_S, self._tell_unless_heeded)
        elif self.noticed == 2:
            _later(_PROMPT_S, self._leave_unless_heeded)

    def _tell_unless_heeded(self) -> None:
        if not self.heard and not self.done:
            _tell(BUSY)

    def _leave_unless_heeded(self) -> None:
        if self.heard > 1:
            time.sleep(_LEAVING_S)
        if not self.done:
            self.leave_at_once()


def _tell(words: str) -> None:
    """A line on standard error; not through sys.stderr, in the middle of whose writing a signal may have come."""
    with suppress(OSError):
        begin = "\n" if os.isatty(2) else ""  # behind ^C and a bar of progress
        os.write(2, f"{begin}{clean(words)}\n".encode())


def _later(seconds: float, act: Callable[[], None]) -> None:
    timer = threading.Timer(seconds, act)
    timer.daemon = True
    timer.start()


_COMMAND_LINE = _CommandLine()


def listen() -> None:
    """From here on the signals of this process are those of its command line."""
    _COMMAND_LINE.listening, _COMMAND_LINE.process = True, os.getpid()
    for number in SIGNALS:
        signal.signal(number, _COMMAND_LINE.hear)
    os._exit = _exit_with_a_word
    _begin_watch()
    atexit.register(_be_deaf)  # the first one registered is the last one called


def _exit_with_a_word(status: int) -> NoReturn:
    """In place of `os._exit`, by which a model would end a command with its own status and without a word."""
    if os.getpid() == _COMMAND_LINE.process:  # not in a process that was forked from it
        caller = sys._getframe(1)
        place = f"{os.path.basename(caller.f_code.co_filename)}, line {caller.f_lineno}"
        _tell(f"{place}: os._exit({status}) ends the program; a model only computes")
        status = _MODEL_FAULT
    _leave(status)


def _begin_watch() -> None:
    """Begin the thread that hears the signals whatever the main thread is at; without one where the system refuses."""
    reading, writing = os.pipe()
    try:
        if os.name == "posix":
            os.set_blocking(writing, False)  # as Python asks for; on Windows pipes have no such thing
        signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    except (OSError, ValueError):
        return
    threading.Thread(target=_watch, args=(reading,), name="signals", daemon=True).start()


def _watch(reading: int) -> None:
    """Notice every signal whose number Python writes into the pipe the moment it comes."""
    if hasattr(signal, "pthread_sigmask"):  # they are for the main thread, whose waiting they end
        signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    last = -_ONE_SIGNAL_S
    while numbers := os.read(reading, 64):
        if not set(numbers) & set(SIGNALS):
            continue
        now = time.monotonic()
        if now - last >= _ONE_SIGNAL_S:
            _COMMAND_LINE.notice()
        last = now


def _be_deaf() -> None:
    """What comes while the interpreter is taken down must not turn the exit status of work that is done."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def under_way() -> Iterator[None]:
    """A verb is at work: the first signal raises KeyboardInterrupt in it."""
    _COMMAND_LINE.advice = lambda: ONCE_MORE
    try:
        _COMMAND_LINE.under_way = True
        yield
    finally:
        _COMMAND_LINE.under_way = False
        _COMMAND_LINE.done = True


def advise(advice: Advice) -> None:
    """What the verb would say from here on, if it were interrupted."""
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
        if _COMMAND_LINE.listening:
            _COMMAND_LINE.heard += 1
        if stop.is_set():
            raise Interrupted
        stop.set()

    before: dict[int, Any] = {number: signal.signal(number, ask) for number in SIGNALS}
    _COMMAND_LINE.landing = True
    if _COMMAND_LINE.heard:  # before there was this event to set
        stop.set()
    try:
        yield stop
    finally:
        _COMMAND_LINE.landing = False
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
