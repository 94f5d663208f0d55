"""A point that moves at a speed out of the model's tables: for tests of numbers that all cases share.  SI."""

import numpy as np

from mc_engine.lanes import look_up, physics, sqrt
from mc_engine.model import Field, FixedStep, Parameter, Setting, inputs, metrics, model, outputs, states

Inputs = inputs(
    place=Parameter(0.0, "where the speed stands in the table", unit=""),
    scale=Setting(1.0, "of the table", unit=""),
    step_s=Setting(0.5, "step"),
)
State = states(x_m="place")
Outputs = outputs(x_m="place")
Metrics = metrics(first=Field("first number of the table", unit=""), last=Field("last number of the table", unit=""))

LENGTH = 50


def tables(o):
    """Squares, times the setting."""
    return o.scale * np.arange(LENGTH, dtype=float) ** 2


@physics
def initial():
    return State(x=0.0)


@physics
def rhs(p, o):
    # below -100 the place is not a number
    return State(x=look_up(o.tables, p.place + 0.0 * sqrt(p.place + 100.0)))


@physics
def observe(s):
    return Outputs(x=s.x)


@physics
def evaluate(o):
    return Metrics(first=look_up(o.tables, 1.0), last=look_up(o.tables, LENGTH - 1.0))


MODEL = model(
    name="shelf",
    title="A point with a speed out of a table",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=FixedStep("step", 1.0),
    initial=initial,
    rhs=rhs,
    tables=tables,
    observe=observe,
    evaluate=evaluate,
)
