"""The streams by which a process of the command line talks to its user, and what becomes of words that they refuse.

Words are not the work: a reader that has gone away (`| head`), a full disk behind a log, or a stream that the shell
closed neither stop a flight nor change its exit status.  Only a full disk behind standard output, where the words may
be what was asked for, is told, and is no success.
"""

import errno
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TextIO

from mc_engine.interruption import INTERRUPTED


class _Outlet(io.RawIOBase):
    """Writes to `raw`, and takes what is refused for written.

    At the bottom of a stream, so that it serves all that writes there: verbs, help, progress, warnings, libraries.
    refusal : the last one that was not for want of a reader.
    """

    def __init__(self, raw: Any):
        self._raw = raw
        self.refusal: OSError | None = None

    def write(self, content: Any) -> int:
        try:
            written: int | None = self._raw.write(content)
            if written is not None:
                return written
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))  # a full pipe that does not wait
        except BrokenPipeError:
            pass
        except OSError as error:
            self.refusal = error
        return len(content)

    def writable(self) -> bool:
        return True

    def fileno(self) -> int:
        return int(self._raw.fileno())

    def isatty(self) -> bool:
        return bool(self._raw.isatty())


@contextmanager
def user_streams() -> Iterator[None]:
    """What the block writes to standard output and error may be refused; for the process that ends with it."""
    _open_what_was_closed()
    if not (hasattr(sys.stdout, "buffer") and hasattr(sys.stderr, "buffer")):
        yield  # somebody gathers the words in memory, where nothing refuses them
        return
    told, said = _outlet_of(sys.stdout), _outlet_of(sys.stderr)
    sys.stdout, sys.stderr = _over(told, sys.stdout), _over(said, sys.stderr)
    try:
        yield
    except SystemExit as leaving:
        sys.stdout.flush()
        if told.refusal is None:
            raise
        done = "" if leaving.code else ", all else is done"
        print(f"standard output: {told.refusal.strerror}; not all was printed{done}", file=sys.stderr)
        sys.exit(leaving.code or INTERRUPTED)


def _open_what_was_closed() -> None:
    """Lest the next file that is opened, such as a journal, get the number of a stream, and the words meant for it."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):  # by number, of which the lowest is given
        if getattr(sys, name) is None:
            number = os.open(os.devnull, os.O_RDWR)
            os.set_inheritable(number, True)  # for worker processes too
            stream = open(number, mode, encoding="utf-8", closefd=False)
            setattr(sys, name, stream)
            setattr(sys, f"__{name}__", stream)  # where it stays when another takes its place


def _outlet_of(stream: TextIO) -> _Outlet:
    return _Outlet(getattr(stream.buffer, "raw", stream.buffer))  # unbuffered Python has no `raw` below


def _over(outlet: _Outlet, stream: Any) -> TextIO:
    """A text stream that writes as `stream` does, through the outlet."""
    return io.TextIOWrapper(
        io.BufferedWriter(outlet),
        encoding=stream.encoding,
        errors=stream.errors,
        line_buffering=stream.line_buffering or stream.write_through,
    )
