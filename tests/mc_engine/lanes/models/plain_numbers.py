"""A falling stone whose physics hands back plain numbers, in one branch or in all, wherever physics hands numbers back.

`style` chooses the branches: 0 gives lanes, 1 records of both kinds, 2 mostly plain numbers, 3 a plain derivative.
"""

from collections import namedtuple

from mc_engine.lanes import maximum, physics, where
from mc_engine.model import Event, Field, FixedStep, Model, Parameter, Setting

State = namedtuple("State", "x v")
Memory = namedtuple("Memory", "force count last")
Events = namedtuple("Events", "ground apex")
Quantities = namedtuple("Quantities", "height speed")
Metrics = namedtuple("Metrics", "time height flag")
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
def initial(p, o):
    return State(10.0, 0.0)


@physics
def start(p, o):
    return Memory(0.0, 0.0, 0.0)


@physics
def control(t, s, m, p, o, draws):
    if o.style > 1.5:
        return Memory(0.0, m.count + 1.0, t)
    elif o.style > 0.5:
        force = 0.0
    else:
        force = -0.1 * s.v
    return Memory(force, m.count + 1.0, 1.0)


@physics
def rhs(t, s, m, p, o):
    if o.style > 2.5:
        return State(0.0, -1.0)
    side = 0.0
    if o.style > 0.5:
        side = s.v * 0.001
    first, second = pair(s, o)
    w = pull(s, o)
    return State(s.v, w.down + p.lift + m.force + side * w.side + 1e-4 * (first + second) + 1e-6 * summed(s))


@physics
def events(t, s, m, p, o):
    if o.style > 1.5:
        return Events(s.x, 1.0)
    return Events(s.x, s.v + 5.0)


@physics
def switch(t, s, m, p, o, hit):
    if o.style > 1.5:
        return State(s.x, 0.0), Memory(0.0, 0.0, 0.0)
    return State(s.x, where(hit.apex > 0.5, -4.0, s.v)), m


@physics
def observe(t, s, m, p, o):
    return Quantities(s.x, 0.0) if o.style > 1.5 else Quantities(s.x, s.v)


@physics
def evaluate(t, s, m, p, o, best, when):
    flag = where(o.style > 0.5, 1.0, 2.0)
    if o.style > 1.5:
        return Metrics(t, 0.0, flag)
    return Metrics(t, s.x, where(s.v > 0.0, 1.0, 0.0))


MODEL = Model(
    name="plain_numbers",
    title="A stone of plain numbers",
    source="",
    parameters=(Parameter("lift_m_s2", "m/s^2", "acceleration upwards", 0.0),),
    settings=(Setting("style", "", "which branches are taken", 0.0),),
    states=(Field("x_m", "m", "height"), Field("v_m_s", "m/s", "speed")),
    quantities=(Field("height_m", "m", "height"), Field("speed_m_s", "m/s", "speed")),
    metrics=(Field("time_s", "s", "time"), Field("height_m", "m", "height"), Field("flag", "", "kind of end")),
    clock=FixedStep(0.1, 20.0, control_every=5),
    kernel_parameters=namedtuple("Parameters", "lift"),
    initial=initial,
    rhs=rhs,
    observe=observe,
    evaluate=evaluate,
    start=start,
    control=control,
    events=events,
    switch=switch,
    event_list=(Event("ground"), Event("apex", action="switch")),
)
