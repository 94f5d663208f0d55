"""A contest: entrants on one problem, at equal error or at an equal step, flying in short turns one after the other.

The shortest turn of each counts, and in one thread its processor time, so that other work on the machine disturbs
little.
"""

import os
import time
from dataclasses import dataclass

from tests.benchmarks.peer_codes.entrant import Entrant, Flight

TURN = 0.01  # s, about the length of a turn: short, so that some turns have the core for themselves
LONG = 0.4  # s: an entrant whose turn is longer has few of them


@dataclass(frozen=True)
class Result:
    """One line of the table.

    time_us : of a case in one thread, processor time
    all_cores_us : of a case with a thread a core, wall time, None where threads do not help
    times_engine : time over that of the engine's fastest form in this contest;  note : why there is no time
    """

    problem: str
    at: str
    peer: str
    form: str
    setting: str = ""
    error: float | None = None
    unit: str = ""
    time_us: float | None = None
    all_cores_us: float | None = None
    times_engine: float | None = None
    note: str = ""


@dataclass(frozen=True)
class Contest:
    """Entrants at equal error: the target, in the problem's unit; without one, at the first value of each ladder."""

    title: str
    entrants: list[Entrant]
    target: float | None = None
    missing: tuple[str, ...] = ()

    @property
    def at(self) -> str:
        """What is equal: the error, or the step."""
        return "same step" if self.target is None else f"error {self.target:g} {self.entrants[0].problem.unit}"


@dataclass
class _Turns:
    """An entrant ready to fly, and its shortest turn per case [s]."""

    entrant: Entrant
    value: float
    threads: int
    n: int
    flight: Flight
    best: float
    last: float

    def fly(self) -> None:
        """One more turn."""
        if self.entrant.once:
            self.flight = _build(self.entrant, self.value, self.threads, self.n)
        clock = time.process_time if self.threads == 1 else time.perf_counter
        begin = clock()
        self.flight()
        self.last = clock() - begin
        self.best = min(self.best, self.last / self.n)


def _build(entrant: Entrant, value: float, threads: int, n: int) -> Flight:
    return entrant.build(entrant.problem.shortened(n), value, threads)


def _turns(entrant: Entrant, value: float, threads: int, turn: float) -> _Turns:
    """As many cases as fill a turn, found by a first flight of few, which also compiles."""
    few = min(64, entrant.cases)
    trial = _Turns(entrant, value, 1, few, _build(entrant, value, 1, few), 1e9, 0.0)
    for _ in range(1 if trial.last > LONG else 2):
        trial.fly()
    fitting = int(threads * turn / trial.best) // 64 * 64
    n = min(entrant.cases, max(few, fitting))
    return _Turns(entrant, value, threads, n, _build(entrant, value, threads, n), 1e9, 0.0)


def _interleave(entrants: list[_Turns], turns: int) -> None:
    for turn in range(turns):
        for one in entrants:
            if turn < 3 or one.last < LONG:
                one.fly()


def hold(contest: Contest, turns: int, turn: float = TURN, all_cores: bool = True) -> list[Result]:
    """The results of a contest, as a part of the table."""
    settings = [(one, one.value_for(contest.target) if contest.target else one.ladder[0]) for one in contest.entrants]
    flying = [(one, value) for one, value in settings if value is not None]
    alone = [_turns(one, value, 1, turn) for one, value in flying]
    _interleave(alone, turns)
    cores = os.cpu_count() or 1
    together = [_turns(one, value, cores, turn) for one, value in flying if one.parallel and all_cores and cores > 1]
    _interleave(together, turns)
    base = min(one.best for one in alone if one.entrant.peer == "engine")
    lines = [_result(contest, one, together, base) for one in alone]
    for one, value in settings:
        if value is None:
            lines.append(Result(contest.title, contest.at, one.peer, one.form, note="error not reached"))
    lines += [Result(contest.title, contest.at, peer, "", note="not installed") for peer in contest.missing]
    return lines


def _result(contest: Contest, one: _Turns, together: list[_Turns], base: float) -> Result:
    entrant, value = one.entrant, one.value
    joint = [other.best for other in together if other.entrant is entrant]
    return Result(
        contest.title,
        contest.at,
        entrant.peer,
        entrant.form,
        f"{entrant.knob} {value:.3g}{' s' if entrant.knob == 'step' else ''}",
        entrant.error(value),
        entrant.problem.unit,
        one.best * 1e6,
        joint[0] * 1e6 if joint else None,
        one.best / base,
    )
