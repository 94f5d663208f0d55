"""Outputs that bend at a limit or jump at a sample of the control, and one that does neither: for tests of extremes."""

from collections import namedtuple

from mc_engine.lanes import minimum, physics, sin, where
from mc_engine.model import (
    Field,
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
)

Inputs = inputs(phase_rad=Parameter(0.0, "of the wave at the start"))
State = states(x_rad="phase")
Memory = namedtuple("Memory", "relay began", defaults=(0.0, 0.0))
Outputs = outputs(
    limited=Field("wave, cut at a limit", unit=""),
    relay=Field("sign of the wave at the sample", unit=""),
    saw=Field("phase since the sign last changed", unit=""),
    wave=Field("wave", unit=""),
    lit=Field("1 while the wave is positive, else 0", unit=""),
)
Metrics = metrics(
    limited_top=maximum_of("limited", unit=""),
    limited_last_s=last_above("limited", 0.8),
    relay_top=maximum_of("relay", unit=""),
    relay_bottom=minimum_of("relay", unit=""),
    saw_top=maximum_of("saw", unit=""),
    wave_top=maximum_of("wave", unit=""),
    lit_top=maximum_of("lit", unit=""),
    lit_bottom=minimum_of("lit", unit=""),
)


@physics
def initial(p):
    return State(x=p.phase)


@physics
def rhs(s):
    return State(x=1.0)


@physics
def control(s, m):
    relay = where(sin(s.x) > 0.0, 1.0, -1.0)
    return Memory(relay=relay, began=where(relay == m.relay, m.began, s.x))


@physics
def observe(s, m):
    wave = 2.0 * sin(s.x)
    lit = where(wave > 0.0, 1.0, 0.0)
    return Outputs(limited=minimum(wave, 1.0), relay=m.relay, saw=s.x - m.began, wave=wave, lit=lit)


MODEL = model(name="corners", title="Corners and jumps", inputs=Inputs, states=State, outputs=Outputs, metrics=Metrics,
              memory=Memory, clock=FixedStep(step=0.25, until=12.0), initial=initial, rhs=rhs, control=control,
              observe=observe)  # fmt: skip
