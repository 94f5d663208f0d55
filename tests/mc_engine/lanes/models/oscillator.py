"""A mass on a spring with sampled control, noise and a way to break: for tests of the loop.  SI."""

from collections import namedtuple

from mc_engine.lanes import physics, sqrt
from mc_engine.lanes.noise import normal_pair
from mc_engine.model import (
    Field,
    FixedStep,
    Parameter,
    Setting,
    inputs,
    last_above,
    maximum_of,
    metrics,
    minimum_of,
    model,
    outputs,
    states,
    time_of_maximum,
    time_of_minimum,
)

Inputs = inputs(
    rate_rad_s=Parameter(1.0, "angular frequency"),
    x0_km=Parameter(1.0, "first place"),
    v0_m_s=Parameter(0.0, "first speed"),
    gain_1_s=Parameter(0.0, "gain of the sampled damping", unit="1/s"),
    noise_m_s2=Parameter(0.0, "1-sigma of the sampled push", low=0.0),
    breaks_at_s=Parameter(1e9, "time after which the motion is not a number"),
    step_s=Setting(0.1, "step"),
    until_s=Setting(10.0, "end"),
    every=Setting(1.0, "steps from one sample to the next", unit=""),
)
State = states(x_km="place", v_m_s="speed")
Memory = namedtuple("Memory", "push samples sampled_at", defaults=(0.0, 0.0, -1.0))
Outputs = outputs(x_km="place", v_m_s="speed", energy=Field("energy per mass", unit=""))
Metrics = metrics(
    top_km=maximum_of("x_km", "largest x"),
    top_time_s=time_of_maximum("x_km", "when"),
    bottom_km=minimum_of("x_km", "smallest x"),
    bottom_time_s=time_of_minimum("x_km", "when"),
    sampled_top_km=maximum_of("x_km", "largest x at a step", smooth=False),
    sampled_top_time_s=time_of_maximum("x_km", "when", smooth=False),
    late_time_s=last_above("x_km", 500.0, "last time with x above 500 m"),
    samples=Field("samples of the control", unit=""),
    sampled_at_s="last of them",
)


@physics
def initial(p):
    return State(x=p.x0, v=p.v0)


@physics
def control(t, s, m, p, draws):
    n, _ = normal_pair(draws, 0)
    return Memory(push=p.noise * n - p.gain * s.v, samples=m.samples + 1.0, sampled_at=t)


@physics
def rhs(t, s, m, p):
    # a root below zero is not a number: that is how a case breaks
    return State(x=s.v, v=m.push - p.rate * p.rate * s.x + 0.0 * sqrt(p.breaks_at - t))


@physics
def observe(s, p):
    return Outputs(x=s.x, v=s.v, energy=0.5 * (s.v * s.v + p.rate * p.rate * (s.x * s.x)))


@physics
def evaluate(m):
    return Metrics(samples=m.samples, sampled_at=m.sampled_at)


MODEL = model(
    name="oscillator",
    title="A mass on a spring",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=FixedStep("step", "until", "every"),
    initial=initial,
    rhs=rhs,
    memory=Memory,
    control=control,
    observe=observe,
    evaluate=evaluate,
)
