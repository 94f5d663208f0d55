"""Low orbit with J2 and drag in a rotating atmosphere: the right-hand side that speed is quoted for.  SI."""

from collections import namedtuple

from mc_engine.lanes import physics, sqrt
from mc_engine.model import Field, FixedStep, Model, Parameter
from mc_engine.physics.atmosphere import exponential
from mc_engine.physics.constants import EARTH_RATE, EQUATORIAL_RADIUS, MU_EARTH
from mc_engine.physics.gravity import j2_perturbation, point_mass

State = namedtuple("State", "x y z vx vy vz")
Parameters = namedtuple("Parameters", "altitude climb ballistic_coefficient")
Quantities = namedtuple("Quantities", "radius")
Metrics = namedtuple("Metrics", "x y z")


@physics
def initial(p, o):
    """At the ascending node, bound for 49 degrees of latitude."""
    return State(EQUATORIAL_RADIUS + p.altitude, 0.0, 0.0, 0.0, 5000.0, p.climb)


@physics
def rhs(t, s, m, p, o):
    """Two-body motion, J2, and drag of the air that turns with the Earth."""
    gx, gy, gz = point_mass(s.x, s.y, s.z, MU_EARTH)
    jx, jy, jz = j2_perturbation(s.x, s.y, s.z, MU_EARTH)
    h = sqrt(s.x * s.x + s.y * s.y + s.z * s.z) - EQUATORIAL_RADIUS
    ux, uy = s.vx + EARTH_RATE * s.y, s.vy - EARTH_RATE * s.x
    speed = sqrt(ux * ux + uy * uy + s.vz * s.vz)
    d = -0.5 / p.ballistic_coefficient * exponential(h, 3.725e-12, 400e3, 58_515.0) * speed
    return State(s.vx, s.vy, s.vz, gx + jx + d * ux, gy + jy + d * uy, gz + jz + d * s.vz)


@physics
def observe(t, s, m, p, o):
    """Distance from the Earth's centre [m]."""
    return Quantities(sqrt(s.x * s.x + s.y * s.y + s.z * s.z))


@physics
def evaluate(t, s, m, p, o, best, when):
    """Where the craft is in the end."""
    return Metrics(s.x, s.y, s.z)


MODEL = Model(
    name="orbit",
    title="Low orbit with J2 and drag",
    source="D. A. Vallado, Fundamentals of Astrodynamics and Applications, 4th ed., sections 8.6 and 8.7",
    parameters=(
        Parameter("altitude_km", "km", "altitude at the node", 400.0),
        Parameter("climb_m_s", "m/s", "velocity along the polar axis", 5800.0),
        Parameter("ballistic_coefficient_kg_m2", "kg/m^2", "mass over drag area", 100.0),
    ),
    settings=(),
    states=(
        *(Field(f"{axis}_km", "km", f"inertial position, {axis}") for axis in "xyz"),
        *(Field(f"v{axis}_m_s", "m/s", f"inertial velocity, {axis}") for axis in "xyz"),
    ),
    quantities=(Field("radius_km", "km", "distance from the Earth's centre"),),
    metrics=tuple(Field(f"final_{axis}_km", "km", f"inertial position after the flight, {axis}") for axis in "xyz"),
    clock=FixedStep(10.0, 4000.0),
    kernel_parameters=Parameters,
    initial=initial,
    rhs=rhs,
    observe=observe,
    evaluate=evaluate,
)
