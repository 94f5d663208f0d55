"""The engine itself: its compiled kernels, called as a run calls them, many cases at a time or one."""

from dataclasses import replace

import numpy as np

from mc_engine.flight import flight
from mc_engine.flight.kernel import build_kernel, usual_width
from mc_engine.flight.kernel_parts import blocks_of, settings_class
from mc_engine.lanes.kernel_data import gathered
from mc_engine.model import AdaptiveStep, Model, load_model
from tests.benchmarks.peer_codes.entrant import TOLERANCES, Entrant, Flight, portions, shared
from tests.benchmarks.peer_codes.problems import Problem

FOLDER = "tests.benchmarks.models."
# of RK4 [s]: parts of the day; entries end where they like
ORBIT_STEPS = (60.0, 40.0, 30.0, 20.0, 15.0, 10.0, 7.5, 5.0, 4.0, 3.0, 2.0, 1.5, 1.0, 0.75, 0.5, 0.4, 0.3)
# of the multistep methods [s]: parts of the day, dense because the error falls with the tenth power and more
ARC_STEPS = (90.0, 80.0, 75.0, 72.0, 67.5, 64.0, 60.0, 57.6, 54.0, 50.0, 48.0, 45.0, 43.2, 40.0, 37.5, 36.0, 32.0, 30.0,
             27.0, 25.0, 24.0, 22.5, 20.0, 18.0, 16.0, 15.0, 13.5, 12.0, 10.0, 8.0, 6.0, 5.0)  # fmt: skip
ENTRY_STEPS = (
    16.0,
    12.0,
    8.0,
    6.0,
    4.0,
    3.0,
    2.0,
    1.5,
    1.0,
    0.75,
    0.5,
    0.4,
    0.3,
    0.2,
    0.15,
    0.1,
    0.075,
    0.05,
    0.03,
    0.02,
    0.015,
    0.01,
)


def load(problem: Problem, method: str) -> Model:
    """The model of a problem with one of its methods."""
    model = load_model(FOLDER + problem.models[method])
    return replace(model, clock=replace(model.clock, method=method.lower()))


def kernel_flight(problem: Problem, method: str, value: float | None, width: int) -> Flight:
    """Flight of all cases of a problem in one thread.

    value : step [s] or tolerance.  Only the kernel call is inside the flight: units and design come before.
    """
    model, n = load(problem, method), problem.first.shape[1]
    inputs = {item.name: item.default for item in (*model.parameters, *model.settings)} | problem.inputs
    adaptive = isinstance(model.clock, AdaptiveStep)
    if value is not None:
        inputs["tolerance" if adaptive else "step_s"] = value
    if value is not None and adaptive and problem.sizes is not None:
        model = replace(model, clock=replace(model.clock, atol=tuple(value * size for size in problem.sizes)))
    ready = flight.prepare(model, inputs, n)
    settings = np.ascontiguousarray(ready.settings[0])
    chosen = settings_class(model)(*settings)
    clock = (
        flight.adaptive_arguments(model, model.clock, chosen)
        if adaptive
        else flight.fixed_arguments(model.clock, chosen)
    )
    time, status, states = np.empty(n), np.empty(n), np.empty((len(model.states), n))
    out = (time, status, states, np.empty((len(model.metrics), n)))
    kernel, key, cases = build_kernel(model, None, width), np.uint64(1), np.arange(float(n))
    no_history = np.empty((0, 0)), np.empty(0, dtype=np.int64), np.ones(n) if adaptive else 1
    data = gathered(blocks_of(model))

    def fly() -> np.ndarray:
        kernel(ready.parameters, settings, data, key, cases, *clock, *out, *no_history)
        return states

    return fly


def entrant(problem: Problem, method: str, width: int = 0, ladder: tuple[float, ...] = ()) -> Entrant:
    """The engine with one method and width; the width that it takes by itself unless said."""
    width = width or usual_width(load(problem, method))

    def build(cases: Problem, value: float, threads: int) -> Flight:
        parts = [cases.part(where) for where in portions(cases.first.shape[1], threads)]
        return shared([kernel_flight(part, method, value, width) for part in parts])

    form = f"{method}, {f'{width} cases at a time' if width > 1 else 'one case at a time'}"
    if method in ("DOP853", "TP86", "DP54"):
        return Entrant("engine", form, problem, "tolerance", ladder or TOLERANCES, build)
    steps = ENTRY_STEPS if problem.height else ORBIT_STEPS if method == "RK4" else ARC_STEPS
    return Entrant("engine", form, problem, "step", ladder or steps, build)
