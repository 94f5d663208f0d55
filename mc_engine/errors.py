"""The errors that the engine raises on purpose.

EngineError
  CampaignError     the campaign file, or a number in it, is wrong; lists every problem, not only the first
  ModelError        the model of the campaign breaks its contract
  StoreError        the run directory is damaged, busy, or belongs to another campaign
    DiskError       the disk is full, write-protected or broken; committed cases are safe
  RunInterrupted    the run was stopped; committed cases are safe, and `resume` completes the run
  WorkersLost       the workers cannot be reached, or die repeatedly
"""

from collections.abc import Sequence
from dataclasses import dataclass

from mc_engine.text import clean

_LONGEST = 2000  # characters of one problem
MOST_SHOWN = 100  # problems of one campaign file


class EngineError(Exception):
    """Base of all errors that the engine raises on purpose; its text is one or more plain sentences."""

    def __str__(self) -> str:
        return clean(super().__str__())  # callers in Python may print it to a terminal


@dataclass(frozen=True)
class Problem:
    """One mistake: its place in the campaign file (dotted keys), and what to do about it."""

    place: str
    message: str

    def __str__(self) -> str:
        text = f"{self.place}: {self.message}" if self.place else self.message
        return text if len(text) <= _LONGEST else f"{text[: _LONGEST // 2]} ... {text[-_LONGEST // 2 :]}"


class CampaignError(EngineError):
    """The campaign cannot be flown as written.  `problems` lists every mistake found."""

    def __init__(self, source: str, problems: Sequence[Problem]):
        self.source = source
        self.problems = tuple(problems)
        count = f"{len(self.problems)} problem{'s' if len(self.problems) != 1 else ''}"
        lines = [f"  {problem}" for problem in self.problems[:MOST_SHOWN]]
        if len(self.problems) > MOST_SHOWN:
            lines.append(f"  and {len(self.problems) - MOST_SHOWN} more")
        super().__init__("\n".join([f"{source}: {count}", *lines]))


class ModelError(EngineError):
    """The model breaks its contract: a missing field, a wrong shape, code the compiler cannot take."""


class StoreError(EngineError):
    """The run directory cannot be read or written as it stands; the text names the path."""


class DiskError(StoreError):
    """The disk refused an operation; the text names the path.  What was committed before is safe."""


class RunInterrupted(EngineError):
    """The run was stopped; the text holds the command that completes it."""


class WorkersLost(EngineError):
    """The workers of a run cannot be reached or kept alive; the run turns it into RunInterrupted."""
