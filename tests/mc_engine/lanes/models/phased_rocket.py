"""A rocket in the plane: rail, powered, coast and parachute, which opens late.  On a grid; SI."""

from collections import namedtuple

from mc_engine.lanes import exp, physics, sqrt, where
from mc_engine.model import (
    Event,
    Field,
    FixedStep,
    Parameter,
    Phase,
    at_end,
    inputs,
    maximum_of,
    metrics,
    model,
    outputs,
    states,
    time_of,
    value_at,
)

GRAVITY, SLOPE, DRAG, CHUTE, SCALE_HEIGHT, KICK = 9.80665, 0.1, 1e-3, 0.05, 8000.0, 4.0

Inputs = inputs(
    rail_m=Parameter(5.0, "length of the rail", low=0.1),
    burn_s=Parameter(3.0, "end of thrust", low=0.1),
    thrust_m_s2=Parameter(60.0, "thrust over mass", low=20.0),
    lag_s=Parameter(0.8, "time from the apogee to the open parachute"),
)
State = states(x_m="distance", h_m="height", vx_m_s="speed along", vh_m_s="speed upwards")
Outputs = outputs(
    height_m="height",
    speed_m_s="speed",
    since_s="time since the phase began",
    on_rail=Field("1 on the rail", unit=""),
    samples=Field("calls of control", unit=""),
)
Metrics = metrics(
    exit_m_s=value_at("rail_exit", "speed_m_s", "speed at the end of the rail"),
    burnout_m_s=value_at("burnout", "speed_m_s", "speed at burnout, before the kick"),
    apogee_m=value_at("apogee", "height_m", "height of the apogee"),
    apogee_s=time_of("apogee", "time of the apogee"),
    ground_m_s=value_at("ground", "speed_m_s", "speed at the ground"),
    landing_s=at_end("t_s", "time of the landing"),
    under_parachute_s=at_end("since_s", "time under the parachute"),
    samples=at_end("samples", "calls of control", unit=""),
    top_m_s=maximum_of("speed_m_s", "top speed"),
)
Memory = namedtuple("Memory", "samples", defaults=(0.0,))


@physics
def initial():
    return State(x=0.0, h=0.0, vx=0.0, vh=0.0)


@physics
def falling(s, factor):
    """Derivative of the state under drag, factor v^2 at the ground, and gravity."""
    drag = factor * sqrt(s.vx * s.vx + s.vh * s.vh) * exp(-s.h / SCALE_HEIGHT)
    return State(x=s.vx, h=s.vh, vx=-drag * s.vx, vh=-drag * s.vh - GRAVITY)


@physics
def slide(s, p):
    return State(x=SLOPE * s.vh, h=s.vh, vx=SLOPE * (p.thrust - GRAVITY), vh=p.thrust - GRAVITY)


@physics
def powered(s, p):
    free, along = falling(s, DRAG), p.thrust / sqrt(s.vx * s.vx + s.vh * s.vh)
    return State(x=free.x, h=free.h, vx=free.vx + along * s.vx, vh=free.vh + along * s.vh)


@physics
def coast(s):
    return falling(s, DRAG)


@physics
def descent(s):
    return falling(s, CHUTE)


@physics
def counted(m):
    return Memory(samples=m.samples + 1.0)


@physics
def switch(s, m, hit):
    kick = 1.0 + where(hit.burnout > 0.5, KICK / sqrt(s.vx * s.vx + s.vh * s.vh), 0.0)
    return State(x=s.x, h=s.h, vx=kick * s.vx, vh=kick * s.vh), m


@physics
def left(s, p):
    return s.h - p.rail


@physics
def burnt(t, p):
    return t - p.burn


@physics
def climb(s):
    return s.vh


@physics
def height(s):
    return s.h


@physics
def observe(s, m, since, phase):
    speed = sqrt(s.vx * s.vx + s.vh * s.vh)
    return Outputs(height=s.h, speed=speed, since=since, on_rail=phase.rail, samples=m.samples)


DECLARED = {
    "name": "phased_rocket",
    "title": "A rocket in four phases",
    "inputs": Inputs,
    "states": State,
    "outputs": Outputs,
    "metrics": Metrics,
    "memory": Memory,
    "initial": initial,
    "observe": observe,
    "switch": switch,
    "phases": {
        "rail": Phase(slide, events={"rail_exit": Event(left, "rising", to="powered")}),
        "powered": Phase(powered, counted, {"burnout": Event(burnt, "rising", to="coast")}),
        "coast": Phase(coast, events={"apogee": Event(climb, "falling", to="descent", after="lag")}),
        "descent": Phase(descent, events={"ground": Event(height, "falling", "stop")}),
    },
}
MODEL = model(**DECLARED, clock=FixedStep(step=0.01, until=200.0, control_every=50))
