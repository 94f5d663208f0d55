"""What takes part in a benchmark: a code in one of its forms, with a knob that trades time for error."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from tests.benchmarks.peer_codes.problems import Problem

Flight = Callable[[], np.ndarray]  # flies all cases once: end states [n_states, n]

# quarter decades: nobody gains much by where the rungs happen to lie
TOLERANCES = tuple(10.0 ** (-k / 4) for k in range(16, 65))


@dataclass
class Entrant:
    """One code in one form on one problem.

    build(problem, value, threads) -> Flight of all cases of that (shortened) problem.  What is compiled or copied once
        for all flights belongs into `build`, which is not timed.
    ladder : values of the knob, from rough to fine.  cases : at most in one turn.  checked : for the error
    parallel : whether threads help.  once : a flight is good for one turn only
    """

    peer: str
    form: str
    problem: Problem
    knob: str
    ladder: tuple[float, ...]
    build: Callable[[Problem, float, int], Flight]
    cases: int = 1024
    checked: int = 16
    parallel: bool = True
    once: bool = False
    errors: dict[float, float] = field(default_factory=dict)

    def error(self, value: float) -> float:
        """Error against the reference at one value of the knob."""
        if value not in self.errors:
            end = self.build(self.problem.shortened(self.checked), value, 1)()
            self.errors[value] = self.problem.error(end)
        return self.errors[value]

    def value_for(self, target: float) -> float | None:
        """A value whose error is at most the target while the next rougher one's is more; None if there is none."""
        failing, good = -1, len(self.ladder) - 1
        if self.error(self.ladder[good]) > target and self.error(self.ladder[good := good * 4 // 5]) > target:
            return None  # asked twice, because rounding may spoil the very finest
        while good - failing > 1:
            middle = (failing + good) // 2
            if self.error(self.ladder[middle]) <= target:
                good = middle
            else:
                failing = middle
        return self.ladder[good]


@cache
def thread_pool(threads: int) -> ThreadPoolExecutor:
    """Threads that stay, so that no flight pays for starting them."""
    return ThreadPoolExecutor(threads)


def shared(flights: list[Flight]) -> Flight:
    """One flight that flies several at the same time, a thread each."""
    if len(flights) == 1:
        return flights[0]
    pool = thread_pool(len(flights))
    return lambda: np.concatenate(list(pool.map(lambda fly: fly(), flights)), axis=1)


def portions(n: int, threads: int, multiple: int = 8) -> list[slice]:
    """Slices that part n cases among threads, each a multiple of the vector's width where possible."""
    share = -(-n // (threads * multiple)) * multiple
    return [slice(begin, min(begin + share, n)) for begin in range(0, n, share)]
