"""A point that flies one leg of a table after another: the discrete state holds the record of the leg.  SI."""

from collections import namedtuple

import numpy as np

from mc_engine.lanes import look_up_record, minimum, physics, where
from mc_engine.model import Event, FixedStep, Parameter, Setting, at_end, inputs, metrics, model, outputs, states

Leg = namedtuple("Leg", "speed duration")
Memory = namedtuple("Memory", "leg number until")
LEGS = (Leg(speed=1.0, duration=2.0), Leg(speed=-3.0, duration=1.0), Leg(speed=0.5, duration=40.0))
NUMBERS = len(Leg._fields)

Inputs = inputs(delay_s=Parameter(0.0, "that the first leg is longer"), scale=Setting(1.0, "of the table", unit=""))
State = states(x_m="place")
Outputs = outputs(x_m="place", speed_m_s="speed")
Metrics = metrics(last_x_m=at_end("x_m", "place"), last_speed_m_s=at_end("speed_m_s", "speed"), legs_flown_m="legs")


def tables(o):
    """The legs one after another."""
    return o.scale * np.concatenate(LEGS)


@physics
def leg_of(number, o):
    return look_up_record(o.tables, NUMBERS * number, Leg)


@physics
def initial():
    return State(x=0.0)


@physics
def start(p, o):
    first = look_up_record(o.tables, 0, Leg)
    return Memory(leg=first, number=0.0, until=first.duration + p.delay)


@physics
def rhs(m):
    return State(x=m.leg.speed)


@physics
def over(t, m):
    return t - m.until


@physics
def switch(t, s, m, o):
    number = minimum(m.number + 1.0, len(LEGS) - 1.0)
    leg = leg_of(number, o)
    return s, Memory(leg=Leg(speed=leg.speed, duration=leg.duration), number=number, until=t + leg.duration)


@physics
def observe(s, m):
    return Outputs(x=s.x, speed=m.leg.speed)


@physics
def evaluate(m):
    return Metrics(legs_flown=where(m.number > 0.0, m.number, 0.0))


MODEL = model(
    name="legs", title="A point that flies legs", inputs=Inputs, states=State, outputs=Outputs, metrics=Metrics,
    clock=FixedStep(0.5, 10.0), initial=initial, start=start, rhs=rhs, observe=observe, evaluate=evaluate,
    events={"over": Event(over, "rising", "switch")}, switch=switch, tables=tables,
)  # fmt: skip
