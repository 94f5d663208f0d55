"""Entry of a point mass with constant lift and drag into an exponential atmosphere, down to 10 km.  SI.

Spherical Earth without rotation: good for speed and accuracy of integration, not for landing points.  Not for
vertical flight or passages over a pole, where the coordinates are singular.

N. X. Vinh, A. Busemann, R. D. Culp, Hypersonic and Planetary Entry Flight Mechanics (1980), chapter 2, with the
heading counted from north, clockwise.
"""

from collections import namedtuple

import numpy as np

from mc_engine.lanes import physics, sincos, sqrt
from mc_engine.model import Event, Parameter, Setting, at_end, inputs, metrics, model, outputs, states
from mc_engine.physics.atmosphere import exponential
from mc_engine.physics.constants import MU_EARTH

RADIUS = 6378137.0  # of the Earth [m], WGS 84
AIR = (1.225, 0.0, 7200.0)  # density [kg/m^3], its altitude [m], scale height [m]
STOP_ALTITUDE = 10e3
EAST, NORTH = 0.8660254037844386, 0.5  # parts of the first level speed

Inputs = inputs(
    altitude_m=Parameter(120e3, "first altitude"),
    speed_m_s=Parameter(7800.0, "first speed"),
    flight_path_rad=Parameter(-0.034906585039886594, "first flight-path angle"),
    ballistic_coefficient_kg_m2=Parameter(364.02, "mass over drag area", unit="kg/m^2"),
    lift_to_drag=Parameter(0.3, "lift over drag", unit=""),
    bank_rad=Parameter(1.0471975511965976, "bank angle"),
    density=Parameter(1.0, "factor of the density", unit=""),
    duration_s=Setting(3000.0, "limit of the flight"),
    step_s=Setting(0.5, "step of the fixed grid"),
    tolerance=Setting(1e-10, "error of a step, relative", unit=""),
)
State = states(**{axis: f"inertial {axis[0]}" for axis in ("x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s")})
Outputs = outputs(altitude_m="altitude")
Metrics = metrics(
    time_s=at_end("t_s", "length of the flight"), final_altitude_m=at_end("altitude_m", "altitude in the end")
)
Parameters = namedtuple("Parameters", "altitude speed flight_path drag lift_up lift_aside")


def prepare(inputs, settings, refusals):
    """What does not change in a flight: half of drag and lift over mass [1/m] in air of 1 kg/m^3, the lift in parts."""
    drag = 0.5 * inputs.density / inputs.ballistic_coefficient
    lift = inputs.lift_to_drag * drag
    parts = {"drag": drag, "lift_up": lift * np.cos(inputs.bank), "lift_aside": lift * np.sin(inputs.bank)}
    return {**vars(inputs), **parts}


@physics
def initial(p):
    """Over the x axis, heading for the y axis, 30 degrees up to the z axis."""
    sin_path, cos_path = sincos(p.flight_path)
    level = p.speed * cos_path
    return State(x=RADIUS + p.altitude, y=0.0, z=0.0, vx=p.speed * sin_path, vy=EAST * level, vz=NORTH * level)


@physics
def rhs(s, p):
    """Derivative of the state under point-mass gravity, drag, and lift turned to the right by the bank angle."""
    r2 = s.x * s.x + s.y * s.y + s.z * s.z
    v2 = s.vx * s.vx + s.vy * s.vy + s.vz * s.vz
    radius, speed = sqrt(r2), sqrt(v2)
    # r x v: at right angles to the vertical plane of flight, to the left
    hx, hy, hz = s.y * s.vz - s.z * s.vy, s.z * s.vx - s.x * s.vz, s.x * s.vy - s.y * s.vx
    h = sqrt(hx * hx + hy * hy + hz * hz)
    inverse = 1.0 / (r2 * h)  # one division for two: it takes as long as twenty products
    u2 = inverse * h
    g = -MU_EARTH * (u2 * u2) * radius
    density = exponential(radius - RADIUS, AIR[0], AIR[1], AIR[2])
    thrust = density * speed
    d = -p.drag * thrust
    up = p.lift_up * thrust * (inverse * r2)
    aside = -p.lift_aside * thrust * speed * (inverse * r2)
    return State(
        x=s.vx,
        y=s.vy,
        z=s.vz,
        vx=g * s.x + d * s.vx + up * (s.vy * hz - s.vz * hy) + aside * hx,
        vy=g * s.y + d * s.vy + up * (s.vz * hx - s.vx * hz) + aside * hy,
        vz=g * s.z + d * s.vz + up * (s.vx * hy - s.vy * hx) + aside * hz,
    )


@physics
def ballistic_rhs(s, p):
    """Derivative of the state under point-mass gravity and drag."""
    r2 = s.x * s.x + s.y * s.y + s.z * s.z
    radius, speed = sqrt(r2), sqrt(s.vx * s.vx + s.vy * s.vy + s.vz * s.vz)
    u2 = 1.0 / r2
    g = -MU_EARTH * (u2 * u2) * radius
    d = -p.drag * exponential(radius - RADIUS, AIR[0], AIR[1], AIR[2]) * speed
    return State(
        x=s.vx,
        y=s.vy,
        z=s.vz,
        vx=g * s.x + d * s.vx,
        vy=g * s.y + d * s.vy,
        vz=g * s.z + d * s.vz,
    )


@physics
def above_stop(s):
    """Height over the end of the flight [m]."""
    return sqrt(s.x * s.x + s.y * s.y + s.z * s.z) - (RADIUS + STOP_ALTITUDE)


@physics
def observe(s):
    """Altitude [m]."""
    return Outputs(altitude=sqrt(s.x * s.x + s.y * s.y + s.z * s.z) - RADIUS)


def entry_model(clock, derivative=rhs):
    """The model of the entry with the given clock and right-hand side; the nominal flight is a lifting one."""
    return model(
        name="entry",
        title="Entry with constant lift and drag",
        source="N. X. Vinh et al., Hypersonic and Planetary Entry Flight Mechanics (1980), chapter 2",
        inputs=Inputs,
        states=State,
        outputs=Outputs,
        metrics=Metrics,
        clock=clock,
        kernel_parameters=Parameters,
        prepare=prepare,
        initial=initial,
        rhs=derivative,
        events={"altitude": Event(above_stop, "falling", "stop")},
        observe=observe,
    )
