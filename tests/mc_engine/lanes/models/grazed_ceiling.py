"""A throw under constant gravity that rises a little over a ceiling, where the model is asked to switch."""

from mc_engine.lanes import physics, sqrt
from mc_engine.model import (
    AdaptiveStep,
    Event,
    Parameter,
    inputs,
    maximum_of,
    metrics,
    model,
    outputs,
    states,
    time_of,
    time_of_maximum,
)

GRAVITY, CEILING = 9.8, 100.0

Inputs = inputs(excess_m=Parameter(0.1, "height of the top above the ceiling", low=0.0))
State = states(h_m="height", v_m_s="speed upwards")
Outputs = outputs(height_m="height")
Metrics = metrics(
    rise_s=time_of("rise", "time of the way up through the ceiling"),
    fall_s=time_of("fall", "time of the way down through the ceiling"),
    top_m=maximum_of("height_m", "largest height"),
    top_s=time_of_maximum("height_m", "time of the largest height"),
)


@physics
def initial(p):
    return State(h=0.0, v=sqrt(2.0 * GRAVITY * (CEILING + p.excess)))


@physics
def rhs(s):
    return State(h=s.v, v=-GRAVITY)


@physics
def ceiling(s):
    return s.h - CEILING


@physics
def height(s):
    return s.h


@physics
def switch(s, m):
    return s, m


@physics
def observe(s):
    return Outputs(height=s.h)


MODEL = model(
    name="grazed_ceiling",
    title="A throw that grazes a ceiling",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=AdaptiveStep(until=30.0),
    initial=initial,
    rhs=rhs,
    observe=observe,
    switch=switch,
    events={
        "rise": Event(ceiling, "rising", "switch"),
        "fall": Event(ceiling, "falling", "switch"),
        "ground": Event(height, "falling", "stop"),
    },
)
