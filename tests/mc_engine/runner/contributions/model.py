"""Functions whose Sobol' indices are known in closed form, and noise made in flight, as metrics of a flight."""

from collections import namedtuple

from mc_engine.lanes import physics, sin, sqrt
from mc_engine.lanes.noise import normal_pair
from mc_engine.model import Field, FixedStep, Parameter, inputs, metrics, model, outputs, states

Inputs = inputs(
    **{f"x{k}": Parameter(0.3, f"input {k}", unit="") for k in (1, 2, 3, 4)},
    ticket=Parameter(0.0, "names a draw", unit="", random_draw=True),
)
State = states(x=Field("x", unit=""))
Memory = namedtuple("Memory", "z", defaults=(0.0,))
Outputs = outputs(x=Field("x", unit=""))
METRICS = ("ishigami", "sobol_g", "noise", "line", "raffle", "scaled")
Metrics = metrics(**{name: Field(name, unit="") for name in METRICS})
PI = 3.141592653589793


@physics
def initial():
    return State(x=0.0)


@physics
def rhs():
    return State(x=1.0)


@physics
def control(draws):
    return Memory(z=normal_pair(draws, 0)[0])


@physics
def observe(s):
    return Outputs(x=s.x)


@physics
def bend(u, a):
    v = 4.0 * u - 2.0
    return (sqrt(v * v) + a) / (1.0 + a)


@physics
def evaluate(m, p):
    a, b, c = PI * (2.0 * p.x1 - 1.0), PI * (2.0 * p.x2 - 1.0), PI * (2.0 * p.x3 - 1.0)
    return Metrics(
        ishigami=sin(a) + 7.0 * sin(b) * sin(b) + 0.1 * c * c * c * c * sin(a),
        sobol_g=bend(p.x1, 0.0) * bend(p.x2, 1.0) * bend(p.x3, 4.5) * bend(p.x4, 9.0),
        noise=m.z,
        line=p.x1 + p.x2 + 2.0 * p.x3 + m.z,
        raffle=sin(1e6 * p.ticket),
        scaled=p.x1 * (1.0 + p.ticket),
    )


MODEL = model(
    name="contributions",
    title="Functions with known indices",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=FixedStep(step=1.0, until=2.0),
    initial=initial,
    rhs=rhs,
    memory=Memory,
    control=control,
    observe=observe,
    evaluate=evaluate,
)
