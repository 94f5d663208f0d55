"""One low orbit with J2: six errors of the first state, spread over an orbit.  SI."""

from collections import namedtuple

from mc_engine.lanes import physics, sqrt
from mc_engine.model import AdaptiveStep, Extremum, Field, Model, Parameter, Setting
from mc_engine.physics.constants import MU_EARTH
from mc_engine.physics.gravity import oblate

AXES = ("x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s")
RADIUS = 7000e3
SPEED = (MU_EARTH / RADIUS) ** 0.5

State = namedtuple("State", "x y z vx vy vz")
Parameters = namedtuple("Parameters", "dx dy dz dvx dvy dvz")
Quantities = namedtuple("Quantities", "radius")
Metrics = namedtuple("Metrics", "position_error lowest_radius highest_radius")


@physics
def initial(p, o):
    """A circular orbit of 60 degrees, and its errors."""
    return State(RADIUS + p.dx, p.dy, p.dz, p.dvx, 0.5 * SPEED + p.dvy, 0.8660254037844386 * SPEED + p.dvz)


@physics
def rhs(t, s, m, p, o):
    """Gravity with J2.  Vallado, Fundamentals of Astrodynamics and Applications, 4th ed., section 8.7."""
    return State(s.vx, s.vy, s.vz, *oblate(s.x, s.y, s.z, MU_EARTH))


@physics
def observe(t, s, m, p, o):
    """Distance from the Earth's centre [m]."""
    return Quantities(sqrt(s.x * s.x + s.y * s.y + s.z * s.z))


@physics
def evaluate(t, s, m, p, o, best, when):
    """Distance [m] from where the flight began, and the extremes of the radius."""
    x = s.x - RADIUS
    return Metrics(sqrt(x * x + s.y * s.y + s.z * s.z), best.lowest, best.highest)


MODEL = Model(
    name="low orbit",
    title="One low orbit with J2",
    source="D. A. Vallado, Fundamentals of Astrodynamics and Applications, 4th ed., section 8.7",
    parameters=tuple(
        Parameter(
            f"d{axis}", axis.partition("_")[2].replace("_", "/"), f"error of the first {axis.partition('_')[0]}", 0.0
        )
        for axis in AXES
    ),
    settings=(
        Setting("duration_s", "s", "length of the flight", 5400.0, low=1.0),
        Setting("tolerance", "", "error of a step, relative", 1e-10, low=1e-15, high=1e-3),
    ),
    states=tuple(
        Field(axis, axis.partition("_")[2].replace("_", "/"), f"inertial {axis.partition('_')[0]}") for axis in AXES
    ),
    quantities=(Field("radius_m", "m", "distance from the Earth's centre"),),
    metrics=(
        Field("position_error_m", "m", "distance from the first place of the errorless orbit"),
        Field("lowest_radius_m", "m", "least distance from the Earth's centre"),
        Field("highest_radius_m", "m", "largest distance from the Earth's centre"),
    ),
    extrema=(Extremum("lowest", "radius_m", "min"), Extremum("highest", "radius_m", "max")),
    clock=AdaptiveStep("duration", "tolerance", atol=(1e-3, 1e-3, 1e-3, 1e-6, 1e-6, 1e-6)),
    kernel_parameters=Parameters,
    initial=initial,
    rhs=rhs,
    observe=observe,
    evaluate=evaluate,
)
