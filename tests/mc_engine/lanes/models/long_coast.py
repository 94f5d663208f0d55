"""Two controlled phases of some seconds, and an hour's coast between them; the control counts its samples and noise."""

from collections import namedtuple

from mc_engine.lanes import physics, where
from mc_engine.lanes.noise import normal_pair
from mc_engine.model import (
    AdaptiveStep,
    Event,
    Field,
    Parameter,
    Phase,
    at_end,
    inputs,
    metrics,
    model,
    outputs,
    states,
)

Inputs = inputs(wake_s=Parameter(3600.0, "end of the coast"))
State = states(x_m="place")
Memory = namedtuple("Memory", "samples noise first", defaults=(0.0, 0.0, 0.0))
Outputs = outputs(
    samples=Field("samples", unit=""),
    noise=Field("sum of the noise", unit=""),
    first_s="first sample after the coast",
)
Metrics = metrics(
    samples=at_end("samples", "samples", unit=""),
    noise=at_end("noise", "sum of the noise", unit=""),
    first_s=at_end("first_s", "first sample after the coast"),
)


@physics
def initial():
    return State(x=0.0)


@physics
def move():
    return State(x=1.0)


@physics
def count(t, m, p, draws):
    noise, _ = normal_pair(draws, 0)
    first = where((t > p.wake) & (m.first == 0.0), t, m.first)
    return Memory(samples=m.samples + 1.0, noise=m.noise + noise, first=first)


@physics
def sleep(t):
    return t - 5.03


@physics
def wake(t, p):
    return t - p.wake


@physics
def stop(t, p):
    return t - p.wake - 5.03


@physics
def observe(m):
    return Outputs(samples=m.samples, noise=m.noise, first=m.first)


MODEL = model(
    name="long_coast",
    title="A coast between two controlled phases",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    memory=Memory,
    clock=AdaptiveStep(until=10_000.0, control_period=0.1, attempts=200),
    initial=initial,
    observe=observe,
    phases={
        "before": Phase(move, count, events={"sleep": Event(sleep, "rising", to="coast")}),
        "coast": Phase(move, events={"wake": Event(wake, "rising", to="after")}),
        "after": Phase(move, count, events={"stop": Event(stop, "rising", "stop")}),
    },
)
