"""A bead on a rail with spring, gravity, wall, a gate that opens by the clock, and an end: for tests of events.  SI."""

from collections import namedtuple

from mc_engine.lanes import minimum, physics, where
from mc_engine.model import Event, Field, FixedStep, Model, Parameter, Setting

State = namedtuple("State", "x v")
Memory = namedtuple("Memory", "bounces bounced_at gates gated_at switches")
Parameters = namedtuple("Parameters", "rate gravity x0 v0 wall restitution gate gate_every end last")
Quantities = namedtuple("Quantities", "x")
Events = namedtuple("Events", "wall gate end")
Metrics = namedtuple("Metrics", "bounces bounced_at gates gated_at switches")


@physics
def initial(p, o):
    return State(p.x0, p.v0)


@physics
def start(p, o):
    return Memory(0.0, -1.0, 0.0, -1.0, 0.0)


@physics
def rhs(t, s, m, p, o):
    return State(s.v, -p.gravity - p.rate * p.rate * s.x)


@physics
def events(t, s, m, p, o):
    return Events(s.x - p.wall, t - p.gate - m.gates * p.gate_every, minimum(s.x - p.end, p.last - t))


@physics
def switch(t, s, m, p, o, hit):
    wall, gate = hit.wall > 0.5, hit.gate > 0.5
    # `switches` does not ask what was hit: it counts the calls that concern this case
    memory = Memory(
        m.bounces + hit.wall,
        where(wall, t, m.bounced_at),
        m.gates + hit.gate,
        where(gate, t, m.gated_at),
        m.switches + 1.0,
    )
    return State(s.x, where(wall, -p.restitution * s.v, s.v)), memory


@physics
def observe(t, s, m, p, o):
    return Quantities(s.x)


@physics
def evaluate(t, s, m, p, o, best, when):
    return Metrics(m.bounces, m.bounced_at, m.gates, m.gated_at, m.switches)


MODEL = Model(
    name="rail",
    title="A bead on a rail",
    source="",
    parameters=(
        Parameter("rate_rad_s", "rad/s", "angular frequency of the spring", 0.0),
        Parameter("gravity_m_s2", "m/s^2", "acceleration downwards", 0.0),
        Parameter("x0_m", "m", "first place", 0.0),
        Parameter("v0_m_s", "m/s", "first speed", 0.0),
        Parameter("wall_m", "m", "place of the wall below", -1e9),
        Parameter("restitution", "", "speed after a bounce over the one before", 1.0),
        Parameter("gate_s", "s", "first time of the gate", 1e9),
        Parameter("gate_every_s", "s", "time from one gate to the next", 1e9),
        Parameter("end_m", "m", "place, from above, at which the case ends", -1e9),
        Parameter("last_s", "s", "time at which the case ends", 1e9),
    ),
    settings=(Setting("step_s", "s", "step", 0.1), Setting("until_s", "s", "time limit", 10.0)),
    states=(Field("x_m", "m", "place"), Field("v_m_s", "m/s", "speed")),
    quantities=(Field("x_m", "m", "place"),),
    metrics=(
        Field("bounces", "", "hits of the wall"),
        Field("bounced_at_s", "s", "the last of them"),
        Field("gates", "", "openings of the gate"),
        Field("gated_at_s", "s", "the last of them"),
        Field("switches", "", "calls of switch"),
    ),
    clock=FixedStep("step", "until"),
    kernel_parameters=Parameters,
    initial=initial,
    rhs=rhs,
    start=start,
    events=events,
    switch=switch,
    event_list=(
        Event("wall", "falling", "switch"),
        Event("gate", "either", "switch"),
        Event("end", "falling", "stop"),
    ),
    observe=observe,
    evaluate=evaluate,
)
