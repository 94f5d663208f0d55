"""A falling stone whose physics hands back plain numbers, in one branch or in all, wherever physics hands numbers back.

`style` chooses the branches: 0 gives lanes, 1 records of both kinds, 2 mostly plain numbers, 3 a plain derivative.
"""

from collections import namedtuple

from mc_engine.lanes import maximum, physics, where
from mc_engine.model import Event, Field, FixedStep, Parameter, Setting, inputs, metrics, model, outputs, states

Inputs = inputs(
    lift_m_s2=Parameter(0.0, "acceleration upwards"), style=Setting(0.0, "which branches are taken", unit="")
)
State = states(x_m="height", v_m_s="speed")
Memory = namedtuple("Memory", "force count last")
Outputs = outputs(height_m="height", speed_m_s="speed")
Metrics = metrics(time_s="time", height_m="height", flag=Field("kind of end", unit=""))
Pull = namedtuple("Pull", "down side")


@physics
def pull(s, o):  # a record, of a helper
    if o.style > 1.5:
        return Pull(-9.0, 0.0)
    if o.style > 0.5:
        return Pull(-9.0 - 0.01 * s.v, 0.0)
    return Pull(-9.0 - 0.01 * s.v, 0.1 * s.v)


@physics
def pair(s, o):  # a plain tuple, of a helper
    if o.style > 1.5:
        return 1.0, s.x
    return s.v, 2.0


@physics
def summed(s):  # numbers and records that a loop begins with
    best, total = 0.0, 0
    memory = Memory(0.0, 0.0, 0.0)
    for i in range(3):
        best = maximum(best, s.v * float(i))
        total = total + s.x
        memory = Memory(memory.force + s.x, 0.0, memory.last)
    return best + total + memory.force


@physics
def initial():
    return State(x=10.0, v=0.0)


@physics
def start():
    return Memory(force=0.0, count=0.0, last=0.0)


@physics
def control(t, s, m, o):
    if o.style > 1.5:
        return Memory(force=0.0, count=m.count + 1.0, last=t)
    elif o.style > 0.5:
        force = 0.0
    else:
        force = -0.1 * s.v
    return Memory(force=force, count=m.count + 1.0, last=1.0)


@physics
def rhs(s, m, p, o):
    if o.style > 2.5:
        return State(x=0.0, v=-1.0)
    side = 0.0
    if o.style > 0.5:
        side = s.v * 0.001
    first, second = pair(s, o)
    w = pull(s, o)
    return State(
        x=s.v, v=w.down + p.lift + m.force + side * w.side + 1e-4 * (first + second) + 1e-6 * summed(s)
    )  # fmt: skip


@physics
def height(s):
    return s.x


@physics
def apex(s, o):
    if o.style > 1.5:
        return 1.0
    return s.v + 5.0


@physics
def switch(s, m, o, hit):
    if o.style > 1.5:
        return State(x=s.x, v=0.0), Memory(force=0.0, count=0.0, last=0.0)
    return State(x=s.x, v=where(hit.apex > 0.5, -4.0, s.v)), m


@physics
def observe(s, o):
    return Outputs(height=s.x, speed=0.0) if o.style > 1.5 else Outputs(height=s.x, speed=s.v)


@physics
def evaluate(t, s, o):
    flag = where(o.style > 0.5, 1.0, 2.0)
    if o.style > 1.5:
        return Metrics(time=t, height=0.0, flag=flag)
    return Metrics(time=t, height=s.x, flag=where(s.v > 0.0, 1.0, 0.0))


MODEL = model(
    name="plain_numbers",
    title="A stone of plain numbers",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=FixedStep(0.1, 20.0, control_every=5),
    initial=initial,
    rhs=rhs,
    observe=observe,
    evaluate=evaluate,
    start=start,
    control=control,
    events={"ground": Event(height), "apex": Event(apex, action="switch")},
    switch=switch,
)
