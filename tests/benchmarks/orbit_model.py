"""Low orbit with J2 and drag in a rotating atmosphere: the right-hand side that speed is quoted for.  SI."""

from mc_engine.lanes import physics, sqrt
from mc_engine.model import FixedStep, Parameter, inputs, metrics, model, outputs, states
from mc_engine.physics.atmosphere import exponential
from mc_engine.physics.constants import EARTH_RATE, EQUATORIAL_RADIUS, MU_EARTH
from mc_engine.physics.gravity import j2_perturbation, point_mass

Inputs = inputs(
    altitude_km=Parameter(400.0, "altitude at the node"),
    climb_m_s=Parameter(5800.0, "velocity along the polar axis"),
    ballistic_coefficient_kg_m2=Parameter(100.0, "mass over drag area", unit="kg/m^2"),
)
State = states(
    **{f"{axis}_km": f"inertial position, {axis}" for axis in "xyz"},
    **{f"v{axis}_m_s": f"inertial velocity, {axis}" for axis in "xyz"},
)
Outputs = outputs(radius_km="distance from the Earth's centre")
Metrics = metrics(**{f"final_{axis}_km": f"inertial position after the flight, {axis}" for axis in "xyz"})


@physics
def initial(p):
    """At the ascending node, bound for 49 degrees of latitude."""
    return State(x=EQUATORIAL_RADIUS + p.altitude, y=0.0, z=0.0, vx=0.0, vy=5000.0, vz=p.climb)


@physics
def rhs(s, p):
    """Two-body motion, J2, and drag of the air that turns with the Earth."""
    gx, gy, gz = point_mass(s.x, s.y, s.z, MU_EARTH)
    jx, jy, jz = j2_perturbation(s.x, s.y, s.z, MU_EARTH)
    h = sqrt(s.x * s.x + s.y * s.y + s.z * s.z) - EQUATORIAL_RADIUS
    ux, uy = s.vx + EARTH_RATE * s.y, s.vy - EARTH_RATE * s.x
    speed = sqrt(ux * ux + uy * uy + s.vz * s.vz)
    d = -0.5 / p.ballistic_coefficient * exponential(h, 3.725e-12, 400e3, 58_515.0) * speed
    ax, ay, az = gx + jx + d * ux, gy + jy + d * uy, gz + jz + d * s.vz
    return State(x=s.vx, y=s.vy, z=s.vz, vx=ax, vy=ay, vz=az)


@physics
def observe(s):
    """Distance from the Earth's centre [m]."""
    return Outputs(radius=sqrt(s.x * s.x + s.y * s.y + s.z * s.z))


@physics
def evaluate(s):
    """Where the craft is in the end."""
    return Metrics(final_x=s.x, final_y=s.y, final_z=s.z)


MODEL = model(
    name="orbit",
    title="Low orbit with J2 and drag",
    source="D. A. Vallado, Fundamentals of Astrodynamics and Applications, 4th ed., sections 8.6 and 8.7",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=FixedStep(10.0, 4000.0),
    initial=initial,
    rhs=rhs,
    observe=observe,
    evaluate=evaluate,
)
