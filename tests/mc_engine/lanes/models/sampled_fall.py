"""A ball that falls to the ground while a control counts its samples: for tests of what ended cases keep.  SI."""

from collections import namedtuple

from mc_engine.lanes import physics
from mc_engine.model import Event, Field, FixedStep, Parameter, Setting, inputs, metrics, model, outputs, states

Inputs = inputs(height_m=Parameter(5.0, "first height"), every=Setting(1.0, "steps between samples", unit=""))
State = states(h_m="height", v_m_s="speed upwards")
Memory = namedtuple("Memory", "samples sampled_at", defaults=(0.0, -1.0))
Outputs = outputs(height_m="height")
Metrics = metrics(samples=Field("samples of the control", unit=""), sampled_at_s="last of them")


@physics
def initial(p):
    return State(h=p.height, v=0.0)


@physics
def control(t, m):
    return Memory(samples=m.samples + 1.0, sampled_at=t)


@physics
def rhs(s):
    return State(h=s.v, v=-10.0)


@physics
def above_ground(s):
    return s.h


@physics
def observe(s):
    return Outputs(height=s.h)


@physics
def evaluate(m):
    return Metrics(samples=m.samples, sampled_at=m.sampled_at)


MODEL = model(
    name="sampled_fall", title="A ball and a control", inputs=Inputs, states=State, outputs=Outputs, metrics=Metrics,
    memory=Memory, clock=FixedStep(0.25, 10.0, "every"), initial=initial, control=control, rhs=rhs, observe=observe,
    evaluate=evaluate, events={"ground": Event(above_ground, "falling", "stop")},
)  # fmt: skip
