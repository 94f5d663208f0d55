"""A throw under constant gravity that rises a little over a ceiling, where the model is asked to switch.

Its axes are turned, so that the height of a fast throw along the ceiling is a sum of large, rounded numbers.
"""

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
UP_X, UP_Y = 0.6, 0.8  # the direction upwards

Inputs = inputs(
    excess_m=Parameter(0.1, "height of the top above the ceiling", low=0.0),
    along_m_s=Parameter(0.0, "speed along the ceiling"),
    lag_s=Parameter(100.0, "time from the ceiling to a late switch"),
)
State = states(x_m="x", y_m="y", vx_m_s="speed along x", vy_m_s="speed along y")
Outputs = outputs(height_m="height")
Metrics = metrics(
    rise_s=time_of("rise", "time of the way up through the ceiling"),
    fall_s=time_of("fall", "time of the way down through the ceiling"),
    top_m=maximum_of("height_m", "largest height"),
    top_s=time_of_maximum("height_m", "time of the largest height"),
)


@physics
def initial(p):
    speed = sqrt(2.0 * GRAVITY * (CEILING + p.excess))
    return State(x=0.0, y=0.0, vx=UP_X * speed - UP_Y * p.along, vy=UP_Y * speed + UP_X * p.along)


@physics
def rhs(s):
    return State(x=s.vx, y=s.vy, vx=-UP_X * GRAVITY, vy=-UP_Y * GRAVITY)


@physics
def height(s):
    return UP_X * s.x + UP_Y * s.y


@physics
def ceiling(s):
    return height(s) - CEILING


@physics
def switch(s, m):
    return s, m


@physics
def observe(s):
    return Outputs(height=height(s))


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
        "late": Event(ceiling, "rising", "switch", rare=True, after="lag"),
        "fall": Event(ceiling, "falling", "switch"),
        "ground": Event(height, "falling", "stop"),
    },
)
