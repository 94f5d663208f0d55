"""Text of unknown origin, made safe for a terminal, a page or a picture.

Names and descriptions in a run, a campaign or a folder may contain characters that move the cursor, retitle the window,
reverse the reading order, or are invisible.  `clean` replaces them.

The command line writes through `clean_streams`.  A stream that cannot be written to, such as a closed pipe (`| head`),
stops no flight and changes no exit status; only a full disk behind standard output is reported as an error.
"""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from unicodedata import category

_NOT_ALL_PRINTED = 4  # the exit status, as of a full disk


def clean(text: str) -> str:
    r"""The text with every control or invisible character replaced by its escape, such as \x1b or \u202e.

    Replaced are controls except newline and tab, format characters (bidirectional, zero-width), line and paragraph
    separators, lone surrogates (from file names that are not UTF-8), and private and unassigned code points.
    """
    if text.isprintable():
        return text
    return "".join(map(_shown, text))


def _shown(letter: str) -> str:
    if letter.isprintable() or letter in "\n\t" or category(letter) == "Zs":
        return letter
    return letter.encode("unicode_escape").decode("ascii")


class CleanStream:
    """A stream that writes clean text.  After an error of the stream below, all further text is discarded.

    refusal : the first error, unless the reader has closed the pipe.  There is no `buffer`: bytes would not be cleaned.
    """

    buffer: Any = None

    def __init__(self, stream: Any, form: Callable[[str], str] = clean):
        self._stream, self._form = stream, form
        self.refusal: OSError | None = None

    def steering(self) -> "CleanStream":
        """The same stream without cleaning, for a progress bar, which has to move the cursor."""
        return CleanStream(self._stream, str)

    def write(self, text: str) -> int:
        self._attempt(self._stream.write, self._form(text))
        return len(text)

    def flush(self) -> None:
        self._attempt(self._stream.flush)

    def _attempt(self, act: Callable[..., Any], *text: str) -> None:
        try:
            act(*text)
        except OSError as error:
            if not isinstance(error, BrokenPipeError):
                self.refusal = error
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self._stream.fileno())  # also for text that the stream still buffers
            os.close(nowhere)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def clean_streams() -> Iterator[None]:
    """Clean standard output and error within the block, with which the process ends.

    Characters that the encoding of a stream lacks become escapes.  If standard output could not be written for another
    reason than a closed pipe, a message says so and the exit status is that of a full disk.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:  # closed by the shell: the next file opened must not get its descriptor
            setattr(sys, name, open(os.devnull, mode))
    if not (hasattr(sys.stdout, "reconfigure") and hasattr(sys.stderr, "reconfigure")):
        yield  # the streams are in memory, as in a test
        return
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="backslashreplace")
    output = sys.stdout = CleanStream(sys.stdout)
    sys.stderr = CleanStream(sys.stderr)
    try:
        yield
    except SystemExit as leaving:
        output.flush()
        if output.refusal is None:
            raise
        done = "" if leaving.code else ", all else is done"
        print(f"standard output: {output.refusal.strerror}; not all was printed{done}", file=sys.stderr)
        sys.exit(leaving.code or _NOT_ALL_PRINTED)
