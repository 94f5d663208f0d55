"""A hop on the Moon in long steps: up under thrust, a coast over the height at which the legs are let out, and down."""

from mc_engine.lanes import physics
from mc_engine.model import (
    AdaptiveStep,
    Event,
    Parameter,
    Phase,
    at_end,
    inputs,
    last_above,
    metrics,
    model,
    outputs,
    states,
    time_of,
)

GRAVITY, THRUST = 1.62, 5.0  # m/s^2

Inputs = inputs(burn_s=Parameter(5.0, "burn time"))
State = states(h_m="height", v_m_s="speed")
Outputs = outputs(h_m="height")
Metrics = metrics(
    legs_s=time_of("legs_out", "legs are let out"),
    last_s=last_above("h_m", 100.0, "last time above 100 m"),
    land_s=at_end("t_s", "landing"),
)


@physics
def initial():
    return State(h=0.0, v=0.0)


@physics
def burn(s):
    return State(h=s.v, v=THRUST - GRAVITY)


@physics
def coast(s):
    return State(h=s.v, v=-GRAVITY)


@physics
def burnt(t, p):
    return t - p.burn


@physics
def above_100(s):
    return s.h - 100.0


@physics
def ground(s):
    return s.h


@physics
def observe(s):
    return Outputs(h=s.h)


_DOWN = Event(ground, "falling", "stop")
MODEL = model(
    name="moon_hop",
    title="A hop on the Moon",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=AdaptiveStep(until=300.0),
    initial=initial,
    observe=observe,
    phases={
        "burn": Phase(burn, events={"burnout": Event(burnt, "rising", to="coast")}),
        "coast": Phase(coast, events={"legs_out": Event(above_100, "falling", to="legs"), "down": _DOWN}),
        "legs": Phase(coast, events={"down_on_legs": _DOWN}),
    },
)
