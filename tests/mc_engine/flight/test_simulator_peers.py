"""A day around an oblate Earth, flown by Basilisk as a simulator and by a compiled model, paired by case."""

import numpy as np
import pytest

from mc_engine import load_campaign, run

pytest.importorskip("Basilisk", reason='the extra "bench" is missing')
CAMPAIGN = """
[campaign]
{flies}
cases = 6
design = "mc"
seed = 11

[dispersion.altitude_km]
dist = "normal"
sigma = 20.0

[dispersion.speed_error_m_s]
dist = "normal"
sigma = 5.0
"""
BASILISK = """
import math

from Basilisk.simulation import gravityEffector, spacecraft, svIntegrators
from Basilisk.utilities import SimulationBaseClass, macros

from mc_engine import Parameter, Simulator
from mc_engine.model import inputs, metrics
from mc_engine.physics.constants import EQUATORIAL_RADIUS, J2_EARTH, MU_EARTH


def earth():
    field = gravityEffector.SphericalHarmonicsGravityModel()
    field.radEquator, field.muBody, field.maxDeg = EQUATORIAL_RADIUS, MU_EARTH, 2
    field.cBar = gravityEffector.MultiArray([[1.0], [0.0, 0.0], [-J2_EARTH / math.sqrt(5.0), 0.0, 0.0]])
    field.sBar = gravityEffector.MultiArray([[0.0], [0.0, 0.0], [0.0, 0.0, 0.0]])
    body = gravityEffector.GravBodyData()
    body.planetName, body.isCentralBody, body.gravityModel = "earth", True, field
    body.mu, body.radEquator = MU_EARTH, EQUATORIAL_RADIUS
    return body


def fly(inputs, case):
    r = EQUATORIAL_RADIUS + 1e3 * inputs["altitude_km"]
    v = math.sqrt(MU_EARTH / r) + inputs["speed_error_m_s"]
    simulation, craft, body = SimulationBaseClass.SimBaseClass(), spacecraft.Spacecraft(), earth()
    simulation.CreateNewProcess("flight").addTask(simulation.CreateNewTask("steps", macros.sec2nano(10.0)))
    integrator = svIntegrators.svIntegratorRK4(craft)
    craft.setIntegrator(integrator)
    craft.pointMassTranslationalOnly = True
    craft.gravField.gravBodies = spacecraft.GravBodyVector([body])
    craft.hub.mHub = 100.0
    craft.hub.r_CN_NInit = [[r], [0.0], [0.0]]
    craft.hub.v_CN_NInit = [[0.0], [v * math.cos(0.9)], [v * math.sin(0.9)]]
    simulation.AddModelToTask("steps", craft)
    simulation.InitializeSimulation()
    simulation.ConfigureStopTime(macros.sec2nano(86_400.0))
    simulation.ExecuteSimulation()
    return dict(zip(("x_km", "y_km", "z_km"), (1e-3 * x for x in craft.scStateOutMsg.read().r_BN_N)))


SIMULATOR = Simulator(
    title="A day around the Earth, by Basilisk",
    parameters=inputs(altitude_km=Parameter(500.0, "altitude"), speed_error_m_s=Parameter(0.0, "error of the speed")),
    metrics=metrics(x_km="x after a day", y_km="y after a day", z_km="z after a day"),
    fly=fly,
)
"""
MODEL = """
from mc_engine.lanes import cos, physics, sin, sqrt
from mc_engine.model import FixedStep, Parameter, at_end, inputs, metrics, model, outputs, states
from mc_engine.physics.constants import EQUATORIAL_RADIUS, MU_EARTH
from mc_engine.physics.gravity import j2_perturbation, point_mass

Inputs = inputs(altitude_km=Parameter(500.0, "altitude"), speed_error_m_s=Parameter(0.0, "error of the speed"))
State = states(x_m="x", y_m="y", z_m="z", vx_m_s="vx", vy_m_s="vy", vz_m_s="vz")
Outputs = outputs(x_km="x", y_km="y", z_km="z")
Metrics = metrics(
    x_km=at_end("x_km", "x after a day"), y_km=at_end("y_km", "y after a day"), z_km=at_end("z_km", "z after a day")
)


@physics
def initial(p):
    r = EQUATORIAL_RADIUS + p.altitude
    v = sqrt(MU_EARTH / r) + p.speed_error
    return State(x=r, y=0.0, z=0.0, vx=0.0, vy=v * cos(0.9), vz=v * sin(0.9))


@physics
def rhs(s):
    gx, gy, gz = point_mass(s.x, s.y, s.z, MU_EARTH)
    jx, jy, jz = j2_perturbation(s.x, s.y, s.z, MU_EARTH)
    return State(x=s.vx, y=s.vy, z=s.vz, vx=gx + jx, vy=gy + jy, vz=gz + jz)


@physics
def observe(s):
    return Outputs(x=s.x, y=s.y, z=s.z)


MODEL = model(
    name="day", title="A day around the Earth", inputs=Inputs, states=State, outputs=Outputs, metrics=Metrics,
    clock=FixedStep(step=10.0, until=86_400.0), initial=initial, rhs=rhs, observe=observe,
)
"""


def test_a_day_of_basilisk_is_that_of_the_compiled_model(tmp_path):
    tables = []
    for name, key, text in (("sim.py", "simulator", BASILISK), ("model.py", "model", MODEL)):
        home = tmp_path / key
        home.mkdir()
        (home / name).write_text(text)
        (home / "campaign.toml").write_text(CAMPAIGN.format(flies=f'{key} = "{name}"'))
        tables.append(run(load_campaign(home / "campaign.toml"), tmp_path / f"run-{key}", workers=2).cases())
    basilisk, ours = tables
    assert set(basilisk["status"]) == {"ok"}, set(basilisk["reason"])
    assert list(basilisk["altitude_km"]) == list(ours["altitude_km"])
    axes = ["x_km", "y_km", "z_km"]
    apart_m = 1e3 * np.linalg.norm(basilisk[axes].to_numpy() - ours[axes].to_numpy(), axis=1)
    one_millimetre = 1e-3  # both step by RK4 and 10 s: what is left is rounding, over 16 orbits
    assert apart_m.max() < one_millimetre, apart_m
