"""A short motion whose derivative is dear, then a long cheap one: by phases, and by `where`.  SI."""

from mc_engine.lanes import exp, physics, sin, sqrt, where
from mc_engine.model import Event, FixedStep, Parameter, Phase, inputs, metrics, model, outputs, states, value_at

Inputs = inputs(change_s=Parameter(2.0, "end of the first motion"), first_x_m=Parameter(1.0, "first place"))
State = states(x_m="x", y_m="y", vx_m_s="speed along x", vy_m_s="speed along y")
Outputs = outputs(x_m="x")
Metrics = metrics(last_x_m=value_at("end", "x_m", "x at the end"))


@physics
def initial(p):
    return State(x=p.first_x, y=0.0, vx=0.0, vy=1.0)


@physics
def wild(s):
    """A sum of twenty damped waves."""
    ax, ay = -s.x, -s.y
    for k in range(20):
        damping = exp(-0.1 * (k + 1.0) * (s.x * s.x + s.y * s.y))
        ax = ax + 0.01 * damping * sin((k + 1.0) * s.y)
        ay = ay + 0.01 * damping * sqrt(1.0 + (k + 1.0) * s.x * s.x)
    return State(x=s.vx, y=s.vy, vx=ax, vy=ay)


@physics
def calm(s):
    return State(x=s.vx, y=s.vy, vx=-0.1 * s.vx, vy=-0.1 * s.vy)


@physics
def both(t, s, p):
    first, a, b = t < p.change, wild(s), calm(s)
    return State(x=s.vx, y=s.vy, vx=where(first, a.vx, b.vx), vy=where(first, a.vy, b.vy))


@physics
def change(t, p):
    return t - p.change


@physics
def end(t):
    return t - 40.0


@physics
def switch(s, m):
    return s, m


@physics
def observe(s):
    return Outputs(x=s.x)


DECLARED = {
    "name": "two_motions", "title": "Two motions", "inputs": Inputs, "states": State, "outputs": Outputs,
    "metrics": Metrics, "initial": initial, "observe": observe, "clock": FixedStep(step=0.01, until=50.0),
}  # fmt: skip
END = {"end": Event(end, "rising", "stop")}
CHANGE = Event(change, "rising", to="calm")
MODEL = model(
    **DECLARED, phases={"wild": Phase(wild, events={"change": CHANGE, **END}), "calm": Phase(calm, events=END)}
)
