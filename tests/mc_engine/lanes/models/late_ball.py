"""A ball that falls, is braked late, and stops late: for tests of delayed events.  SI."""

from collections import namedtuple

from mc_engine.lanes import physics, where
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
    time_of,
    value_at,
)

Inputs = inputs(
    height_m=Parameter(100.0, "first height"),
    mark_m=Parameter(55.0, "height of the mark"),
    second_m=Parameter(-9.0, "height at which the second phase begins"),
    floor_m=Parameter(0.0, "height of the ground"),
    lag_s=Parameter(0.5, "time from the mark to the brake"),
)
State = states(h_m="height", v_m_s="speed upwards")
Outputs = outputs(height_m="height", speed_m_s="speed", braked_s="time of the brake",
                  braked_from=Field("number of the phase in which the brake came", unit=""))  # fmt: skip
Metrics = metrics(
    passed_s=time_of("mark", "time of the mark", sometimes=True),
    height_there_m=value_at("mark", "height_m", "height of the mark", sometimes=True),
    second_s=time_of("second", "time of the second phase", sometimes=True),
    ground_s=time_of("ground", "time of the ground"),
    braked_s=at_end("braked_s", "time of the brake"),
    braked_from=at_end("braked_from", "phase in which the brake came", unit=""),
    speed_m_s=at_end("speed_m_s", "speed at the end"),
)
Memory = namedtuple("Memory", "braked braked_from", defaults=(-1.0, -1.0))


@physics
def initial(p):
    return State(h=p.height, v=0.0)


@physics
def fall(s):
    return State(h=s.v, v=-10.0)


@physics
def glide(s):
    return State(h=s.v, v=0.0 * s.v)


@physics
def above_mark(s, p):
    return s.h - p.mark


@physics
def above_second(s, p):
    return s.h - p.second


@physics
def above_ground(s, p):
    return s.h - p.floor


@physics
def switch(t, s, m, hit, phase):
    braking = hit.mark > 0.5  # where the mark is only passed, this is not called
    return s, Memory(braked=where(braking, t, m.braked), braked_from=where(braking, phase.second, m.braked_from))


@physics
def observe(s, m):
    return Outputs(height=s.h, speed=-s.v, braked=m.braked, braked_from=m.braked_from)


MARK = {"mark": Event(above_mark, "falling", to="braked", after="lag")}
GROUND = {"ground": Event(above_ground, "falling", "stop", after=0.125)}
SECOND = {"second": Event(above_second, "falling", to="second")}
MODEL = model(
    name="late_ball", title="A ball that is braked late", inputs=Inputs, states=State, outputs=Outputs, metrics=Metrics,
    memory=Memory, clock=AdaptiveStep(until=100.0, rtol=1e-12), initial=initial, observe=observe, switch=switch,
    phases={
        "falling": Phase(fall, events={**MARK, **SECOND, **GROUND}),
        "second": Phase(fall, events={**MARK, **GROUND}),
        "braked": Phase(glide, events=GROUND),
    },
)  # fmt: skip
