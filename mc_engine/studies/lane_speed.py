"""Speed of a model on one thread, one case at a time and in SIMD batches: the time of the kernel calls alone.

Compiling, or loading the compiled kernel, is timed separately.  The builds take turns at short flights and the shortest
time of each counts, so that other work on the machine has little influence.
"""

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mc_engine.campaign.cases import case_table, full_inputs
from mc_engine.campaign.loading import Campaign
from mc_engine.flight import flight
from mc_engine.flight.kernel import usual_width
from mc_engine.model.fields import AdaptiveStep
from mc_engine.model.record import Model, compiled_model

_MOST_CASES = 256
_SHORT = 0.15  # s, about, of a flight one case at a time; a longer one is only disturbed more often
_TRIAL = 16  # cases
_SLOWEST = 12  # times that a case takes longer alone, at most: to guess from a flight in lanes


@dataclass(frozen=True)
class Flight:
    """Cases of one model that all fly with the same settings."""

    title: str
    model: Model
    folder: Path | None
    inputs: flight.Inputs
    n_cases: int
    seed: int = 1


@dataclass
class Timing:
    """By the width of the build, shortest times: of a case [s], of a case-step [ns]; and time [s] until it can fly.

    Models that choose their steps have no time of a step: `ns` is empty.
    """

    case_s: dict[int, float] = field(default_factory=dict)
    ns: dict[int, float] = field(default_factory=dict)
    ready_s: dict[int, float] = field(default_factory=dict)

    def ratio(self, width: int = 8) -> float:
        """How many times longer a case takes one at a time."""
        return self.case_s[1] / self.case_s[width]


def campaign_flight(campaign: Campaign, n_cases: int | None = None) -> Flight:
    """The first cases of a campaign, by default as many as fly in a short time; its nominal, `n_cases` times,
    where the inputs come from another run.
    """
    model = compiled_model(campaign.model)

    def of(n: int) -> Flight:
        table = {} if campaign.first is not None else case_table(campaign, np.arange(min(n, campaign.cases)))
        n = n if campaign.first is not None else min(n, campaign.cases)
        inputs = full_inputs(campaign, table)
        return Flight(campaign.name, model, campaign.directory, inputs, n, campaign.seed)

    if n_cases is not None:
        return of(n_cases)
    trial = of(_TRIAL)
    alone = _SLOWEST * measure(trial, [usual_width(model)], repeats=2).case_s[usual_width(model)]
    return of(int(np.clip(_SHORT / alone // _TRIAL * _TRIAL, _TRIAL, _MOST_CASES)))


def caller(cases: Flight, width: int) -> Callable[[], tuple[float, float]]:
    """Function that flies all cases once, by the kernel alone; it returns the times of a case [s] and case-step [ns].

    The time of a case-step is not a number where each case chooses its steps.
    """
    fly, ends, codes = flight.bound_flight(
        cases.model, cases.inputs, np.arange(cases.n_cases), cases.seed, folder=cases.folder, width=width
    )
    clock = cases.model.clock
    step = np.nan
    if not isinstance(clock, AdaptiveStep):
        step = flight.grid_of(clock, flight.settings_of(cases.model, codes))[1]

    def timed() -> tuple[float, float]:
        start = time.perf_counter()
        fly()
        elapsed = time.perf_counter() - start
        return elapsed / ends.size, elapsed / np.ceil(ends / step).sum() * 1e9

    return timed


def measure(cases: Flight, widths: Iterable[int], repeats: int = 60) -> Timing:
    """Timing of the kernels of several widths on the same cases."""
    timing = Timing()
    flights = {}
    for width in widths:
        start = time.perf_counter()
        flights[width] = caller(cases, width)
        flights[width]()
        timing.ready_s[width] = time.perf_counter() - start
    for _ in range(repeats):
        for width, fly in flights.items():
            case_s, ns = fly()
            timing.case_s[width] = min(timing.case_s.get(width, np.inf), case_s)
            if np.isfinite(ns):
                timing.ns[width] = min(timing.ns.get(width, np.inf), ns)
    return timing
