"""One low orbit with J2: six errors of the first state, spread over an orbit.  SI."""

from mc_engine.lanes import physics, sqrt
from mc_engine.model import (
    AdaptiveStep,
    Parameter,
    Setting,
    inputs,
    maximum_of,
    metrics,
    minimum_of,
    model,
    outputs,
    states,
)
from mc_engine.physics.constants import MU_EARTH
from mc_engine.physics.gravity import oblate

AXES = ("x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s")
RADIUS = 7000e3
SPEED = (MU_EARTH / RADIUS) ** 0.5

Inputs = inputs(
    **{f"d{axis}": Parameter(0.0, f"error of the first {axis.partition('_')[0]}") for axis in AXES},
    duration_s=Setting(5400.0, "length of the flight", low=1.0),
    tolerance=Setting(1e-10, "error of a step, relative", low=1e-15, high=1e-3, unit=""),
)
State = states(**{axis: f"inertial {axis.partition('_')[0]}" for axis in AXES})
Outputs = outputs(radius_m="distance from the Earth's centre")
Metrics = metrics(
    position_error_m="distance from the first place of the errorless orbit",
    lowest_radius_m=minimum_of("radius_m", "least distance from the Earth's centre"),
    highest_radius_m=maximum_of("radius_m", "largest distance from the Earth's centre"),
)


@physics
def initial(p):
    """A circular orbit of 60 degrees, and its errors."""
    vy, vz = 0.5 * SPEED + p.dvy, 0.8660254037844386 * SPEED + p.dvz
    return State(x=RADIUS + p.dx, y=p.dy, z=p.dz, vx=p.dvx, vy=vy, vz=vz)


@physics
def rhs(s):
    """Gravity with J2.  Vallado, Fundamentals of Astrodynamics and Applications, 4th ed., section 8.7."""
    gx, gy, gz = oblate(s.x, s.y, s.z, MU_EARTH)
    return State(x=s.vx, y=s.vy, z=s.vz, vx=gx, vy=gy, vz=gz)


@physics
def observe(s):
    """Distance from the Earth's centre [m]."""
    return Outputs(radius=sqrt(s.x * s.x + s.y * s.y + s.z * s.z))


@physics
def evaluate(s):
    """Distance [m] from where the flight began."""
    x = s.x - RADIUS
    return Metrics(position_error=sqrt(x * x + s.y * s.y + s.z * s.z))


MODEL = model(
    name="low orbit",
    title="One low orbit with J2",
    source="D. A. Vallado, Fundamentals of Astrodynamics and Applications, 4th ed., section 8.7",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=AdaptiveStep("duration", "tolerance", atol=(1e-3, 1e-3, 1e-3, 1e-6, 1e-6, 1e-6)),
    initial=initial,
    rhs=rhs,
    observe=observe,
    evaluate=evaluate,
)
