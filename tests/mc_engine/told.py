"""The command line called in this process, through the streams that it has as a program: what a terminal would get."""

import contextlib
import io
import sys

from mc_engine.command_line.commands import app
from mc_engine.text import clean_streams

STEERING = {*map(chr, range(32)), *map(chr, range(127, 160))} - {"\n", "\t"}
HIDDEN = set("\u00ad\u061c\u200b\u200c\u200d\u200e\u200f\u2028\u2029\u202a\u202b\u202c\u202d\u202e\u2060\u2066\u2067"
             "\u2068\u2069\ufeff\ufffe\ue000\U000e0041")  # fmt: skip
PAYLOAD = "a\x1b[2J\x1b]0;t\x07\r\x9b31m\x7f\u202eevil\u2066\u200b\u2028\u2029\ufeff\ue000\ufffe\U000e0041z"
LONE = "\udcff"


def told(*words, encoding="utf-8"):
    """Exit status, standard output and standard error, as text."""
    streams = [io.TextIOWrapper(io.BytesIO(), encoding=encoding) for _ in range(2)]
    status = 0
    with contextlib.redirect_stdout(streams[0]), contextlib.redirect_stderr(streams[1]):
        try:
            with clean_streams():
                app([str(word) for word in words], prog_name="mc-engine")
        except SystemExit as leaving:
            status = leaving.code or 0
        sys.stdout.flush()
        sys.stderr.flush()
    return status, *(stream.buffer.getvalue().decode(encoding) for stream in streams)


def assert_harmless(text):
    assert not (STEERING | HIDDEN | {LONE}) & set(text), ascii(text)
    assert "Traceback" not in text
