"""A body around a point mass in a plane, from its perigee; one turn a second, 1 m of semi-major axis.  SI."""

from mc_engine.lanes import physics, sqrt
from mc_engine.model import Field, FixedStep, Parameter, Setting, inputs, metrics, model, outputs, states

MU = 39.47841760435743  # 4 pi^2
RATES = (("x", "vx"), ("y", "vy"))

State = states(x_m="place", vy_m_s="speed", vx_m_s="speed", y_m="place")
Outputs = outputs(x_m="place")
Metrics = metrics(miss_m="distance from the perigee in the end", energy=Field("relative error of the energy", unit=""))


@physics
def initial(p):
    return State(x=1.0 - p.eccentricity, y=0.0, vx=0.0, vy=sqrt(MU * (1.0 + p.eccentricity) / (1.0 - p.eccentricity)))


@physics
def rhs(s, p):
    r2 = s.x * s.x + s.y * s.y
    g = -MU / (r2 * sqrt(r2))
    return State(x=s.vx - p.drift, y=s.vy, vx=g * s.x, vy=g * s.y)


@physics
def observe(s):
    return Outputs(x=s.x)


@physics
def evaluate(s, p):
    apart = s.x - (1.0 - p.eccentricity)
    energy = 0.5 * (s.vx * s.vx + s.vy * s.vy) - MU / sqrt(s.x * s.x + s.y * s.y)
    return Metrics(miss=sqrt(apart * apart + s.y * s.y), energy=energy / (-0.5 * MU) - 1.0)


MODEL = model(
    name="kepler",
    title="A body around a point mass",
    inputs=inputs(
        eccentricity=Parameter(0.0, "eccentricity", unit=""),
        drift_m_s=Parameter(0.0, "speed of the place from which x is measured"),
        step_s=Setting(0.01, "step"),
        until_s=Setting(1.0, "end"),
    ),
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=FixedStep("step", "until", method="gj8", rates=RATES),
    initial=initial,
    rhs=rhs,
    observe=observe,
    evaluate=evaluate,
)
