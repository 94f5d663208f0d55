"""A shift by full thrust one way or the other, chosen anew at every sample: outputs that jump there."""

from collections import namedtuple

from mc_engine.lanes import physics, where
from mc_engine.model import (
    FixedStep,
    Parameter,
    inputs,
    last_above,
    maximum_of,
    metrics,
    minimum_of,
    model,
    outputs,
    states,
    time_of_maximum,
)

Inputs = inputs(push_m_s2=Parameter(1.0, "acceleration by the thrust"))
State = states(x_m="place", v_m_s="speed")
Outputs = outputs(push_m_s2="acceleration", moved_m="way since the last sample")
Memory = namedtuple("Memory", "push place", defaults=(0.0, 0.0))
Metrics = metrics(
    top_m_s2=maximum_of("push_m_s2", "largest acceleration"),
    top_s=time_of_maximum("push_m_s2", "time of the largest acceleration"),
    low_m_s2=minimum_of("push_m_s2", "smallest acceleration"),
    last_s=last_above("push_m_s2", 0.5, "last time of a positive acceleration"),
    moved_m=maximum_of("moved_m", "longest way between two samples", smooth=False),
)


@physics
def initial():
    return State(x=0.3, v=0.0)


@physics
def rhs(s, m):
    return State(x=s.v, v=m.push)


@physics
def control(s, p):
    ahead = s.x + s.v
    return Memory(push=where(ahead > 0.05, -p.push, where(ahead < -0.05, p.push, 0.0)), place=s.x)


@physics
def observe(s, m):
    return Outputs(push=m.push, moved=abs(s.x - m.place))


MODEL = model(
    name="bang_bang",
    title="Bang-bang control",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    memory=Memory,
    control=control,
    clock=FixedStep(step=0.1, until=10.0, control_every=3),
    initial=initial,
    rhs=rhs,
    observe=observe,
)
