"""A point that moves at a speed out of the model's tables: for tests of numbers that all cases share.  SI."""

from collections import namedtuple

import numpy as np

from mc_engine.lanes import look_up, physics, sqrt
from mc_engine.model import Field, FixedStep, Model, Parameter, Setting

State = namedtuple("State", "x")
Parameters = namedtuple("Parameters", "place")
Quantities = namedtuple("Quantities", "x")
Metrics = namedtuple("Metrics", "first last")

LENGTH = 50


def tables(o):
    """Squares, times the setting."""
    return o.scale * np.arange(LENGTH, dtype=float) ** 2


@physics
def initial(p, o):
    return State(0.0 * p.place)


@physics
def rhs(t, s, m, p, o):
    return State(look_up(o.tables, p.place + 0.0 * sqrt(p.place + 100.0)))  # below -100 the place is not a number


@physics
def observe(t, s, m, p, o):
    return Quantities(s.x)


@physics
def evaluate(t, s, m, p, o, best, when):
    return Metrics(look_up(o.tables, 1.0), look_up(o.tables, LENGTH - 1.0))


MODEL = Model(
    name="shelf",
    title="A point with a speed out of a table",
    source="",
    parameters=(Parameter("place", "", "where the speed stands in the table", 0.0),),
    settings=(Setting("scale", "", "of the table", 1.0), Setting("step_s", "s", "step", 0.5)),
    states=(Field("x_m", "m", "place"),),
    quantities=(Field("x_m", "m", "place"),),
    metrics=(Field("first", "", "second number of the table"), Field("last", "", "last number of the table")),
    clock=FixedStep("step", 1.0),
    kernel_parameters=Parameters,
    initial=initial,
    rhs=rhs,
    tables=tables,
    observe=observe,
    evaluate=evaluate,
)
