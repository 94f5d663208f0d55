"""nyx: its propagators on a two-body orbit, many cases in one call.

Its gravity field and its drag look the Earth up in tables of planetary constants that do not come with the package, so
it flies the point mass alone; an almanac without contents is enough for that.
"""

import tempfile
from pathlib import Path

import numpy as np
from nyx_space import Frame, Mass, Orbit, Spacecraft
from nyx_space.anise import Almanac, LocationDhallSet
from nyx_space.mission_design import (
    AccelModels,
    Dynamics,
    ForceModels,
    IntegratorMethod,
    IntegratorOptions,
    Propagator,
)
from nyx_space.time import Duration, Epoch

from mc_engine.physics.constants import MU_EARTH
from tests.benchmarks.peer_codes.entrant import TOLERANCES, Entrant, Flight
from tests.benchmarks.peer_codes.problems import Problem

EARTH, J2000 = 399, 1  # NAIF numbers
SHORTEST, LONGEST = "0.001 s", "2700 s"
LADDER = tuple(value for value in TOLERANCES if value > 1e-14)  # finer ones end at the shortest step
METHODS = {
    "RK4": IntegratorMethod.RungeKutta4,
    "DP78": IntegratorMethod.DormandPrince78,
    "RK89": IntegratorMethod.RungeKutta89,
}


def _empty_almanac() -> Almanac:
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "empty.lka")
        LocationDhallSet([]).to_dataset().save_as(path, True)
        return Almanac(path)


def _options(method: str, value: float) -> IntegratorOptions:
    if method == "RK4":
        return IntegratorOptions(Duration(f"{value} s"), Duration(f"{value} s"), 1e-9)
    return IntegratorOptions(Duration(SHORTEST), Duration(LONGEST), value)


def entrant(problem: Problem, method: str, ladder: tuple[float, ...] = LADDER) -> Entrant:
    """The peer with one of its methods; ladder of steps [s] for RK4, else of tolerances."""

    def build(cases: Problem, value: float, threads: int) -> Flight:
        frame, epoch = Frame(EARTH, J2000, mu_km3_s2=MU_EARTH * 1e-9), Epoch("2020-01-01T00:00:00 TDB")
        orbits = [Orbit.from_cartesian(*state, epoch, frame) for state in (cases.first.T * 1e-3).tolist()]
        crafts = [Spacecraft(orbit, Mass(100.0)) for orbit in orbits]
        dynamics = Dynamics(AccelModels(), ForceModels())
        propagator = Propagator(dynamics, _empty_almanac(), METHODS[method], _options(method, value))
        duration = Duration(f"{cases.duration} s")

        def fly() -> np.ndarray:
            done = propagator.many_for_duration(crafts, duration, trajectory=False)
            ends = [one.state.orbit for one in done]
            rows = [[o.x_km, o.y_km, o.z_km, o.vx_km_s, o.vy_km_s, o.vz_km_s] for o in ends]
            return np.array(rows).T * 1e3

        return fly

    knob = "step" if method == "RK4" else "tolerance"
    return Entrant("nyx", method, problem, knob, ladder, build, cases=8, checked=2, parallel=False)
