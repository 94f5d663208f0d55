"""Progress of a run: a bar with rate and remaining time on a terminal, otherwise a line every few seconds."""

import sys
import time
from collections.abc import Callable
from typing import Any, TextIO

from mc_engine.text import CleanStream

ProgressCall = Callable[[int, int, int], None]  # cases done, in all, failed
SECONDS_BETWEEN_LINES = 5.0


def pace(done: int, total: int, failed: int, rate: float | None) -> str:
    """Such as "4,000 of 10,000 cases, 812 cases/s, 7 s left, 3 failed".  rate : cases per second, if known."""
    words = [f"{done:,} of {total:,} cases"]
    if rate:
        words.append(f"{rate:,.0f} cases/s" if rate >= 10 else f"{rate:.2g} cases/s")
        if done < total:
            words.append(f"{duration((total - done) / rate)} left")
    if failed:
        words.append(f"{failed:,} failed")
    return ", ".join(words)


def duration(seconds: float) -> str:
    """A duration as text: "7 s", "2 min 05 s", "3 h 10 min"."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


class Progress:
    """A context manager that the runner calls with (done, total, failed).

    The rate counts from the first call, so that it includes neither compilation nor cases of an earlier session.
    """

    def __init__(self, stream: TextIO | None = None, clock: Callable[[], float] = time.monotonic):
        self.stream = stream if stream is not None else sys.stderr
        self._clock = clock
        self._begin: tuple[float, int] | None = None
        self._last_line = clock()
        self._printed = ""
        self._text = ""
        self._bar: Any = None
        self._task: Any = None

    def __enter__(self) -> "Progress":
        if self.stream.isatty():
            self._open_bar()
        return self

    def _open_bar(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn
        from rich.progress import Progress as Bar

        columns = (BarColumn(), TextColumn("{task.description}", markup=False))
        stream: Any = self.stream.steering() if isinstance(self.stream, CleanStream) else self.stream
        self._bar = Bar(*columns, console=Console(file=stream), transient=True)
        self._bar.start()
        # The bar has replaced both streams until it stops.
        sys.stdout, sys.stderr = CleanStream(sys.stdout), CleanStream(sys.stderr)
        self._task = self._bar.add_task("preparing", total=None)

    def __call__(self, done: int, total: int, failed: int) -> None:
        now = self._clock()
        if self._begin is None:
            self._begin = (now, done)
        elapsed, flown = now - self._begin[0], done - self._begin[1]
        self._text = pace(done, total, failed, flown / elapsed if elapsed > 0 and flown > 0 else None)
        if self._bar is not None:
            self._bar.update(self._task, completed=done, total=total, description=self._text)
        elif now - self._last_line >= SECONDS_BETWEEN_LINES:
            self._last_line = now
            self._print()

    def _print(self) -> None:
        if self._text != self._printed:
            print(self._text, file=self.stream, flush=True)
            self._printed = self._text

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()
        self._print()
