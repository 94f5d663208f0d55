"""The only interface between the runner and what flies cases: a compiled model or a simulator.

It takes the inputs of a chunk of cases, as columns in declared units, and returns columns of results, statuses and
reasons, and time histories of some cases.  The runner, the store and all studies use only this interface.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from subprocess import Popen
from typing import Any

import numpy as np

from mc_engine.campaign.cases import case_table, full_inputs
from mc_engine.campaign.loading import Campaign
from mc_engine.errors import EngineError
from mc_engine.model.record import Model
from mc_engine.numbers_in_text import counted
from mc_engine.status import STATUS_NAME
from mc_engine.store.case_rows import RowLog

NOMINAL_NOISE = 2**52  # the nominal draws its noise where no case does
Columns = dict[str, np.ndarray]
Inputs = Mapping[str, Any]
Process = Popen[str]
# a folder of the copies that a run keeps of the model's files, for a block; None if the model is no file
Copies = Callable[[Any], AbstractContextManager[Path | None]]  # of a Campaign
_FIRST = 1000  # cases whose inputs `check` looks at
_STATUS_WORDS = np.array([STATUS_NAME[code] for code in range(len(STATUS_NAME))], dtype=object)


class RunStopped(EngineError):
    """The run was stopped while cases were in flight; those that were complete are recorded."""


def never() -> bool:
    return False


class Flyer(ABC):
    """Flies the cases of one campaign.  Used by several threads at once.

    batch : cases that fly together, so that one of them may end the worker of all.
    histories_together : cases whose histories are flown together.
    chunks_per_worker : least number in a run: enough that workers finish together, and few enough for large parts.
    smallest_chunk : least number of cases that a worker flies at a time.
    largest_chunk : largest number of them, since all their numbers are in memory.
    keeps_rows : a case may take long, so the row of each is recorded when it is complete, and a run that is stopped
        does not wait for the cases in flight.
    most_workers : most workers that may fly cases of this campaign at a time, such as licences; None for no limit.
    tolerance : fraction by which the numbers of a replayed case may differ from those stored; None: bits are compared.
    """

    batch: int
    histories_together: int = 1
    chunks_per_worker: int = 8
    smallest_chunk: int = 64
    largest_chunk: int = 32_768
    keeps_rows: bool = False
    most_workers: int | None = None
    tolerance: float | None = None

    @abstractmethod
    def fly(
        self,
        inputs: Inputs,
        noise: np.ndarray,
        log: RowLog | None = None,
        keep: Path | None = None,
        stopped: Callable[[], bool] = never,
    ) -> Columns:
        """Status, reason and every result of each case.

        inputs : every parameter and setting by column name, in declared units; one value, or an array [n] of cases.
        noise : int64[n], what addresses the random draws in the flight of each case.
        log : of these cases; the row of each that is complete is added, where `keeps_rows`.
        keep : run directory, for what cases leave behind; None keeps nothing.
        Raises RunStopped once `stopped()` is true, where `keeps_rows`.
        """

    @abstractmethod
    def histories(
        self, inputs: Inputs, noise: np.ndarray, rows: int, stopped: Callable[[], bool] = never
    ) -> Iterator[tuple[Columns, Columns]]:
        """(results, history) of each case, flown when it is asked for, perhaps together with those that follow it.

        history : t_s and the outputs, about `rows` rows, none of a refused case.
        Raises RunStopped once `stopped()` is true, where a case may take long.
        """

    @abstractmethod
    def digest(self) -> str:
        """SHA-256 of the sources that decide the results."""

    @abstractmethod
    def make_ready(self) -> None:
        """Compile or load what flies, before several workers ask for it."""

    def start(self) -> None:
        """Start the process that will fly the next cases, if they need one; no limit on their time counts its start."""
        return

    @abstractmethod
    def faults(self) -> list[str]:
        """One sentence for each error that is found without a flight; empty if there is none."""

    @abstractmethod
    def faults_in_flight(self, process: Process) -> list[str]:
        """One sentence for each error that flights of a few cases show.

        process : one of `mc_engine.flight.contract_flight`, which has loaded the campaign and waits to fly.
        """

    def second_look(self, copies_of: Copies) -> tuple[list[str], list[str]]:
        """Errors that only repeated flights show, and lines for `check`: what it left out, how long a case takes.

        To be called where the other checks found nothing.
        """
        return [], []

    @abstractmethod
    def refuse_faults(self) -> None:
        """ModelError with the first fault, before anything is flown or written."""

    def differs(self, stored: Any, value: Any) -> bool:
        """Whether a number of a replayed case differs from the stored one: in any bit, or by more than `tolerance`."""
        if not isinstance(value, float | np.floating):
            return bool(stored != value)
        if self.tolerance is None:
            return other_bits(stored, value)
        if not (np.isfinite(stored) and np.isfinite(value)):
            return not np.array_equal(stored, value, equal_nan=True)
        return bool(abs(stored - value) > self.tolerance * max(abs(stored), abs(value)))

    def lost_number(self, inputs: Inputs, noise: int, results: Columns, who: str) -> str:
        """Where a number of a failed flight became infinite or NaN, as a sentence; empty where that is not known."""
        return ""


def refused_among_first(campaign: Campaign, refusals: Callable[[Inputs, int], Iterable[str]]) -> list[str]:
    """A line if some of the first cases are refused.  refusals : the reason for each of n cases with these inputs."""
    n = min(_FIRST, campaign.cases)
    table = {} if campaign.first is not None else case_table(campaign, np.arange(n))
    reasons = [reason for reason in refusals(full_inputs(campaign, table), n) if reason]
    if not reasons:
        return []
    return [f"{len(reasons)} of the first {counted(n, 'case')} are refused; the first of them: {reasons[0]}"]


def other_bits(a: Any, b: Any) -> bool:
    """Whether two numbers differ in any bit."""
    return np.float64(a).tobytes() != np.float64(b).tobytes()


def status_words(status: np.ndarray) -> np.ndarray:
    """object[n] of str, not to be written to: of cases that all ended alike it is one word seen n times."""
    if status.size and (status == status[0]).all():
        return np.broadcast_to(_STATUS_WORDS[[int(status[0])]], status.shape)
    return _STATUS_WORDS[status.astype(int)]


def phase_words(model: Model, numbers: np.ndarray) -> np.ndarray:
    """object[n] of str, the names of the phases with these numbers; empty for NaN and in a model without phases."""
    words = np.array([*model.phases, ""], dtype=object)
    known = np.isfinite(numbers) & bool(model.phases)
    return words[np.where(known, np.nan_to_num(numbers), -1).astype(int)]
