"""A stone that falls, and cases that take their worker with them: `trap` kills it, hangs it, eats its memory or exits.

The traps stand where a model's own Python runs, in `prepare`; those named in the environment variable TRAPS_OFF
(their numbers, with commas) do nothing.  STONES_SLEEP_S makes every chunk take so long.
"""

import os
import sys
import time
from collections import namedtuple

import numpy as np

from mc_engine.lanes import physics
from mc_engine.model import Field, FixedStep, Model, Parameter

KILLS, HANGS, EATS, EXITS = 1.0, 2.0, 3.0, 4.0

State = namedtuple("State", "z v")
Parameters = namedtuple("Parameters", "height speed")
Memory = namedtuple("Memory", "unused")
Quantities = namedtuple("Quantities", "height")
Metrics = namedtuple("Metrics", "end_height impact_speed")


def prepare(inputs, settings, refusals):
    if inputs.trap.size > 1:
        time.sleep(float(os.environ.get("STONES_SLEEP_S", "0")))
    off = os.environ.get("TRAPS_OFF", "").split(",")
    armed = {trap for trap in np.unique(inputs.trap) if f"{trap:g}" not in off}
    if KILLS in armed:
        os._exit(9)
    if HANGS in armed:
        time.sleep(1000.0)
    if EATS in armed:
        np.ones(2 * 10**9)
    if EXITS in armed:
        sys.exit()
    return {"height": inputs.height, "speed": inputs.speed}


@physics
def initial(p, o):
    """At its height, with its speed."""
    return State(p.height, p.speed)


@physics
def rhs(t, s, m, p, o):
    """Free fall with a little drag."""
    return State(s.v, -9.81 - 1e-3 * s.v * s.v)


@physics
def observe(t, s, m, p, o):
    """What histories show."""
    return Quantities(s.z)


@physics
def evaluate(t, s, m, p, o, best, when):
    """What a case comes to."""
    return Metrics(s.z, s.v)


MODEL = Model(
    name="traps",
    title="A stone and its traps",
    source="",
    parameters=(
        Parameter("height_m", "m", "height at the start", 100.0),
        Parameter("speed_m_s", "m/s", "speed at the start, upwards", 0.0),
        Parameter("trap", "", "0, or what befalls the worker", 0.0, low=0.0, high=4.0),
    ),
    settings=(),
    states=(Field("z_m", "m", "height"), Field("v_m_s", "m/s", "speed, upwards")),
    quantities=(Field("height_m", "m", "height"),),
    metrics=(Field("end_height_m", "m", "height at the end"), Field("impact_speed_m_s", "m/s", "speed at the end")),
    clock=FixedStep(step=0.1, until=3.0),
    kernel_parameters=Parameters,
    initial=initial,
    rhs=rhs,
    observe=observe,
    evaluate=evaluate,
    prepare=prepare,
)
