"""A stone that falls, and cases that take their worker with them: `trap` kills it, hangs it, eats its memory or exits.

The traps stand where a model's own Python runs, in `prepare`; those named in the environment variable TRAPS_OFF
(their numbers, with commas) do nothing.  NOMINAL_TRAP is the trap of the nominal case, where it flies as a task; what
the engine asks of `prepare` before a run begins, it answers.  STONES_SLEEP_S makes every chunk take so long; the first
that sleeps makes the file STONES_ASLEEP.
"""

import os
import sys
import time
import traceback
from collections import namedtuple
from pathlib import Path

import numpy as np

from mc_engine.lanes import physics
from mc_engine.model import FixedStep, Parameter, at_end, inputs, metrics, model, outputs, states

HISTORIES = 3  # of the nominal case and two more, which are flown together and are no chunk
KILLS, HANGS, EATS, EXITS = 1.0, 2.0, 3.0, 4.0

Inputs = inputs(
    height_m=Parameter(100.0, "height at the start"),
    speed_m_s=Parameter(0.0, "speed at the start, upwards"),
    trap=Parameter(0.0, "0, or what befalls the worker", low=0.0, high=4.0, unit=""),
)
State = states(z_m="height", v_m_s="speed, upwards")
Outputs = outputs(height_m="height")
Metrics = metrics(end_height_m=at_end("height_m", "height at the end"), impact_speed_m_s="speed at the end")
Parameters = namedtuple("Parameters", "height speed")


def prepare(inputs, settings, refusals):
    if inputs.trap.size > HISTORIES:
        if asleep := os.environ.get("STONES_ASLEEP"):
            Path(asleep).touch()
        time.sleep(float(os.environ.get("STONES_SLEEP_S", "0")))
    off = os.environ.get("TRAPS_OFF", "").split(",")
    traps = {*np.unique(inputs.trap)}
    if inputs.trap.size == 1 and "run_task" in [frame.f_code.co_name for frame, _ in traceback.walk_stack(None)]:
        traps.add(float(os.environ.get("NOMINAL_TRAP", "0")))
    armed = {trap for trap in traps if f"{trap:g}" not in off}
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
def initial(p):
    """At its height, with its speed."""
    return State(z=p.height, v=p.speed)


@physics
def rhs(s):
    """Free fall with a little drag."""
    return State(z=s.v, v=-9.81 - 1e-3 * s.v * s.v)


@physics
def observe(s):
    """What histories show."""
    return Outputs(height=s.z)


@physics
def evaluate(s):
    """What a case comes to, besides its height."""
    return Metrics(impact_speed=s.v)


MODEL = model(
    name="traps",
    title="A stone and its traps",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=FixedStep(step=0.1, until=3.0),
    kernel_parameters=Parameters,
    initial=initial,
    rhs=rhs,
    observe=observe,
    evaluate=evaluate,
    prepare=prepare,
)
