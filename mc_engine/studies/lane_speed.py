"""Speed of a model on one thread, one case at a time and in SIMD batches: the time of the kernel calls alone.

Compiling, or loading the compiled kernel, is timed separately.  The builds fly short flights in turn, and the shortest
time of each counts, so that other work on the machine has little influence.

`compare_methods` finds the fastest integration method, with its step or tolerances, that has at most the error of the
model's own method.  Every other method that can fly the model is tried, from long steps to short ones, or from loose
tolerances to tight ones, until its error is no larger than the model's own.  The error is the largest difference of a
metric from a reference flight, in any case, as a fraction of that metric's largest magnitude; this metric is named.
Metrics that are only rounding errors of larger numbers, such as the altitude at the ground, are left out.  The
reference is flown by DOP853 to a tolerance of 1e-13.  Errors that may be those of the reference count as zero: up to a
few times the difference that a tolerance of 2e-13 makes, such as in the time of a flat maximum.  Metrics that the
model's own method does not determine, while it determines others, are left out and named, such as the time of the
largest of several similar maxima.  The times of control samples stay the same: a model with `control` is tried with
whole numbers of steps between them.
"""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from mc_engine.campaign.cases import case_table, full_inputs, is_endless
from mc_engine.campaign.columns import END_TIME
from mc_engine.campaign.loading import Campaign
from mc_engine.errors import ModelError
from mc_engine.flight import flight
from mc_engine.flight.kernel import FINER_STEPS, clock_number, usual_width
from mc_engine.model.fields import AdaptiveStep, FixedStep, uses_rates
from mc_engine.model.record import Model, compiled_model
from mc_engine.model.rules import METHODS
from mc_engine.units import UNITS

_MOST_CASES = 256
_SHORT = 0.15  # s, about, of a flight one case at a time; a longer one is only disturbed more often
_TRIAL = 16  # cases
_SLOWEST = 12  # times that a case takes longer alone, at most: to guess from a flight in lanes

_TIGHT, _NEARLY_AS_TIGHT, _DOUBT = 1e-13, 2e-13, 4.0
# of the flight that tells the reference's error: where tolerances do not limit the steps, its own would be the same
_OTHER_STEPS = FINER_STEPS * 5 // 4
_UNDETERMINED = 0.1  # of a metric's size
_TOLERANCES = tuple(10.0 ** (-k / 4) for k in range(16, 53))
# steps are tried so many quarters of an octave longer than the model's own, and so many shorter
_LONGER, _SHORTER = 28, 8
# of a model that chooses its steps: so many quarters around this part of its longest flight; a time limit beyond so
# many of these flights counts as none
_PART, _AROUND, _NO_LIMIT = 1 / 512, 24, 1e4
_ROUNDING = 1e-14  # no error of a metric is told apart from zero below
_ROUNDED = 1e-12  # of the largest number of the same quantity: a metric below is but its rounding

Clock = FixedStep | AdaptiveStep


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
    """Shortest times by width of the build: of a case [s], of a case-step [ns]; and the time [s] until it can fly.

    With adaptive steps there is no time of a step: `ns` is empty.
    """

    case_s: dict[int, float] = field(default_factory=dict)
    ns: dict[int, float] = field(default_factory=dict)
    ready_s: dict[int, float] = field(default_factory=dict)

    def ratio(self, width: int) -> float:
        """Ratio of the times of a case: flown one at a time, and with this width."""
        return self.case_s[1] / self.case_s[width]


def campaign_flight(campaign: Campaign, n_cases: int | None = None) -> Flight:
    """The first cases of a campaign, by default as many as fly in a short time; its nominal, `n_cases` times,
    where the inputs come from a run that has yet to be flown.

    More cases than the campaign's own number are those of a longer campaign, or all where its design cannot be longer.
    """
    model = compiled_model(campaign.model)

    def of(n: int) -> Flight:
        n = n if campaign.first is not None or is_endless(campaign) else min(n, campaign.cases)
        table = {} if campaign.first is not None else case_table(campaign, np.arange(n))
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
    for width, (case_s, ns) in zip(flights, _shortest([*flights.values()], repeats), strict=True):
        timing.case_s[width] = case_s
        if np.isfinite(ns):
            timing.ns[width] = ns
    return timing


def _shortest(callers: list[Callable[[], tuple[float, float]]], repeats: int) -> list[tuple[float, float]]:
    """The shortest times of each of several flights, which take turns."""
    times = np.array([[call() for call in callers] for _ in range(repeats)])
    return [(float(case_s), float(ns)) for case_s, ns in times.min(axis=0)]


@dataclass(frozen=True)
class MethodTiming:
    """A method at the error of the model's own.

    case_s : shortest time of a case [s];  of the model's own: metric : that has this error;  left_out : metrics
    """

    clock: Clock
    error: float
    case_s: float
    metric: str = ""
    left_out: tuple[str, ...] = ()

    @property
    def setting(self) -> str:
        """Its step or tolerance."""
        if isinstance(self.clock, FixedStep):
            return f"steps of {self.clock.step:.4g} s"
        return f"tolerance {self.clock.rtol:.1e}"

    @property
    def declaration(self) -> str:
        """Its clock as a model declares it."""
        given = {item.name: (getattr(self.clock, item.name), item.default) for item in fields(self.clock)}
        values = ", ".join(f"{name}={value!r}" for name, (value, default) in given.items() if value != default)
        return f"{type(self.clock).__name__}({values})"


def compare_methods(campaign: Campaign, n_cases: int | None, repeats: int) -> list[MethodTiming]:
    """The methods that reach the error of the model's own, which is the first; the others from fast to slow.

    n_cases, repeats : of the flights that are timed, see `campaign_flight` and `measure`.
    """
    trials = _Trials(campaign_flight(campaign, _TRIAL))
    error, metric = trials.largest_error(trials.own)
    known: list[tuple[Clock, float]] = [(trials.own, error)]
    if not np.isfinite(error):
        raise ModelError("methods are not compared: by the model's own, cases end otherwise than by the finest steps")
    for clocks in trials.ladders():
        found = _first_within(trials, clocks, max(error, _ROUNDING))
        known += [found] if found else []
    timed = campaign_flight(campaign, n_cases)
    models = [replace(timed, model=replace(timed.model, clock=clock)) for clock, _ in known]
    times = _shortest([caller(cases, usual_width(timed.model)) for cases in models], repeats + 1)
    own, *others = [MethodTiming(*method, case_s) for method, (case_s, _) in zip(known, times, strict=True)]
    return [replace(own, metric=metric, left_out=trials.left_out), *sorted(others, key=lambda timing: timing.case_s)]


def _first_within(trials: "_Trials", clocks: Iterator[Clock], most: float) -> tuple[Clock, float] | None:
    """The roughest clock whose error is within `most`, and so is that of the next finer one: not by chance."""
    before = None
    for clock in clocks:
        error = trials.error(clock)
        if error > most:
            before = None
        elif before is not None:
            return before
        else:
            before = clock, error
    return before


def _in_numbers(clock: Clock, settings: Any) -> Clock:
    """The clock with numbers in place of names of settings, and functions of them."""
    if isinstance(clock, FixedStep):
        n_steps, step, every = flight.grid_of(clock, settings)
        return replace(clock, step=step, until=n_steps * step, control_every=every)
    given = clock.until, clock.rtol, clock.control_period, clock.longest_step
    until, rtol, period, longest = (clock_number(item, settings) for item in given)
    if period == np.inf != clock.control_period:  # what the settings give; no model with control is declared with it
        period = 2.0 * until  # nor is there a second sample with this
    return replace(clock, until=until, rtol=rtol, control_period=period, longest_step=longest)


def _kind(clock: Clock) -> str:
    """Clocks of a kind have the same kernel."""
    return clock.method if isinstance(clock, FixedStep) else "adaptive"


class _Trials:
    """Flights of a few cases by other clocks, and their errors."""

    def __init__(self, cases: Flight):
        self.cases, model = cases, cases.model
        self._ids = np.arange(cases.n_cases)
        flown = model, cases.inputs, self._ids, cases.seed
        codes = flight.bound_flight(*flown, folder=cases.folder, width=usual_width(model))[2]
        self.own = _in_numbers(model.clock, flight.settings_of(model, codes))
        self._models = {_kind(self.own): model}
        own = self._flown(self.own)
        if isinstance(self.own, FixedStep):
            self.flight_s, period = float(self.own.until), float(self.own.step) * float(self.own.control_every)
        else:
            self.flight_s, period = float(np.nanmax(own[END_TIME])), clock_number(self.own.control_period, None)
        self.period = period if model.control is not None else np.inf
        sizes = [np.nanmax(abs(own[f"end_{state.name}"] * state.si_factor)) for state in model.states]
        self._scales = np.array([size if np.isfinite(size) and size > 0.0 else 1.0 for size in sizes])
        self._true = self._flown(self._reference(_TIGHT, FINER_STEPS))
        self._least = self._sizes_of_rounding()
        nearly = self._errors(self._flown(self._reference(_NEARLY_AS_TIGHT, _OTHER_STEPS)))
        self._doubt = {name: _DOUBT * error for name, error in nearly.items()}
        self.left_out = self._leave_out(self._errors(own))

    def _leave_out(self, errors: dict[str, float]) -> tuple[str, ...]:
        """Names of the metrics that are undetermined beside others; their errors count no more.

        errors : of the model's own.
        """
        undetermined = {name: max(error, self._doubt.get(name, 0.0)) >= _UNDETERMINED for name, error in errors.items()}
        if all(undetermined.values()):
            return ()
        names = tuple(name for name, is_so in undetermined.items() if is_so)
        self._doubt |= dict.fromkeys(names, np.inf)
        return names

    def ladders(self) -> Iterator[Iterator[Clock]]:
        """Of every other method its clocks, from rough to fine."""
        # far beyond the longest flight a limit is none, and short steps may be too many until then
        until = min(float(self.own.until), _NO_LIMIT * self.flight_s)
        grid = self.own if isinstance(self.own, FixedStep) else FixedStep(self.flight_s, until)
        for method in METHODS["FixedStep"] if isinstance(self.own, FixedStep) or not self.cases.model.phases else ():
            fixed = replace(grid, method=method)
            if method != self.own.method and (fixed.rates or not uses_rates(fixed)):
                yield (replace(fixed, step=step, control_every=every) for step, every in self._grids())
        for method in METHODS["AdaptiveStep"]:
            if method != self.own.method:
                yield (self._adaptive(method, tolerance) for tolerance in _TOLERANCES)

    def _grids(self) -> Iterator[tuple[float, int]]:
        """(step [s], steps from sample to sample) from long steps to short ones, which divide the flight or period."""
        whole, near, quarters = min(self.period, self.flight_s), _PART * self.flight_s, range(-_AROUND, _AROUND + 1)
        if isinstance(self.own, FixedStep):
            near, quarters = float(self.own.step), range(-_LONGER, _SHORTER + 1)
        for n in sorted({max(1, round(whole / near * 2.0 ** (quarter / 4))) for quarter in quarters}):
            yield whole / n, n if self.period < np.inf else 1

    def _adaptive(self, method: str, tolerance: float) -> AdaptiveStep:
        """A clock that samples where the model's own does; absolute tolerances by the size of the states in the end,
        or by the model's own."""
        if isinstance(self.own, AdaptiveStep):
            own = np.broadcast_to(self.own.atol, len(self._scales)) / float(self.own.rtol)
            rtol, *atol = (float(f"{tolerance * scale:.1e}") for scale in (1.0, *own))
            return replace(self.own, rtol=rtol, atol=tuple(atol), method=method)
        rtol, *atol = (float(f"{tolerance * scale:.1e}") for scale in (1.0, *self._scales))
        return AdaptiveStep(self.own.until, rtol, tuple(atol), self.period, method)

    def _reference(self, tolerance: float, n_steps: int) -> AdaptiveStep:
        """A clock whose steps, so many at least, are also short enough for what longer ones pass over."""
        clock = self._adaptive("dop853", tolerance)
        longest = FINER_STEPS / n_steps * min(self.flight_s / FINER_STEPS, float(clock.longest_step))
        return replace(clock, longest_step=longest, attempts=clock.attempts + 10 * n_steps)

    def _sizes_of_rounding(self) -> dict[str, float]:
        """By quantity, such as length, how small a metric is in SI that is but the rounding of larger numbers."""
        largest: dict[str, float] = {}
        model = self.cases.model
        sizes = [(metric, np.nanmax(abs(self._true[metric.name]), initial=0.0)) for metric in model.metrics]
        states = [(state, size / state.si_factor) for state, size in zip(model.states, self._scales, strict=True)]
        for item, size in (*sizes, *states):
            quantity = UNITS[item.unit].quantity
            largest[quantity] = max(largest.get(quantity, 0.0), _ROUNDED * size * item.si_factor)
        return largest

    def _flown(self, clock: Clock) -> dict[str, np.ndarray]:
        model = self._models.setdefault(_kind(clock), replace(self.cases.model, clock=clock))
        cases = self.cases
        return flight.fly(model, cases.inputs, self._ids, cases.seed, folder=cases.folder, clock=clock)

    def error(self, clock: Clock) -> float:
        """Largest relative difference of a metric from the reference; infinite where another case fails."""
        return self.largest_error(clock)[0]

    def largest_error(self, clock: Clock) -> tuple[float, str]:
        """The error, and the metric that has it."""
        flown = self._flown(clock)
        if list(flown["status"]) != list(self._true["status"]):
            return np.inf, ""
        errors = self._errors(flown)
        counted = {name: error for name, error in errors.items() if error > self._doubt.get(name, 0.0)}
        worst = max(counted, key=lambda name: counted[name], default="")
        return counted.get(worst, 0.0), worst

    def _errors(self, flown: dict[str, np.ndarray]) -> dict[str, float]:
        """Relative difference from the reference by metric; infinite where one only is not a number."""
        errors = {}
        for metric in self.cases.model.metrics:
            value, true = flown[metric.name], self._true[metric.name]
            size = np.nanmax(abs(true), initial=0.0) or 1.0
            if (np.isnan(value) != np.isnan(true)).any():
                errors[metric.name] = np.inf
            elif size * metric.si_factor > self._least[UNITS[metric.unit].quantity]:
                errors[metric.name] = float(np.nanmax(abs(value - true), initial=0.0) / size)
        return errors
