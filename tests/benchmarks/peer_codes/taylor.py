"""heyoka's Taylor integrator in its best forms: a batch of as many cases as a register holds, and one at a time.

What makes it fast is on: unrolled code (no compact mode), fast mathematics, subnormal numbers flushed to zero, one
integrator for all flights; events in batches are followed by refilling the lane from within the event's callback, so
that no lane waits.
"""

from collections.abc import Callable

import heyoka as hy
import numpy as np

from mc_engine.flight.kernel import registers
from tests.benchmarks.peer_codes.entrant import TOLERANCES, Entrant, Flight, portions, shared
from tests.benchmarks.peer_codes.problems import Problem
from tests.benchmarks.peer_codes.subnormals import flushed

WIDTH = max(hy.recommended_simd_size(), registers().doubles)  # heyoka recommends half a register of Intel's AVX-512


def system(problem: Problem) -> tuple[list, object]:
    """(equations, event) as expressions; the event is that of `height`, or None."""
    assert problem.rate is not None  # the satellite is not flown here: a Taylor series does not cross its corners
    state = hy.make_vars("x", "y", "z", "vx", "vy", "vz")
    parameters = [hy.par[i] for i in range(problem.parameters.shape[0])]
    equations = list(zip(state, problem.rate(hy, state, parameters), strict=True))
    return equations, problem.height(hy, state) if problem.height else None


class Refill:
    """Callback of the batch's event: notes the case that has arrived and puts the next one in its lane.

    The problems do not depend on time, so a case may begin at any.  A lane without a case flies the last one again.
    """

    def __init__(self, problem: Problem):
        self.first, self.parameters = problem.first.T.copy(), problem.parameters.T.copy()
        self.end = np.empty_like(self.first)
        self.begin([])

    def begin(self, lanes) -> None:
        """Take the first cases, as many as there are lanes."""
        self.case, self.next, self.left = list(lanes), len(lanes), len(self.first)

    def __call__(self, ta, d_sgn, lane) -> bool:
        case = self.case[lane]
        if case >= 0:
            self.end[case] = ta.state[:, lane]
            self.left -= 1
            if not self.left:
                return False
        case = self.next if self.next < len(self.first) else -1
        self.next += case >= 0
        self.case[lane] = case
        ta.state[:, lane], ta.pars[:, lane] = self.first[case], self.parameters[case]
        return True

    def __deepcopy__(self, memo) -> "Refill":
        return self  # an integrator copies its callbacks; the results are wanted here


def _batch(problem: Problem, tolerance: float) -> Flight:
    """Flight in batches, in one thread."""
    equations, event = system(problem)
    n, width = problem.first.shape[1], min(WIDTH, problem.first.shape[1])
    first, parameters = problem.first, problem.parameters
    keys = {"tol": tolerance, "compact_mode": False, "fast_math": True, "pars": parameters[:, :width].copy()}
    if event is not None:
        refill = Refill(problem)
        falling = hy.event_direction.negative
        keys["t_events"] = [hy.t_event_batch(event, callback=refill, direction=falling, cooldown=0.0)]
    ta = hy.taylor_adaptive_batch(equations, first[:, :width].copy(), **keys)
    start, end = np.zeros(width), np.empty_like(first)

    def fly() -> np.ndarray:
        for i in range(0, n, width):
            ta.set_time(start)
            ta.state[:], ta.pars[:] = first[:, i : i + width], parameters[:, i : i + width]
            ta.propagate_until(problem.duration)
            end[:, i : i + width] = ta.state
        return end

    def fly_to_event() -> np.ndarray:
        refill.begin(range(width))
        ta.set_time(start)
        ta.reset_cooldowns()
        ta.state[:], ta.pars[:] = first[:, :width], parameters[:, :width]
        ta.propagate_until(1e9)
        return refill.end.T

    return fly if event is None else fly_to_event


def _single(problem: Problem, tolerance: float) -> Flight:
    """Flight of one case after the other, in one thread."""
    equations, event = system(problem)
    first, parameters, n = problem.first, problem.parameters, problem.first.shape[1]
    keys = {"tol": tolerance, "compact_mode": False, "fast_math": True, "pars": parameters[:, 0].copy()}
    if event is not None:
        keys["t_events"] = [hy.t_event(event, direction=hy.event_direction.negative)]
    ta = hy.taylor_adaptive(equations, first[:, 0].copy(), **keys)
    end = np.empty_like(first)

    def fly() -> np.ndarray:
        for i in range(n):
            ta.time = 0.0
            if event is not None:
                ta.reset_cooldowns()
            ta.state[:], ta.pars[:] = first[:, i], parameters[:, i]
            ta.propagate_until(problem.duration)
            end[:, i] = ta.state
        return end

    return fly


def _entrant(problem: Problem, form: str, one_thread: Callable[[Problem, float], Flight]) -> Entrant:
    def build(cases: Problem, value: float, threads: int) -> Flight:
        parts = [cases.part(where) for where in portions(cases.first.shape[1], threads, WIDTH)]
        return shared([flushed()(one_thread(part, value)) for part in parts])

    return Entrant("heyoka", form, problem, "tolerance", TOLERANCES, build)


def entrants(problem: Problem) -> list[Entrant]:
    """Both forms."""
    return [_entrant(problem, f"batch of {WIDTH}", _batch), _entrant(problem, "one case at a time", _single)]
