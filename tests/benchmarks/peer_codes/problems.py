"""The problems that peers are measured on: dispersed cases, their physics, and their reference flights.

A problem holds its cases twice: as inputs of the engine's models, and as first states and parameters for everybody
else.  Positions in the end are what errors are taken of.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from tests.benchmarks import reference
from tests.benchmarks.models.drag_orbit import LOW_AIR, LOW_ORBIT, PERIGEE_AIR, TRANSFER_ORBIT
from tests.benchmarks.models.entry_physics import EAST, NORTH, RADIUS
from tests.benchmarks.peer_codes import flexible, rates

DAY = 86400.0  # s
CASES = 1024  # at most; a peer that is slow flies the first few of them
CHECKED = 16  # cases of the reference flight


@dataclass(frozen=True)
class Problem:
    """Cases of one kind.

    models : by method, the file in `models/` that the engine flies.  inputs : of these models, by column name
    first : float64[n_states, n];  parameters : float64[k, n];  rate(lib, s, p) -> derivative;  all SI
    derivative(case) -> function (t, s) -> list, of one case, on floats
    great_step : of the reference [s].  height(lib, s) : falls through zero where the flight ends, else None
    compared : first of the states that errors are taken of, and the one after the last;  unit : theirs
    sizes : of the states [SI], of which the engine's tolerance is a part too, where states pass through zero
    """

    key: str
    title: str
    models: dict[str, str]
    inputs: dict[str, Any]
    first: np.ndarray
    parameters: np.ndarray
    rate: Callable[..., list] | None
    duration: float
    great_step: float = 0.0
    height: Callable[..., Any] | None = None
    compared: tuple[int, int] = (0, 3)
    unit: str = "m"
    sizes: tuple[float, ...] | None = None

    def part(self, where: slice) -> "Problem":
        """Some of the cases."""
        inputs = {name: value[where] if np.ndim(value) else value for name, value in self.inputs.items()}
        return replace(self, inputs=inputs, first=self.first[:, where], parameters=self.parameters[:, where])

    def shortened(self, n: int) -> "Problem":
        """The first n cases alone."""
        return self.part(slice(n))

    def derivative(self, case: int) -> Callable[[float, Any], Any]:
        """Function (t, s) of the derivative of one case, on floats."""
        p = self.parameters[:, case].tolist()
        if self.rate is None:
            return flexible.derivative_of(np.array(p))
        rate = self.rate
        return lambda t, s: rate(math, s.tolist(), p)

    def error(self, end: np.ndarray) -> float:
        """Largest distance of end states from the reference, over as many cases as both have."""
        true = reference_of(self.key)
        n = min(end.shape[1], true.shape[1])
        rows = slice(*self.compared)
        apart = (end[rows, :n] - true[rows, :n]).astype(float)
        return float(np.sqrt((apart * apart).sum(axis=0)).max())


@cache
def reference_of(key: str, n: int = CHECKED) -> np.ndarray:
    """End states of the first n cases in 80-bit numbers; of the satellite one, by the same step, see `flexible`."""
    problem = BY_KEY[key]()
    if problem.rate is None:
        return flexible.flown(problem.first[:, 0], problem.parameters[:, 0], problem.duration, 0.01)[:, None]
    rate, p = problem.rate, problem.parameters[:, :n].astype(reference.Real)

    def derivative(t, s):
        return np.array(rate(np, s, p))

    first, height = problem.first[:, :n], problem.height
    if height is None:
        return reference.flown(derivative, first, problem.duration, math.ceil(problem.duration / problem.great_step))
    return reference.flown_to(derivative, first, lambda s: height(np, s), problem.great_step)[1]


def _orbits(key, title, models, nominal, sigma, air, seed, great_step):
    """Cases around a first state; sigma of each axis in m and m/s, of the ballistic coefficient 5 %."""
    rng = np.random.default_rng(seed)
    spread = np.repeat(sigma, 3)[:, None] * rng.normal(size=(6, CASES))
    first = np.array(nominal)[:, None] + spread
    coefficient = 100.0 * (1.0 + 0.05 * rng.normal(size=CASES))
    names = ("x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s")
    inputs: dict[str, Any] = dict(zip(names, first, strict=True)) | {"ballistic_coefficient_kg_m2": coefficient}
    parameters = (-0.5 / coefficient)[None] if air else np.empty((0, CASES))
    rate, inputs = rates.dragged(air) if air else rates.oblate, inputs | {"duration_s": DAY}
    sizes = (math.hypot(*nominal[:3]),) * 3 + (math.hypot(*nominal[3:]),) * 3
    return Problem(key, title, models, inputs, first, parameters, rate, DAY, great_step, sizes=sizes)


def _methods(name: str) -> dict[str, str]:
    return {"RK4": f"{name}_rk4", **dict.fromkeys(("DOP853", "TP86", "DP54"), f"{name}_adaptive")}


def _with_multistep(models: dict[str, str]) -> dict[str, str]:
    """Models by method, with those of smooth arcs, which differ from RK4 by their clock alone."""
    methods = [f"ABM{order}" for order in range(8, 13)] + [f"GJ{order}" for order in range(6, 11)]
    return models | dict.fromkeys(methods, models["RK4"])


@cache
def orbit() -> Problem:
    """A day in low orbit with J2 and drag."""
    return _orbits(
        "orbit",
        "low orbit, J2 + drag, one day",
        _with_multistep(_methods("orbit")),
        LOW_ORBIT,
        (100, 0.1),
        LOW_AIR,
        1,
        240.0,
    )


@cache
def transfer() -> Problem:
    """A day in a dispersed transfer orbit with J2 and drag."""
    title = "dispersed transfer orbit, J2 + drag, one day"
    return _orbits(
        "transfer", title, _with_multistep(_methods("transfer")), TRANSFER_ORBIT, (1000, 2.0), PERIGEE_AIR, 2, 60.0
    )


@cache
def oblate() -> Problem:
    """A day in low orbit with J2."""
    return _orbits("oblate", "low orbit, J2, one day", {"RK4": "oblate_rk4"}, LOW_ORBIT, (100, 0.1), None, 3, 240.0)


@cache
def two_body() -> Problem:
    """A day around a point mass."""
    models = _with_multistep(_methods("two_body"))
    problem = _orbits("two_body", "two-body orbit, one day", models, LOW_ORBIT, (100, 0.1), None, 4, 240.0)
    return replace(problem, rate=rates.two_body)


@cache
def entry(lift_to_drag: float) -> Problem:
    """Entry from 120 km to 10 km; with lift, banked by 60 degrees."""
    rng = np.random.default_rng(5)
    path, speed = -0.0349 + 0.0035 * rng.normal(size=CASES), 7800.0 + 10.0 * rng.normal(size=CASES)
    coefficient, factor = 364.02 * (1.0 + 0.03 * rng.normal(size=CASES)), 1.0 + 0.1 * rng.normal(size=CASES)
    bank, lifting = math.pi / 3, lift_to_drag != 0.0
    drag = 0.5 * factor / coefficient
    level, zero = speed * np.cos(path), np.zeros(CASES)
    first = np.array([zero + RADIUS + 120e3, zero, zero, speed * np.sin(path), EAST * level, NORTH * level])
    lift = lift_to_drag * drag
    parameters = np.array([drag, lift * np.cos(bank), lift * np.sin(bank)])
    inputs = {"altitude_m": 120e3, "speed_m_s": speed, "flight_path_rad": path, "lift_to_drag": lift_to_drag}
    inputs |= {"ballistic_coefficient_kg_m2": coefficient, "density": factor, "bank_rad": bank, "duration_s": 3000.0}
    return Problem(
        "lifting" if lifting else "ballistic",
        f"{'lifting' if lifting else 'ballistic'} entry to 10 km",
        _methods("entry" if lifting else "ballistic"),
        inputs,
        first,
        parameters if lifting else parameters[:1],
        rates.entry if lifting else rates.ballistic,
        3000.0,
        4.0,
        rates.entry_height,
        sizes=(RADIUS,) * 3 + (7800.0,) * 3,
    )


@cache
def satellite() -> Problem:
    """The turn of a flexible satellite, 200 s; its 18 states and their derivative are in `flexible`."""
    rng = np.random.default_rng(6)
    inertia = np.array([100.0, 75.0, 50.0])[:, None] * (1.0 + 0.1 / 3 * rng.normal(size=(3, CASES)))
    inputs: dict[str, Any] = dict(zip(("jx_kg_m2", "jy_kg_m2", "jz_kg_m2"), inertia, strict=True))
    first = np.repeat(flexible.FIRST[:, None], CASES, axis=1)
    return Problem(
        "satellite",
        "flexible satellite, 18 states, 200 s",
        {"RK4": "satellite"},
        inputs | {"duration_s": 200.0, "step_s": 0.01},
        first,
        inertia,
        None,
        200.0,
        compared=(3, 7),
        unit="1",
    )


BY_KEY: dict[str, Callable[[], Problem]] = {
    "orbit": orbit,
    "transfer": transfer,
    "ballistic": lambda: entry(0.0),
    "lifting": lambda: entry(0.3),
    "satellite": satellite,
    "oblate": oblate,
    "two_body": two_body,
}
