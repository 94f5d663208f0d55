"""Lift and axial force of a vehicle at its trim angle of attack, lift of the parts of a slender rocket, parachutes.

Coefficients that depend on the Mach number are curves, see `mc_engine.physics.curves`.
"""

from math import pi

from mc_engine.lanes import atan2, maximum, physics, sqrt, where
from mc_engine.physics.vectors import Vector, norm, scaled

FADING = 0.01  # rad from the vertical


@physics
def lift_direction(vx, vy, vz, ux, uy, uz, speed, cos_bank, sin_bank):
    """Unit vector of the lift (x, y, z), perpendicular to the velocity v.

    u : unit vector up;  speed : length of v.  At bank 0 the lift is in the vertical plane and points up; at 90 degrees
    it is horizontal and points to the right of the flight.  The bank is undefined in vertical flight, so the length of
    the vector decreases to zero within 0.01 rad of the vertical.
    """
    rx, ry, rz = vy * uz - vz * uy, vz * ux - vx * uz, vx * uy - vy * ux  # to the right, as long as the level speed
    level = maximum(sqrt(rx * rx + ry * ry + rz * rz), FADING * speed)
    still = speed <= 0.0
    side = sin_bank / where(still, 1.0, level)
    ahead = cos_bank / where(still, 1.0, level * speed)
    return (
        ahead * (ry * vz - rz * vy) + side * rx,
        ahead * (rz * vx - rx * vz) + side * ry,
        ahead * (rx * vy - ry * vx) + side * rz,
    )


@physics
def axial_coefficient(drag_coefficient, lift_coefficient, cos_trim, sin_trim):
    """Force coefficient along the body axis at the trim angle of attack: C_D cos + C_L sin."""
    return drag_coefficient * cos_trim + lift_coefficient * sin_trim


@physics
def lift_of_part(density, stream, rate, place, area):
    """(force [N], moment [N m] about the centre of mass) of the lift of a rocket's part, in body axes, z to the nose.

    stream : velocity [m/s] of the air relative to the centre of mass, in body axes;  rate : of the body [rad/s]
    place : distance of the part's centre of pressure ahead of the centre of mass [m]
    area : reference area times the slope of the lift coefficient over the angle of attack [m^2/rad]
    J. S. Barrowman, The practical calculation of the aerodynamic characteristics of slender finned vehicles (1967).
    """
    own = Vector(stream.x - rate.y * place, stream.y + rate.x * place, stream.z)
    speed, across = norm(own), sqrt(own.x * own.x + own.y * own.y)
    k = 0.5 * density * speed * speed * area * atan2(across, -own.z) / where(across > 0.0, across, 1.0)
    return Vector(k * own.x, k * own.y, 0.0), Vector(-place * k * own.y, place * k * own.x, 0.0)


@physics
def fins_lift_area(mach, number, span, root, tip, radius):
    """Reference area times the slope of the lift coefficient [m^2/rad] of equal trapezoidal fins on a round body.

    number : of the fins, three or four;  span : of one fin, from the body to its tip [m];  root, tip : chords [m];
    radius : of the body [m].  The trailing edge is perpendicular to the body.

    One fin: F. W. Diederich, NACA TN 2335 (1951), with the Prandtl-Glauert factor, which from Mach 0.8 to 1.1 is that
    of Mach 0.8; all fins on a body: Barrowman, as in `lift_of_part`.
    """
    sweep = 0.5 * (root - tip) / span  # tangent, of the line at half chord
    beta = sqrt(where(mach < 0.8, 1.0 - mach * mach, where(mach < 1.1, 0.36, mach * mach - 1.0)))
    f = 4.0 * span / (root + tip) * sqrt(1.0 + sweep * sweep) * beta
    return 0.5 * number * (1.0 + radius / (span + radius)) * 4.0 * pi * span * span / (2.0 + sqrt(f * f + 4.0))


@physics
def parachute_acceleration(density, stream, mass, area, gravity):
    """Acceleration [m/s^2] of a mass [kg] under an open parachute, with the added mass of half a sphere of air.

    stream : velocity of the air relative to it [m/s], z up;  area : drag area [m^2], of a drag coefficient of 1.4;
    gravity : down [m/s^2].  As in RocketPy 1.13 (G. H. Ceotto et al., J. Aerosp. Eng. 34(6), 2021).
    """
    moving = mass + 2.0 / 3.0 * pi * density * sqrt(area / (1.4 * pi)) ** 3
    pull = scaled(0.5 * density * area * norm(stream) / moving, stream)
    return Vector(pull.x, pull.y, pull.z - mass / moving * gravity)
