"""Functions whose Sobol' indices are known in closed form, and noise made in flight, as metrics of a flight."""

from collections import namedtuple

from mc_engine.lanes import physics, sin, sqrt
from mc_engine.lanes.noise import normal_pair
from mc_engine.model import Field, FixedStep, Model, Parameter

State = namedtuple("State", "x")
Memory = namedtuple("Memory", "z")
Parameters = namedtuple("Parameters", "x1 x2 x3 x4 ticket")
Quantities = namedtuple("Quantities", "x")
Metrics = namedtuple("Metrics", "ishigami sobol_g noise line raffle")
PI = 3.141592653589793


@physics
def initial(p, o):
    return State(0.0)


@physics
def rhs(t, s, m, p, o):
    return State(1.0)


@physics
def start(p, o):
    return Memory(0.0)


@physics
def control(t, s, m, p, o, draws):
    return Memory(normal_pair(draws, 0)[0])


@physics
def observe(t, s, m, p, o):
    return Quantities(s.x)


@physics
def bend(u, a):
    v = 4.0 * u - 2.0
    return (sqrt(v * v) + a) / (1.0 + a)


@physics
def evaluate(t, s, m, p, o, best, when):
    a, b, c = PI * (2.0 * p.x1 - 1.0), PI * (2.0 * p.x2 - 1.0), PI * (2.0 * p.x3 - 1.0)
    ishigami = sin(a) + 7.0 * sin(b) * sin(b) + 0.1 * c * c * c * c * sin(a)
    sobol_g = bend(p.x1, 0.0) * bend(p.x2, 1.0) * bend(p.x3, 4.5) * bend(p.x4, 9.0)
    scrambled = sin(1e6 * p.ticket)
    return Metrics(ishigami, sobol_g, m.z, p.x1 + p.x2 + 2.0 * p.x3 + m.z, scrambled)


MODEL = Model(
    name="contributions",
    title="Functions with known indices",
    source="",
    parameters=(
        *(Parameter(f"x{k}", "", f"input {k}", 0.3) for k in (1, 2, 3, 4)),
        Parameter("ticket", "", "names a draw", 0.0, random_draw=True),
    ),
    settings=(),
    states=(Field("x", "", "x"),),
    quantities=(Field("x", "", "x"),),
    metrics=tuple(Field(name, "", name) for name in Metrics._fields),
    clock=FixedStep(step=1.0, until=2.0),
    kernel_parameters=Parameters,
    initial=initial,
    rhs=rhs,
    start=start,
    control=control,
    observe=observe,
    evaluate=evaluate,
)
