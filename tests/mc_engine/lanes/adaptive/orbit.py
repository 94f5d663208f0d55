"""A plane Kepler orbit from (r, 0) with a speed across, with its highest and lowest point."""

from collections import namedtuple

from mc_engine.lanes import physics, sqrt
from mc_engine.model import AdaptiveStep, Extremum, Field, Model, Parameter, Setting

MU = 398600.4418e9
State = namedtuple("State", "x y vx vy")
Parameters = namedtuple("Parameters", "radius speed")
Quantities = namedtuple("Quantities", "radius speed")
Metrics = namedtuple("Metrics", "energy angular_momentum highest highest_time lowest lowest_time")


@physics
def initial(p, o):
    return State(p.radius, 0.0, 0.0, p.speed)


@physics
def rhs(t, s, m, p, o):
    r2 = s.x * s.x + s.y * s.y
    g = -MU / (r2 * sqrt(r2))
    return State(s.vx, s.vy, g * s.x, g * s.y)


@physics
def observe(t, s, m, p, o):
    return Quantities(sqrt(s.x * s.x + s.y * s.y), sqrt(s.vx * s.vx + s.vy * s.vy))


@physics
def evaluate(t, s, m, p, o, best, when):
    energy = 0.5 * (s.vx * s.vx + s.vy * s.vy) - MU / sqrt(s.x * s.x + s.y * s.y)
    return Metrics(energy, s.x * s.vy - s.y * s.vx, best.high, when.high, best.low, when.low)


MODEL = Model(
    name="orbit",
    title="A plane orbit",
    source="",
    parameters=(Parameter("radius_m", "m", "first distance", 7e6), Parameter("speed_m_s", "m/s", "first speed", 8e3)),
    settings=(Setting("tolerance", "", "relative", 1e-12), Setting("duration_s", "s", "of the flight", 86400.0)),
    states=(Field("x_m", "m", "x"), Field("y_m", "m", "y"), Field("vx_m_s", "m/s", "vx"), Field("vy_m_s", "m/s", "vy")),
    quantities=(Field("radius_m", "m", "distance"), Field("speed_m_s", "m/s", "speed")),
    metrics=(
        Field("energy", "", "specific energy, J/kg"),
        Field("angular_momentum", "", "specific, m2/s"),
        Field("highest_m", "m", "largest distance"),
        Field("highest_time_s", "s", "its time"),
        Field("lowest_m", "m", "smallest distance"),
        Field("lowest_time_s", "s", "its time"),
    ),
    clock=AdaptiveStep("duration", "tolerance", (1e-5, 1e-5, 1e-8, 1e-8)),
    kernel_parameters=Parameters,
    initial=initial,
    rhs=rhs,
    observe=observe,
    evaluate=evaluate,
    extrema=(Extremum("high", "radius_m"), Extremum("low", "radius_m", "min")),
)
