"""A plane Kepler orbit from (r, 0) with a speed across, with its highest and lowest point."""

from mc_engine.lanes import physics, sqrt
from mc_engine.model import (
    AdaptiveStep,
    Field,
    Parameter,
    Setting,
    inputs,
    maximum_of,
    metrics,
    minimum_of,
    model,
    outputs,
    states,
    time_of_maximum,
    time_of_minimum,
)

MU = 398600.4418e9
Inputs = inputs(
    radius_m=Parameter(7e6, "first distance"),
    speed_m_s=Parameter(8e3, "first speed"),
    tolerance=Setting(1e-12, "relative", unit=""),
    duration_s=Setting(86400.0, "of the flight"),
)
State = states(x_m="x", y_m="y", vx_m_s="vx", vy_m_s="vy")
Outputs = outputs(radius_m="distance", speed_m_s="speed")
Metrics = metrics(
    energy=Field("specific energy, J/kg", unit=""),
    angular_momentum=Field("specific, m2/s", unit=""),
    highest_m=maximum_of("radius_m", "largest distance"),
    highest_time_s=time_of_maximum("radius_m", "its time"),
    lowest_m=minimum_of("radius_m", "smallest distance"),
    lowest_time_s=time_of_minimum("radius_m", "its time"),
)


@physics
def initial(p):
    return State(x=p.radius, y=0.0, vx=0.0, vy=p.speed)


@physics
def rhs(s):
    r2 = s.x * s.x + s.y * s.y
    g = -MU / (r2 * sqrt(r2))
    return State(x=s.vx, y=s.vy, vx=g * s.x, vy=g * s.y)


@physics
def observe(s):
    return Outputs(radius=sqrt(s.x * s.x + s.y * s.y), speed=sqrt(s.vx * s.vx + s.vy * s.vy))


@physics
def evaluate(s):
    energy = 0.5 * (s.vx * s.vx + s.vy * s.vy) - MU / sqrt(s.x * s.x + s.y * s.y)
    return Metrics(energy=energy, angular_momentum=s.x * s.vy - s.y * s.vx)


MODEL = model(
    name="orbit",
    title="A plane orbit",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=AdaptiveStep("duration", "tolerance", (1e-5, 1e-5, 1e-8, 1e-8)),
    initial=initial,
    rhs=rhs,
    observe=observe,
    evaluate=evaluate,
)
