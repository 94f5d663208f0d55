"""The errors that the engine raises on purpose.

EngineError
  CampaignError     the campaign file, or a number in it, is wrong; lists every problem, not only the first
  ModelError        the model of the campaign breaks its contract
  StoreError        the run directory is damaged, busy, or belongs to another campaign
    DiskError       the disk is full, write-protected or broken; committed cases are safe
    UsageError      a request that a run, a folder or a URL cannot meet; nothing is damaged
  RunInterrupted    the run was stopped; committed cases are safe, and `resume` completes the run
  WorkersLost       the workers cannot be reached, or die repeatedly
"""

from collections.abc import Sequence
from dataclasses import dataclass

from mc_engine.text import clean

_LONGEST = 2000  # characters of one problem
MOST_SHOWN = 100  # problems of one campaign file


class EngineError(Exception):
    """Base class of every error that mc-engine raises on purpose; its text is one or more plain sentences.

    >>> try:
    ...     open_run("runs/nothing")
    ... except EngineError as error:
    ...     print(error)
    runs/nothing: there is no such folder
    """

    def __str__(self) -> str:
        return clean(super().__str__())  # callers in Python may print it to a terminal


@dataclass(frozen=True)
class Problem:
    """One mistake: its location in the campaign file (dotted keys), and what to do about it; its text is one line."""

    place: str
    message: str

    def __str__(self) -> str:
        text = (f"{self.place}: {self.message}" if self.place else self.message).replace("\n", "\\n")
        return text if len(text) <= _LONGEST else f"{text[: _LONGEST // 2]} ... {text[-_LONGEST // 2 :]}"


class CampaignError(EngineError):
    """The campaign cannot be flown as written.

    source : str, the campaign file, or the option of the command line
    problems : sequence of Problem (place, message), every mistake found; place : keys, as "dispersion.ve_pct.dist"

    >>> try:
    ...     load_campaign("minimal", cases=0)
    ... except CampaignError as error:
    ...     print(error.problems[0])
    campaign.cases: 0 is not allowed; it must be at least 1
    """

    def __init__(self, source: str, problems: Sequence[Problem]):
        self.source = source
        self.problems = tuple(problems)
        count = f"{len(self.problems)} problem{'s' if len(self.problems) != 1 else ''}"
        lines = [f"  {problem}" for problem in self.problems[:MOST_SHOWN]]
        if len(self.problems) > MOST_SHOWN:
            lines.append(f"  and {len(self.problems) - MOST_SHOWN} more")
        super().__init__("\n".join([f"{source}: {count}", *lines]))


class ModelError(EngineError):
    """The model has an error: a missing field, a wrong shape, or code that cannot be compiled.

    >>> from mc_engine.model import load_model
    >>> try:
    ...     load_model("campaigns.mars")
    ... except ModelError as error:
    ...     print(error)
    there is no module "campaigns.mars"; a file beside the campaign ends in .py
    """


class StoreError(EngineError):
    """The run directory cannot be read or written in its present state; the text names the path.

    >>> try:
    ...     open_store("runs/small").row(99)
    ... except StoreError as error:
    ...     print(error)
    runs/small: case 99 is not there
    """


class DiskError(StoreError):
    """The disk refused an operation; the text names the path.  What was committed before is safe."""


class UsageError(StoreError):
    """A request that is impossible for a run, a folder or a URL; nothing is damaged, and the text gives the remedy."""


class RunInterrupted(EngineError):
    """The run was stopped, by Ctrl-C or a full disk; the text contains the command that completes it.

    Completed chunks are kept, and `resume` flies the rest.

    >>> def stop(done, wanted, failed):
    ...     raise RunInterrupted(f"stopped after {done} of {wanted} cases")
    >>> try:
    ...     stop(512, 2000, 0)
    ... except RunInterrupted as error:
    ...     print(error)
    stopped after 512 of 2000 cases
    """


class WorkersLost(EngineError):
    """The workers of a run cannot be reached or kept alive; the run turns it into RunInterrupted."""
