"""Text of unknown origin on its way to a reader: a terminal, a page, a picture.

Names, units and sentences of a run, a campaign or a folder may come from anyone.  Written as they are, some characters
move the cursor, retitle the window, turn the order of reading round, or hide.

The command line writes through `clean_streams`.  Text that a stream refuses stops no flight and changes no exit status,
as when a reader has gone away (`| head`).  Only a full disk behind standard output is told, and is no success.
"""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from unicodedata import category

_NOT_ALL_PRINTED = 4  # the exit status, as of a full disk


def clean(text: str) -> str:
    r"""The text with every character that steers, reorders or hides replaced by its escape, such as \x1b or \u202e.

    Those are controls but newline and tab, format characters (bidirectional, zero-width), line and paragraph
    separators, lone surrogates (of file names that are not UTF-8), and private and unassigned code points.
    """
    if text.isprintable():
        return text
    return "".join(letter if _is_shown(letter) else _escape(letter) for letter in text)


def _is_shown(letter: str) -> bool:
    return letter.isprintable() or letter in "\n\t" or category(letter) == "Zs"


def _escape(letter: str) -> str:
    return letter.encode("unicode_escape").decode("ascii")


class CleanStream:
    """Writes clean text to a stream.  What the stream refuses counts as written, and all that follows goes nowhere.

    refusal : the first one that was not for want of a reader.  There is no `buffer`: bytes would not be clean.
    """

    buffer: Any = None

    def __init__(self, stream: Any, form: Callable[[str], str] = clean):
        self._stream, self._form = stream, form
        self.refusal: OSError | None = None

    def steering(self) -> "CleanStream":
        """The same for a bar, whose text moves the cursor."""
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
            os.dup2(nowhere, self._stream.fileno())  # for what is still in the stream's memory, too
            os.close(nowhere)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def clean_streams() -> Iterator[None]:
    """Standard output and error of a process that ends with the block are clean; an encoding's gaps become escapes."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:  # closed by the shell: its number must not become that of the next file
            setattr(sys, name, open(os.devnull, mode))
    if not (hasattr(sys.stdout, "reconfigure") and hasattr(sys.stderr, "reconfigure")):
        yield  # somebody gathers the text in memory, where nothing is refused
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
