"""Basilisk: its Runge-Kutta integrator of order 4 on a craft without attitude, around an oblate Earth.

Every case is a spacecraft of one simulation, moved by the task that steps them all: Basilisk's least overhead.  A
craft of Basilisk has attitude unless told otherwise; both are flown.
"""

import math

import numpy as np
from Basilisk.simulation import gravityEffector, spacecraft, svIntegrators
from Basilisk.utilities import SimulationBaseClass, macros

from mc_engine.physics.constants import EQUATORIAL_RADIUS, J2_EARTH, MU_EARTH
from tests.benchmarks.peer_codes.entrant import Entrant, Flight
from tests.benchmarks.peer_codes.problems import Problem


def _earth(oblate: bool):
    """The Earth as a point mass or with J2, which Basilisk wants fully normalised."""
    body = gravityEffector.GravBodyData()
    body.planetName, body.isCentralBody = "earth", True
    body.mu, body.radEquator = MU_EARTH, EQUATORIAL_RADIUS
    if oblate:
        field = gravityEffector.SphericalHarmonicsGravityModel()
        field.radEquator, field.muBody, field.maxDeg = EQUATORIAL_RADIUS, MU_EARTH, 2
        field.cBar = gravityEffector.MultiArray([[1.0], [0.0, 0.0], [-J2_EARTH / math.sqrt(5.0), 0.0, 0.0]])
        field.sBar = gravityEffector.MultiArray([[0.0], [0.0, 0.0], [0.0, 0.0, 0.0]])
        body.gravityModel = field
    return body


def _craft(state: np.ndarray, oblate: bool, attitude: bool):
    """A spacecraft and what it needs kept alive."""
    craft, earth = spacecraft.Spacecraft(), _earth(oblate)
    integrator = svIntegrators.svIntegratorRK4(craft)
    craft.setIntegrator(integrator)
    craft.pointMassTranslationalOnly = not attitude
    craft.gravField.gravBodies = spacecraft.GravBodyVector([earth])
    craft.hub.mHub = 100.0
    craft.hub.IHubPntBc_B = [[10.0, 0.0, 0.0], [0.0, 10.0, 0.0], [0.0, 0.0, 10.0]]
    craft.hub.r_CN_NInit, craft.hub.v_CN_NInit = state[:3, None].tolist(), state[3:, None].tolist()
    return craft, integrator, earth


def entrants(problem: Problem, step: float) -> list[Entrant]:
    """The peer with a step [s], without attitude and with."""
    return [_entrant(problem, step, attitude) for attitude in (False, True)]


def _entrant(problem: Problem, step: float, attitude: bool) -> Entrant:
    def build(cases: Problem, value: float, threads: int) -> Flight:
        simulation = SimulationBaseClass.SimBaseClass()
        process = simulation.CreateNewProcess("flight")
        process.addTask(simulation.CreateNewTask("steps", macros.sec2nano(value)))
        crafts = [_craft(state, cases.key == "oblate", attitude) for state in cases.first.T]
        for craft, _, _ in crafts:
            simulation.AddModelToTask("steps", craft)
        simulation.InitializeSimulation()
        simulation.ConfigureStopTime(macros.sec2nano(cases.duration))

        def fly() -> np.ndarray:
            simulation.ExecuteSimulation()
            ends = [craft.scStateOutMsg.read() for craft, _, _ in crafts]
            return np.array([[*end.r_BN_N, *end.v_BN_N] for end in ends]).T

        return fly

    form = "RK4, with attitude" if attitude else "RK4, translation only"
    return Entrant("Basilisk", form, problem, "step", (step,), build, cases=4, checked=2, parallel=False, once=True)
