"""Earth orbits with J2 and drag, and without: the physics of the orbits of the benchmarks.  SI.

The air is one exponential layer that turns with the Earth: good for speed and accuracy of integration, not for
lifetimes.
"""

from collections import namedtuple

from mc_engine.lanes import fma, physics, sqrt
from mc_engine.model import Parameter, Setting, at_end, inputs, metrics, model, outputs, states
from mc_engine.physics.atmosphere import exponential
from mc_engine.physics.constants import EARTH_RATE, EQUATORIAL_RADIUS, MU_EARTH
from mc_engine.physics.gravity import oblate, point_mass

# Vallado, Fundamentals of Astrodynamics and Applications, 4th ed., Table 8-4
LOW_AIR = (3.725e-12, 400e3, 58_515.0)
PERIGEE_AIR = (7.248e-11, 250e3, 45_546.0)
# first states: a circular orbit of 59 degrees at 400 km; perigee of a transfer orbit of 7 degrees, 250 to 35786 km
LOW_ORBIT = (6778e3, 0.0, 0.0, 0.0, 3950.0, 6574.0)
TRANSFER_ORBIT = (6628e3, 0.0, 0.0, 0.0, 10086.0, 1238.0)
RATES = (("x", "vx"), ("y", "vy"), ("z", "vz"))
AXES = ("x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s")

State = states(**{axis: f"inertial {axis[0]}" for axis in AXES})
Outputs = outputs(radius_m="distance from the Earth's centre")
Metrics = metrics(final_radius_m=at_end("radius_m", "distance from the Earth's centre in the end"))
Parameters = namedtuple("Parameters", [*State._fields, "drag"])


def prepare(inputs, settings, refusals):
    """What does not change in a flight: half the drag area over mass [m^2/kg], with its sign."""
    return {**vars(inputs), "drag": -0.5 / inputs.ballistic_coefficient}


@physics
def initial(p):
    """The parameters are the first state."""
    return State(x=p.x, y=p.y, z=p.z, vx=p.vx, vy=p.vy, vz=p.vz)


@physics
def acceleration(s, p, air):
    """Acceleration [m/s^2] by gravity with J2, and by drag in `air`: reference density, its altitude, scale height.

    Vallado, Fundamentals of Astrodynamics and Applications, 4th ed., sections 8.6 and 8.7.
    """
    gx, gy, gz = oblate(s.x, s.y, s.z, MU_EARTH)
    h = sqrt(fma(s.x, s.x, fma(s.y, s.y, s.z * s.z))) - EQUATORIAL_RADIUS  # written as in `oblate`: one root for both
    ux, uy = fma(EARTH_RATE, s.y, s.vx), fma(-EARTH_RATE, s.x, s.vy)
    speed = sqrt(fma(ux, ux, fma(uy, uy, s.vz * s.vz)))
    d = p.drag * exponential(h, air[0], air[1], air[2]) * speed
    return fma(d, ux, gx), fma(d, uy, gy), fma(d, s.vz, gz)


@physics
def low_rhs(s, p):
    """Derivative of the state in the layer from 400 km."""
    ax, ay, az = acceleration(s, p, LOW_AIR)
    return State(x=s.vx, y=s.vy, z=s.vz, vx=ax, vy=ay, vz=az)


@physics
def transfer_rhs(s, p):
    """Derivative of the state in the layer from 250 km."""
    ax, ay, az = acceleration(s, p, PERIGEE_AIR)
    return State(x=s.vx, y=s.vy, z=s.vz, vx=ax, vy=ay, vz=az)


@physics
def oblate_rhs(s):
    """Derivative of the state without air: a point mass and J2."""
    gx, gy, gz = oblate(s.x, s.y, s.z, MU_EARTH)
    return State(x=s.vx, y=s.vy, z=s.vz, vx=gx, vy=gy, vz=gz)


@physics
def two_body_rhs(s):
    """Derivative of the state around a point mass, whose energy and angular momentum are kept."""
    gx, gy, gz = point_mass(s.x, s.y, s.z, MU_EARTH)
    return State(x=s.vx, y=s.vy, z=s.vz, vx=gx, vy=gy, vz=gz)


@physics
def observe(s):
    """Distance from the Earth's centre [m]."""
    return Outputs(radius=sqrt(s.x * s.x + s.y * s.y + s.z * s.z))


def orbit_model(name, rhs, first_state, clock):
    """The model of a drag orbit with the given derivative, nominal first state and clock."""
    return model(
        name=name,
        title="Earth orbit with J2 and drag",
        source="D. A. Vallado, Fundamentals of Astrodynamics and Applications, 4th ed., sections 8.6 and 8.7",
        inputs=inputs(
            **{axis: Parameter(value, f"first {axis[0]}") for axis, value in zip(AXES, first_state, strict=True)},
            ballistic_coefficient_kg_m2=Parameter(100.0, "mass over drag area", unit="kg/m^2"),
            duration_s=Setting(86400.0, "length of the flight"),
            step_s=Setting(10.0, "step of the fixed grid"),
            tolerance=Setting(1e-10, "error of a step, relative", unit=""),
        ),
        states=State,
        outputs=Outputs,
        metrics=Metrics,
        clock=clock,
        kernel_parameters=Parameters,
        prepare=prepare,
        initial=initial,
        rhs=rhs,
        observe=observe,
    )
