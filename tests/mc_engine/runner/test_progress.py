import io

import pytest

from mc_engine.runner.progress import Progress, duration


class Clock:
    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.2, "0 s"), (59.4, "59 s"), (59.6, "1 min 00 s"), (125, "2 min 05 s"), (11_400, "3 h 10 min")],
)
def test_a_duration_reads_like_a_clock(seconds, words):
    assert duration(seconds) == words


def test_a_pipe_gets_a_line_every_five_seconds_and_the_last_one():
    stream, clock = io.StringIO(), Clock()
    with Progress(stream, clock) as progress:
        for second in range(13):
            clock.now = float(second)
            progress(1000 * second, 12_000, second // 6)
    lines = stream.getvalue().splitlines()
    assert lines == [
        "5,000 of 12,000 cases, 1,000 cases/s, 7 s left",
        "10,000 of 12,000 cases, 1,000 cases/s, 2 s left, 1 failed",
        "12,000 of 12,000 cases, 1,000 cases/s, 2 failed",
    ]


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_terminal_gets_a_bar_and_keeps_the_last_line(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    stream, clock = Terminal(), Clock()
    with Progress(stream, clock) as progress:
        progress(0, 100, 0)
        clock.now = 2.0
        progress(100, 100, 1)
    text = stream.getvalue()
    assert "━" in text
    assert text.endswith("100 of 100 cases, 50 cases/s, 1 failed\n")
