"""Everything the engine raises on purpose.

EngineError
  CampaignError     the campaign file, or a number in it, is wrong; lists every problem, not the first
  ModelError        the model behind the campaign does not keep its contract
  StoreError        the run directory is damaged, busy, or belongs to another campaign
  RunInterrupted    the run was stopped from outside; what was committed is safe and `resume` completes it
"""

from collections.abc import Sequence
from dataclasses import dataclass


class EngineError(Exception):
    """Base of all errors that the engine raises on purpose; its text is one or more plain sentences."""


@dataclass(frozen=True)
class Problem:
    """One mistake: where it stands (dotted place in the campaign file) and what to do about it."""

    place: str
    message: str

    def __str__(self) -> str:
        return f"{self.place}: {self.message}" if self.place else self.message


class CampaignError(EngineError):
    """The campaign cannot be flown as written.  `problems` lists every mistake found."""

    def __init__(self, source: str, problems: Sequence[Problem]):
        self.source = source
        self.problems = tuple(problems)
        count = f"{len(self.problems)} problem{'s' if len(self.problems) != 1 else ''}"
        super().__init__("\n".join([f"{source}: {count}", *(f"  {problem}" for problem in self.problems)]))


class ModelError(EngineError):
    """The model breaks its contract: a missing field, a wrong shape, code the compiler cannot take."""


class StoreError(EngineError):
    """The run directory cannot be read or written as it stands; the text names the path."""


class RunInterrupted(EngineError):
    """The run was stopped; the text holds the command that completes it."""
