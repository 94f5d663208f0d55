"""A sine wave and the crossings of a level: counted, timed, and with ways to break.

x'' = -omega^2 x from (0, omega): x = sin(omega t).  `ill` makes a case fail: 1 takes the root of a negative
number from t = 1 s on, 2 blows up soon after, 3 turns so fast that the steps are used up.
"""

from collections import namedtuple

from mc_engine.lanes import physics, sqrt, where
from mc_engine.lanes.noise import normal_pair
from mc_engine.model import (
    AdaptiveStep,
    Event,
    Field,
    Parameter,
    Setting,
    inputs,
    last_above,
    maximum_of,
    metrics,
    model,
    outputs,
    states,
    time_of_maximum,
)

Inputs = inputs(
    omega_rad_s=Parameter(1.0, "frequency"),
    level_m=Parameter(0.5, "level"),
    stop_s=Parameter(50.0, "end"),
    noise_m_s2=Parameter(0.0, "push per sample"),
    ill=Parameter(0.0, "how the case breaks", unit=""),
    tolerance=Setting(1e-10, "relative", unit=""),
)
State = states(x_m="height", v_m_s="speed")
Memory = namedtuple("Memory", "rises falls rise_time push", defaults=(0.0, 0.0, 0.0, 0.0))
Outputs = outputs(height_m="height", above_m="height over the level")
Metrics = metrics(
    rises=Field("rising crossings", unit=""),
    falls=Field("falling crossings", unit=""),
    rise_time_s="the last rising crossing",
    top_m=maximum_of("height_m", "largest height"),
    top_time_s=time_of_maximum("height_m", "its time"),
    last_above_s=last_above("above_m", 0.0, "last time above the level"),
    push_m_s2="last push",
)


@physics
def initial(p):
    return State(x=0.0, v=p.omega)


@physics
def control(m, p, draws):
    n, _ = normal_pair(draws, 0)
    return Memory(rises=m.rises, falls=m.falls, rise_time=m.rise_time, push=p.noise * n)


@physics
def rhs(t, s, m, p):
    sick = where(t > 1.0, 1.0, 0.0)
    broken = where((p.ill == 1.0) & (t > 1.0), sqrt(-1.0 - 0.0 * t), 0.0)
    burst = where(p.ill == 2.0, sick * 10.0 * (1.0 + s.v**4), 0.0)
    fast = where(p.ill == 3.0, 1e7, 1.0)
    w = p.omega * fast
    return State(x=s.v * fast, v=-w * w / fast * s.x + m.push + broken + burst)


@physics
def above(s, p):
    return s.x - p.level


@physics
def after_stop(t, p):
    return t - p.stop


@physics
def switch(t, s, m, hit):
    rise_time = where(hit.rise > 0.5, t, m.rise_time)
    return s, Memory(rises=m.rises + hit.rise, falls=m.falls + hit.fall, rise_time=rise_time, push=m.push)


@physics
def observe(s, p):
    return Outputs(height=s.x, above=s.x - p.level)


@physics
def evaluate(m):
    return Metrics(rises=m.rises, falls=m.falls, rise_time=m.rise_time, push=m.push)


MODEL = model(
    name="wave",
    title="A wave and a level",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=AdaptiveStep(100.0, "tolerance", 1e-10, control_period=7.0, attempts=3000),
    initial=initial,
    memory=Memory,
    control=control,
    rhs=rhs,
    events={
        "rise": Event(above, "rising", "switch"),
        "fall": Event(above, "falling", "switch"),
        "end": Event(after_stop, "rising", "stop"),
    },
    switch=switch,
    observe=observe,
    evaluate=evaluate,
)
