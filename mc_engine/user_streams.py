"""The streams by which a process of the command line talks to its user, and what becomes of words that they refuse.

All text goes out here, and goes out clean: of commands, help, progress, warnings and libraries.  What a stream's
encoding lacks is written as an escape.

Words are not the work: a reader that has gone away (`| head`), a full disk behind a log, or a stream that the shell
closed neither stop a flight nor change its exit status.  Only a full disk behind standard output, where the words may
be what was asked for, is told, and is no success.
"""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from mc_engine.interruption import INTERRUPTED
from mc_engine.text import clean


class Words:
    """Writes to a text stream, and takes what is refused for written; what follows a refusal is written nowhere.

    refusal : the first one that was not for want of a reader.  There is no `buffer`: bytes would not be clean.
    """

    buffer: Any = None

    def __init__(self, stream: Any, form: Callable[[str], str] = clean):
        self._stream, self._form = stream, form
        self.refusal: OSError | None = None

    def steering(self) -> "Words":
        """The same for a bar, whose text moves the cursor."""
        return Words(self._stream, str)

    def write(self, text: str) -> int:
        self._attempt(self._stream.write, self._form(text))
        return len(text)

    def flush(self) -> None:
        self._attempt(self._stream.flush)

    def _attempt(self, act: Callable[..., Any], *words: str) -> None:
        try:
            act(*words)
        except OSError as error:
            if not isinstance(error, BrokenPipeError):
                self.refusal = error
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self._stream.fileno())  # for what is still in the stream's memory, too
            os.close(nowhere)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def user_streams() -> Iterator[None]:
    """What the block writes to standard output and error may be refused; for the process that ends with it."""
    _open_what_was_closed()
    if not (hasattr(sys.stdout, "reconfigure") and hasattr(sys.stderr, "reconfigure")):
        yield  # somebody gathers the words in memory, where nothing refuses them
        return
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="backslashreplace")
    told = Words(sys.stdout)
    sys.stdout, sys.stderr = told, Words(sys.stderr)
    try:
        yield
    except SystemExit as leaving:
        told.flush()
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
