"""A rigid body with six degrees of freedom, over flat ground or about the rotating, oblate Earth; rockets.

The state of a model has the numbers of a `Motion` as single fields; the derivative of a `Motion` is a `Motion` too.
Forces and moments are given in body axes, moments about the centre of mass.  Not for flexible bodies and sloshing fuel.
SI.  The records are

Motion : position and velocity in one frame, attitude (quaternion from this frame to the body, see
    `mc_engine.physics.rotations`), rate [rad/s] in body axes
Inertia : moments xx, yy, zz and products xy, xz, yz of inertia [kg m^2] about the centre of mass, in body axes.  xy is
    the integral of x y dm: the inertia tensor has -xy outside its diagonal.  Reverse the sign of products that are
    given as elements of the tensor.
Rocket : body that is the same all around its axis z, without propellant: mass, inertia across and axial [kg m^2] about
    its centre of mass; distances from there to the tail [m]: propellant (its centre) and nozzle; jet, the squared
    radius of gyration about the axis of the gas that leaves the nozzle [m^2]
Propellant : mass, inertia across and axial [kg m^2] about its own centre; their rates: rate, across_rate, axial_rate;
    change, the rate of the mass's rate [kg/s^2]

P. H. Zipfel, Modeling and Simulation of Aerospace Vehicle Dynamics, 2nd ed. (2007), chapters 4 and 6;
W. T. Thomson, Introduction to Space Dynamics (1961), chapters 5 and 8 (variable mass).
"""

from collections import namedtuple
from collections.abc import Callable
from math import pi

import numpy as np

from mc_engine.errors import ModelError
from mc_engine.lanes import cos, maximum, physics, sin, sqrt
from mc_engine.physics.constants import EARTH_RATE, MU_EARTH
from mc_engine.physics.curves import Curve, curve
from mc_engine.physics.earth_frames import wind_from_body
from mc_engine.physics.gravity import oblate
from mc_engine.physics.rotations import derivative, transformed, transformed_back
from mc_engine.physics.vectors import Vector, added, cross, dot, scaled, subtracted, transposed_times

Motion = namedtuple("Motion", "position velocity attitude rate")
Inertia = namedtuple("Inertia", "xx yy zz xy xz yz")


# ---- inertia


@physics
def angular_momentum(inertia, rate):
    """Inertia times rate [kg m^2/s], in body axes."""
    i, w = inertia, rate
    return Vector(
        i.xx * w.x - i.xy * w.y - i.xz * w.z,
        i.yy * w.y - i.xy * w.x - i.yz * w.z,
        i.zz * w.z - i.xz * w.x - i.yz * w.y,
    )


@physics
def rate_of(inertia, momentum):
    """The angular rate [rad/s] for an angular momentum: the inverse of `angular_momentum`, by cofactors."""
    i, h = inertia, momentum
    cxx, cyy, czz = i.yy * i.zz - i.yz * i.yz, i.xx * i.zz - i.xz * i.xz, i.xx * i.yy - i.xy * i.xy
    cxy, cxz, cyz = i.xy * i.zz + i.xz * i.yz, i.xy * i.yz + i.xz * i.yy, i.xx * i.yz + i.xy * i.xz
    u = 1.0 / (i.xx * cxx - i.xy * cxy - i.xz * cxz)
    return Vector(
        u * (cxx * h.x + cxy * h.y + cxz * h.z),
        u * (cxy * h.x + cyy * h.y + cyz * h.z),
        u * (cxz * h.x + cyz * h.y + czz * h.z),
    )


@physics
def inertia_about(inertia, mass, arm):
    """Inertia about a point at `arm` [m] from the centre of mass, by the parallel-axis theorem; -mass reverses it."""
    i, a = inertia, arm
    return Inertia(
        i.xx + mass * (a.y * a.y + a.z * a.z),
        i.yy + mass * (a.x * a.x + a.z * a.z),
        i.zz + mass * (a.x * a.x + a.y * a.y),
        i.xy + mass * a.x * a.y,
        i.xz + mass * a.x * a.z,
        i.yz + mass * a.y * a.z,
    )


@physics
def inertia_between(empty, full, share):
    """Inertia [kg m^2] at a fraction of the fuel, 0 to 1, linear between empty and full; `inertia_rate` is its rate."""
    e, f = empty, full
    return Inertia(
        e.xx + share * (f.xx - e.xx),
        e.yy + share * (f.yy - e.yy),
        e.zz + share * (f.zz - e.zz),
        e.xy + share * (f.xy - e.xy),
        e.xz + share * (f.xz - e.xz),
        e.yz + share * (f.yz - e.yz),
    )


@physics
def inertia_rate(empty, full, share_rate):
    """Rate [kg m^2/s] of `inertia_between` for a rate of the fraction [1/s], negative while fuel burns."""
    e, f, k = empty, full, share_rate
    return Inertia(
        k * (f.xx - e.xx), k * (f.yy - e.yy), k * (f.zz - e.zz),
        k * (f.xy - e.xy), k * (f.xz - e.xz), k * (f.yz - e.yz),
    )  # fmt: skip


@physics
def angular_acceleration(inertia, rate, moment):
    """Euler's equation [rad/s^2]: I w' = M - w x (I w).  Zipfel, chapter 6."""
    return rate_of(inertia, subtracted(moment, cross(rate, angular_momentum(inertia, rate))))


@physics
def angular_acceleration_changing(inertia, change, rate, moment):
    """Angular acceleration [rad/s^2] while the inertia changes at a rate [kg m^2/s]: I w' = M - I' w - w x (I w).

    The angular momentum carried away by the gas is a separate moment: `jet_damping`.  Thomson, chapter 8.
    """
    return angular_acceleration(inertia, rate, subtracted(moment, angular_momentum(change, rate)))


# ---- forces and moments, in body axes


@physics
def moment_of(force, arm):
    """Moment [N m] of a force that acts at `arm` [m] from the centre of mass."""
    return cross(arm, force)


@physics
def thrust_force(thrust, pitch, yaw):
    """Force [N] of an engine along x, deflected by two angles [rad], pitch towards -z and yaw towards y."""
    level = thrust * cos(pitch)
    return Vector(level * cos(yaw), level * sin(yaw), -thrust * sin(pitch))


@physics
def jet_damping(flow, arm, rate):
    """Damping moment [N m] of gas leaving at `arm` [m] with a mass flow [kg/s] above 0: -flow arm x (rate x arm)."""
    return scaled(-flow, cross(arm, cross(rate, arm)))


@physics
def aerodynamic_force(pressure, area, alpha, beta, drag, side, lift):
    """Force [N] in body axes by coefficients in wind axes.  pressure : dynamic [Pa];  area : reference area [m^2]."""
    size = pressure * area
    return transposed_times(wind_from_body(alpha, beta), Vector(-size * drag, size * side, -size * lift))


@physics
def aerodynamic_moment(pressure, area, length, roll, pitch, yaw):
    """Moment [N m] by coefficients about the body axes.

    pressure, area : as in `aerodynamic_force`;  length : reference length [m].
    """
    size = pressure * area * length
    return Vector(size * roll, size * pitch, size * yaw)


@physics
def gravity_gradient(inertia, r_body, mu=MU_EARTH):
    """Gravity-gradient moment [N m]: 3 mu / r^5 r x (I r).  r_body : from the Earth's centre [m], in body axes.

    P. C. Hughes, Spacecraft Attitude Dynamics (1986), chapter 8.
    """
    r2 = dot(r_body, r_body)
    moment = cross(r_body, angular_momentum(inertia, r_body))
    return scaled(3.0 * mu / (r2 * r2 * sqrt(r2)), moment)


@physics
def air_velocity(r_eci, v_eci, body_from_eci, wind_eci, rate=EARTH_RATE):
    """Velocity [m/s] relative to the air rotating with the Earth, in body axes.  wind_eci : over the ground, in ECI."""
    ground = Vector(v_eci.x + rate * r_eci.y, v_eci.y - rate * r_eci.x, v_eci.z)
    return transformed(body_from_eci, subtracted(ground, wind_eci))


# ---- motion


@physics
def flat_derivative(motion, mass, inertia, force, moment, gravity):
    """Derivative of a Motion in NED over flat ground at rest.  gravity : [m/s^2], down."""
    push = transformed_back(motion.attitude, scaled(1.0 / mass, force))
    return Motion(
        motion.velocity,
        Vector(push.x, push.y, push.z + gravity),
        derivative(motion.attitude, motion.rate),
        angular_acceleration(inertia, motion.rate, moment),
    )


@physics
def orbital_derivative(motion, mass, inertia, force, moment):
    """Derivative of a Motion in ECI under the gravity of the oblate Earth, without the gravity-gradient moment.

    The Earth's rotation enters only through force and moment: `air_velocity`, `eci_to_ecef`, `ecef_to_geodetic`.
    """
    r = motion.position
    push = transformed_back(motion.attitude, scaled(1.0 / mass, force))
    gx, gy, gz = oblate(r.x, r.y, r.z, MU_EARTH)
    return Motion(
        motion.velocity,
        added(push, Vector(gx, gy, gz)),
        derivative(motion.attitude, motion.rate),
        angular_acceleration(inertia, motion.rate, moment),
    )


@physics
def point_of_body(motion, arm):
    """(position, velocity) of a point at `arm` [m] from the centre of mass, in the frame of the motion."""
    return (
        added(motion.position, transformed_back(motion.attitude, arm)),
        added(motion.velocity, transformed_back(motion.attitude, cross(motion.rate, arm))),
    )


# ---- a rocket that burns solid propellant

Rocket = namedtuple("Rocket", "mass across axial propellant nozzle jet")
Propellant = namedtuple("Propellant", "mass across axial rate across_rate axial_rate change")


def solid_propellant(
    thrust: Curve, burn: float, *, number: int, density: float, outer: float, inner: float, length: float, gap: float
) -> Callable[..., Propellant]:
    """propellant(t) -> `Propellant` of a motor with hollow cylinders in a row, which burn inside and at both ends.

    thrust : curve over time [N];  burn : burnout time [s];  number, density [kg/m^3] : of the cylinders
    outer, inner, length, gap : initial radii and length of a cylinder, and the gap between two of them [m]
    ModelError unless 0 <= inner < outer, and number, density, length and burn are above zero.

    The mass flow is proportional to the thrust (constant exhaust speed); the motor is computed every millisecond.
    Derived here from m = n rho pi (R^2 - r^2) L with L' = -2 r'.
    """
    if not (0.0 <= inner < outer and all(size > 0.0 for size in (number, density, length, burn))):
        raise ModelError(
            f"solid_propellant: inner {inner:g} m, outer {outer:g} m, length {length:g} m, number {number:g}, density "
            f"{density:g} kg/m^3, burn {burn:g} s are no motor; give 0 <= inner < outer, and the others above zero"
        )
    solid, spacing = number * density * pi, length + gap
    t = np.linspace(0.0, burn, round(1e3 * burn) + 1)
    force, radii = thrust(t), np.linspace(inner, outer, 100_001)
    left = solid * (outer**2 - radii**2) * (length - 2.0 * (radii - inner))
    impulse = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(t))])
    flow = left[0] / impulse[-1]  # over the thrust
    radius_of = curve(x=t, y=np.interp(flow * impulse, left[0] - left, radii), kind="cubic")
    change_of = curve(x=0.5 * (t[1:] + t[:-1]), y=-flow * np.diff(force) / np.diff(t), kind="nearest", outside="zero")
    apart = spacing * spacing * (number * number - 1.0) / 12.0

    @physics
    def propellant(t):
        r, rate = radius_of(t), -flow * thrust(t)
        long, ring, round2 = length - 2.0 * (r - inner), outer * outer - r * r, outer * outer + r * r
        surface = maximum(r * long + ring, 1e-200)  # a cylinder may burn away from all sides at once, to nothing
        mass, growth = solid * ring * long, -0.5 * rate / (solid * surface)
        across = 0.25 * round2 + long * long / 12.0 + apart
        return Propellant(
            mass=mass,
            across=mass * across,
            axial=0.5 * mass * round2,
            rate=rate,
            across_rate=rate * across + mass * growth * (0.5 * r - long / 3.0),
            axial_rate=0.5 * rate * round2 + mass * growth * r,
            change=change_of(t),
        )

    return propellant


@physics
def rocket_accelerations(rocket, fuel, rate, force, moment, weight):
    """(acceleration [m/s^2], angular acceleration [rad/s^2]) of the point of the dry centre of mass, in body axes.

    fuel : `Propellant`;  rate : of the body [rad/s];  force [N] : thrust and air, with its moment [N m] about the dry
    centre of mass;  weight : gravity [m/s^2]

    Balance of momentum and angular momentum of all that is inside the rocket, with propellant on the axis; the second
    derivative of the place of the centre of mass is left out, as by G. H. Ceotto et al., J. Aerosp. Eng. 34(6), 2021.
    RocketPy 1.13 differs in other terms: see "Replace a simulator by a compiled model, and prove it".
    """
    w, m = rate, rocket.mass + fuel.mass
    down, arm = -rocket.nozzle, -rocket.propellant
    r = arm * fuel.mass / m  # to the centre of mass
    dr = arm * fuel.rate * rocket.mass / (m * m)
    i, axial = rocket.across + fuel.across + fuel.mass * arm * arm, rocket.axial + fuel.axial
    jet = fuel.rate * (0.5 * rocket.jet + down * down) - fuel.across_rate - fuel.rate * arm * arm
    sway = 2.0 * fuel.rate * (down - r) - 2.0 * m * dr
    fx = force.x + w.y * sway - m * r * w.x * w.z
    fy = force.y - w.x * sway - m * r * w.y * w.z
    fz = force.z - 2.0 * fuel.rate * dr + fuel.change * (down - r) + m * r * (w.x * w.x + w.y * w.y)
    turn = Vector(
        ((i - axial) * w.y * w.z + jet * w.x + moment.x + r * fy) / (i - m * r * r),
        ((axial - i) * w.x * w.z + jet * w.y + moment.y - r * fx) / (i - m * r * r),
        ((fuel.rate * rocket.jet - fuel.axial_rate) * w.z + moment.z) / axial,
    )
    return Vector(weight.x + fx / m - r * turn.y, weight.y + fy / m + r * turn.x, weight.z + fz / m), turn
