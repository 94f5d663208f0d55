"""A sine wave and the crossings of a level: counted, timed, and with ways to break.

x'' = -omega^2 x from (0, omega): x = sin(omega t).  `ill` makes a case fail: 1 takes the root of a negative
number from t = 1 s on, 2 blows up soon after, 3 turns so fast that the steps are used up.
"""

from collections import namedtuple

from mc_engine.lanes import physics, sqrt, where
from mc_engine.lanes.noise import normal_pair
from mc_engine.model import AdaptiveStep, Event, Extremum, Field, Model, Parameter, Setting

State = namedtuple("State", "x v")
Memory = namedtuple("Memory", "rises falls rise_time push")
Parameters = namedtuple("Parameters", "omega level stop noise ill")
Events = namedtuple("Events", "rise fall end")
Quantities = namedtuple("Quantities", "height above")
Metrics = namedtuple("Metrics", "rises falls rise_time top top_time last_above push")


@physics
def initial(p, o):
    return State(0.0 * p.omega, p.omega)


@physics
def start(p, o):
    return Memory(0.0, 0.0, 0.0, 0.0)


@physics
def control(t, s, m, p, o, draws):
    n, _ = normal_pair(draws, 0)
    return Memory(m.rises, m.falls, m.rise_time, p.noise * n)


@physics
def rhs(t, s, m, p, o):
    sick = where(t > 1.0, 1.0, 0.0)
    broken = where((p.ill == 1.0) & (t > 1.0), sqrt(-1.0 - 0.0 * t), 0.0)
    burst = where(p.ill == 2.0, sick * 10.0 * (1.0 + s.v**4), 0.0)
    fast = where(p.ill == 3.0, 1e7, 1.0)
    w = p.omega * fast
    return State(s.v * fast, -w * w / fast * s.x + m.push + broken + burst)


@physics
def events(t, s, m, p, o):
    return Events(s.x - p.level, s.x - p.level, t - p.stop)


@physics
def switch(t, s, m, p, o, hit):
    rises = m.rises + hit.rise
    return s, Memory(rises, m.falls + hit.fall, where(hit.rise > 0.5, t, m.rise_time), m.push)


@physics
def observe(t, s, m, p, o):
    return Quantities(s.x, s.x - p.level)


@physics
def evaluate(t, s, m, p, o, best, when):
    return Metrics(m.rises, m.falls, m.rise_time, best.top, when.top, when.above, m.push)


MODEL = Model(
    name="wave",
    title="A wave and a level",
    source="",
    parameters=(
        Parameter("omega_rad_s", "rad/s", "frequency", 1.0),
        Parameter("level_m", "m", "level", 0.5),
        Parameter("stop_s", "s", "end", 50.0),
        Parameter("noise_m_s2", "m/s^2", "push per sample", 0.0),
        Parameter("ill", "", "how the case breaks", 0.0),
    ),
    settings=(Setting("tolerance", "", "relative", 1e-10),),
    states=(Field("x_m", "m", "height"), Field("v_m_s", "m/s", "speed")),
    quantities=(Field("height_m", "m", "height"), Field("above_m", "m", "height over the level")),
    metrics=(
        Field("rises", "", "rising crossings"),
        Field("falls", "", "falling crossings"),
        Field("rise_time_s", "s", "the last rising crossing"),
        Field("top_m", "m", "largest height"),
        Field("top_time_s", "s", "its time"),
        Field("last_above_s", "s", "last time above the level"),
        Field("push_m_s2", "m/s^2", "last push"),
    ),
    clock=AdaptiveStep(100.0, "tolerance", 1e-10, control_period=7.0, attempts=3000),
    kernel_parameters=Parameters,
    initial=initial,
    start=start,
    control=control,
    rhs=rhs,
    events=events,
    switch=switch,
    event_list=(Event("rise", "rising", "switch"), Event("fall", "falling", "switch"), Event("end", "rising", "stop")),
    observe=observe,
    evaluate=evaluate,
    extrema=(Extremum("top", "height_m"), Extremum("above", "above_m", "last_above")),
)
