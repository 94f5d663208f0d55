"""A mass on a spring, pushed by a force that depends on time alone: x'' = -4 x + sin t, from rest at 0.

x = (sin t - sin(2 t) / 2) / 3
"""

from mc_engine.lanes import physics, sin
from mc_engine.model import FixedStep, Parameter, Setting, at_end, inputs, metrics, model, outputs, states

Inputs = inputs(frequency_rad_s=Parameter(2.0, "frequency"), step_s=Setting(0.05, "step"))
State = states(x_m="elongation", v_m_s="speed")
Outputs = outputs(x_m="elongation")
Metrics = metrics(end_m=at_end("x_m", "elongation in the end"))


@physics
def initial():
    return State(x=0.0, v=0.0)


@physics
def rhs(t, s, p):
    return State(x=s.v, v=sin(t) - p.frequency * p.frequency * s.x)


@physics
def observe(s):
    return Outputs(x=s.x)


MODEL = model(
    name="pushed spring",
    title="A mass on a spring under a force of time",
    source="",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=FixedStep("step", 10.0),
    initial=initial,
    rhs=rhs,
    observe=observe,
)
