"""A body under the Coriolis acceleration alone, which turns its speed and keeps its size.  SI."""

from mc_engine.lanes import physics, sqrt
from mc_engine.model import FixedStep, Parameter, Setting, at_end, inputs, metrics, model, outputs, states

Inputs = inputs(
    turn_rad_s=Parameter(0.0, "angular velocity of the frame"),
    step_s=Setting(1.0, "step"),
    until_s=Setting(10.0, "end"),
)
State = states(x_m="x", y_m="y", u_m_s="speed along x", v_m_s="speed along y")
Outputs = outputs(speed_m_s="speed")
Metrics = metrics(end_speed_m_s=at_end("speed_m_s", "speed at the end"))


@physics
def initial():
    return State(x=0.0, y=0.0, u=1.0, v=0.0)


@physics
def rhs(s, p):
    return State(x=s.u, y=s.v, u=2.0 * p.turn * s.v, v=-2.0 * p.turn * s.u)


@physics
def observe(s):
    return Outputs(speed=sqrt(s.u * s.u + s.v * s.v))


MODEL = model(
    name="turning_frame",
    title="A body in a turning frame",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=FixedStep("step", "until", method="gj8", rates=(("x", "u"), ("y", "v"))),
    initial=initial,
    rhs=rhs,
    observe=observe,
)
