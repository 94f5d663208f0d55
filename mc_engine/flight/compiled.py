"""The `Flyer` of compiled models."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from mc_engine.campaign.loading import Campaign
from mc_engine.flight import flight
from mc_engine.flight.contract import breaches, flight_faults, refuse_breaches
from mc_engine.flight.flyer import Columns, Copies, Flyer, Inputs, Process, never, refused_among_first
from mc_engine.flight.kernel import FINER_STEPS, finer, make_kernel_folder, source_digest, usual_width
from mc_engine.flight.lost_numbers import first_lost, may_be_lost
from mc_engine.model.fields import AdaptiveStep, FixedStep
from mc_engine.model.preparation import prepare
from mc_engine.model.record import compiled_model
from mc_engine.store.case_rows import RowLog


class CompiledFlyer(Flyer):
    """A compiled model: four, eight or sixteen cases at a time, each independent of the others.

    It needs neither `log` nor `keep`: a chunk takes seconds at most, and leaves no files.
    """

    _width: int | None = None  # what is fastest for the model
    _build: flight.Builder | None = None  # the processor's kernel

    def __init__(self, campaign: Campaign):
        self._campaign = campaign
        self._model, self._folder, self._seed = compiled_model(campaign.model), campaign.directory, campaign.seed
        self.batch = self.histories_together = usual_width(self._model)

    def fly(
        self,
        inputs: Inputs,
        noise: np.ndarray,
        log: RowLog | None = None,
        keep: Path | None = None,
        stopped: Callable[[], bool] = never,
    ) -> Columns:
        return self._fly(inputs, noise)

    def histories(
        self, inputs: Inputs, noise: np.ndarray, rows: int, stopped: Callable[[], bool] = never
    ) -> Iterator[tuple[Columns, Columns]]:
        return flight.fly_histories(self._model, inputs, noise, self._seed, folder=self._folder, rows=rows)

    def digest(self) -> str:
        return source_digest(self._model, self._folder)

    def make_ready(self) -> None:
        """Fly one step of the nominal case, however long that is."""
        clock, nominal = self._model.clock, self._campaign.nominal
        one_step = replace(clock, attempts=1) if isinstance(clock, AdaptiveStep) else replace(clock, until=clock.step)
        self._fly(nominal, np.zeros(1, dtype=np.int64), one_step)

    def _fly(self, inputs: Inputs, noise: np.ndarray, clock: FixedStep | AdaptiveStep | None = None) -> Columns:
        model, folder, width, build = self._model, self._folder, self._width, self._build
        return flight.fly(model, inputs, noise, self._seed, folder=folder, width=width, clock=clock, build=build)

    def faults(self) -> list[str]:
        return breaches(self._campaign)

    def faults_in_flight(self, process: Process) -> list[str]:
        make_kernel_folder()  # or what is wrong with the folder would be told as a fault of the model
        import scipy.special  # noqa: F401  # `second_look` draws cases with it: loaded while the process starts

        return flight_faults(self._campaign, process)

    def second_look(self, copies_of: Copies) -> tuple[list[str], list[str]]:
        """No error; how many cases are refused, or that none was flown, as another campaign gives their inputs."""
        if (first := self._campaign.first) is None:
            return [], refused_among_first(self._campaign, self._refusals)
        return [], [
            f'no case was flown to check the model, as its inputs come from "{first.name}", which has yet to be flown; '
            "to check the model, fly that campaign and give the directory of its run as `from` in [inputs]"
        ]

    def _refusals(self, inputs: Inputs, n: int) -> np.ndarray:
        return prepare(self._model, inputs, n).refusals.reason

    def refuse_faults(self) -> None:
        refuse_breaches(self._campaign)
        make_kernel_folder()

    def fly_finer(self, inputs: Inputs, noise: np.ndarray, flight_s: float) -> tuple[str, Columns]:
        """(what is finer, results of the cases), see `finer`.  flight_s : length of their flights [s]."""
        clock, by = finer(self._model.clock, flight_s), "half of the step"
        if isinstance(clock, AdaptiveStep):
            by = f"a tenth of the tolerances and at least {FINER_STEPS:,} steps"
        return by, flight.fly(self._model, inputs, noise, self._seed, folder=self._folder, clock=clock)

    def lost_number(self, inputs: Inputs, noise: int, results: Columns, who: str) -> str:
        if not may_be_lost(self._model, results):
            return ""
        return first_lost(self._model, inputs, noise, self._seed, who)
