"""A fall that a parachute brakes: its load falls, jumps when the parachute opens, and falls again."""

from mc_engine.lanes import physics, where
from mc_engine.model import (
    AdaptiveStep,
    Event,
    Parameter,
    Phase,
    inputs,
    maximum_of,
    metrics,
    model,
    outputs,
    states,
    time_of_maximum,
)

BODY, CHUTE = 1e-3, 0.05  # drag over mass, 1/m

Inputs = inputs(open_s=Parameter(5.0, "opening"))
State = states(v_m_s="speed")
Outputs = outputs(load_m_s2="deceleration")
Metrics = metrics(
    top_m_s2=maximum_of("load_m_s2", "largest deceleration"),
    top_s=time_of_maximum("load_m_s2", "time of the largest deceleration"),
)


@physics
def initial():
    return State(v=200.0)


@physics
def free(s):
    return State(v=9.81 - BODY * s.v * s.v)


@physics
def braked(s):
    return State(v=9.81 - CHUTE * s.v * s.v)


@physics
def opening(t, p):
    return t - p.open


@physics
def end(t):
    return t - 20.0


@physics
def observe(s, phase):
    return Outputs(load=where(phase.chute > 0.5, CHUTE, BODY) * s.v * s.v)


MODEL = model(
    name="opened_parachute",
    title="A parachute that opens",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=AdaptiveStep(until=100.0),
    initial=initial,
    observe=observe,
    phases={
        "free": Phase(free, events={"opening": Event(opening, "rising", to="chute")}),
        "chute": Phase(braked, events={"end": Event(end, "rising", "stop")}),
    },
)
