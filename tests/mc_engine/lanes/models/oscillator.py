"""A mass on a spring with sampled control, noise and a way to break: for tests of the loop.  SI."""

from collections import namedtuple

from mc_engine.lanes import physics, sqrt
from mc_engine.lanes.noise import normal_pair
from mc_engine.model import Extremum, Field, FixedStep, Model, Parameter, Setting

State = namedtuple("State", "x v")
Memory = namedtuple("Memory", "push samples sampled_at")
Parameters = namedtuple("Parameters", "rate x0 v0 gain noise breaks_at")
Quantities = namedtuple("Quantities", "x v energy")
Metrics = namedtuple(
    "Metrics", "top top_time bottom bottom_time sampled_top sampled_top_time late_time samples sampled_at"
)


@physics
def initial(p, o):
    return State(p.x0, p.v0)


@physics
def start(p, o):
    return Memory(0.0, 0.0, -1.0)


@physics
def control(t, s, m, p, o, draws):
    n, _ = normal_pair(draws, 0)
    return Memory(p.noise * n - p.gain * s.v, m.samples + 1.0, t)


@physics
def rhs(t, s, m, p, o):
    # a root below zero is not a number: that is how a case breaks
    return State(s.v, m.push - p.rate * p.rate * s.x + 0.0 * sqrt(p.breaks_at - t))


@physics
def observe(t, s, m, p, o):
    return Quantities(s.x, s.v, 0.5 * (s.v * s.v + p.rate * p.rate * (s.x * s.x)))


@physics
def evaluate(t, s, m, p, o, best, when):
    return Metrics(
        best.top,
        when.top,
        best.bottom,
        when.bottom,
        best.sampled_top,
        when.sampled_top,
        when.late,
        m.samples,
        m.sampled_at,
    )


MODEL = Model(
    name="oscillator",
    title="A mass on a spring",
    source="",
    parameters=(
        Parameter("rate_rad_s", "rad/s", "angular frequency", 1.0),
        Parameter("x0_km", "km", "first place", 1.0),
        Parameter("v0_m_s", "m/s", "first speed", 0.0),
        Parameter("gain_1_s", "1/s", "gain of the sampled damping", 0.0),
        Parameter("noise_m_s2", "m/s^2", "1-sigma of the sampled push", 0.0, low=0.0),
        Parameter("breaks_at_s", "s", "time after which the motion is not a number", 1e9),
    ),
    settings=(
        Setting("step_s", "s", "step", 0.1),
        Setting("until_s", "s", "end", 10.0),
        Setting("every", "", "steps from one sample to the next", 1.0),
    ),
    states=(Field("x_km", "km", "place"), Field("v_m_s", "m/s", "speed")),
    quantities=(Field("x_km", "km", "place"), Field("v_m_s", "m/s", "speed"), Field("energy", "", "energy per mass")),
    metrics=(
        Field("top_km", "km", "largest x"),
        Field("top_time_s", "s", "when"),
        Field("bottom_km", "km", "smallest x"),
        Field("bottom_time_s", "s", "when"),
        Field("sampled_top_km", "km", "largest x at a step"),
        Field("sampled_top_time_s", "s", "when"),
        Field("late_time_s", "s", "last time with x above 500 m"),
        Field("samples", "", "samples of the control"),
        Field("sampled_at_s", "s", "last of them"),
    ),
    clock=FixedStep("step", "until", "every"),
    kernel_parameters=Parameters,
    initial=initial,
    rhs=rhs,
    start=start,
    control=control,
    observe=observe,
    evaluate=evaluate,
    extrema=(
        Extremum("top", "x_km"),
        Extremum("late", "x_km", "last_above", 500.0),
        Extremum("bottom", "x_km", "min"),
        Extremum("sampled_top", "x_km", smooth=False),
    ),
)
