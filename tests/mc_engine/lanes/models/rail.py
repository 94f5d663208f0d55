"""A bead on a rail with spring, gravity, wall, a gate that opens by the clock, and an end: for tests of events.  SI."""

from collections import namedtuple

from mc_engine.lanes import minimum, physics, where
from mc_engine.model import Event, Field, FixedStep, Parameter, Setting, inputs, metrics, model, outputs, states

Inputs = inputs(
    rate_rad_s=Parameter(0.0, "angular frequency of the spring"),
    damping_1_s=Parameter(0.0, "friction over mass and speed", unit="1/s"),
    gravity_m_s2=Parameter(0.0, "acceleration downwards"),
    x0_m=Parameter(0.0, "first place"),
    v0_m_s=Parameter(0.0, "first speed"),
    wall_m=Parameter(-1e9, "place of the wall below"),
    restitution=Parameter(1.0, "speed after a bounce over the one before", unit=""),
    gate_s=Parameter(1e9, "first time of the gate"),
    gate_every_s=Parameter(1e9, "time from one gate to the next"),
    end_m=Parameter(-1e9, "place, from above, at which the case ends"),
    last_s=Parameter(1e9, "time at which the case ends"),
    step_s=Setting(0.1, "step"),
    until_s=Setting(10.0, "time limit"),
)
State = states(x_m="place", v_m_s="speed")
Memory = namedtuple("Memory", "bounces bounced_at gates gated_at switches", defaults=(0.0, -1.0, 0.0, -1.0, 0.0))
Outputs = outputs(x_m="place")
Metrics = metrics(
    bounces=Field("hits of the wall", unit=""),
    bounced_at_s="the last of them",
    gates=Field("openings of the gate", unit=""),
    gated_at_s="the last of them",
    switches=Field("calls of switch", unit=""),
)


@physics
def initial(p):
    return State(x=p.x0, v=p.v0)


@physics
def rhs(s, p):
    return State(x=s.v, v=-p.gravity - p.rate * p.rate * s.x - p.damping * s.v)


@physics
def above_wall(s, p):
    return s.x - p.wall


@physics
def since_gate(t, m, p):
    return t - p.gate - m.gates * p.gate_every


@physics
def before_end(t, s, p):
    return minimum(s.x - p.end, p.last - t)


@physics
def switch(t, s, m, p, hit):
    wall, gate = hit.wall > 0.5, hit.gate > 0.5
    # `switches` does not ask what was hit: it counts the calls that concern this case
    memory = Memory(
        bounces=m.bounces + hit.wall,
        bounced_at=where(wall, t, m.bounced_at),
        gates=m.gates + hit.gate,
        gated_at=where(gate, t, m.gated_at),
        switches=m.switches + 1.0,
    )
    return State(x=s.x, v=where(wall, -p.restitution * s.v, s.v)), memory


@physics
def observe(s):
    return Outputs(x=s.x)


@physics
def evaluate(m):
    return Metrics(bounces=m.bounces, bounced_at=m.bounced_at, gates=m.gates, gated_at=m.gated_at, switches=m.switches)


MODEL = model(
    name="rail",
    title="A bead on a rail",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=FixedStep("step", "until"),
    initial=initial,
    rhs=rhs,
    memory=Memory,
    events={
        "wall": Event(above_wall, "falling", "switch"),
        "gate": Event(since_gate, "either", "switch"),
        "end": Event(before_end, "falling", "stop"),
    },
    switch=switch,
    observe=observe,
    evaluate=evaluate,
)
