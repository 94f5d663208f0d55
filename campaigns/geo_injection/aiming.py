"""The closed loop: the last burn is aimed again when the one before it has ended.

An impulse stands for the last burn.  It is put where the coast crosses the same angle from the node as the middle of
the nominal burn (planar: from the perigee), and makes the orbit there equatorial, level and of the geostationary
semi-major axis.  Compared with the impulse of the nominal flight it tells by how much the stored program is to be
turned, lengthened and shifted; the flight without errors is the stored program itself.
Place and velocity are known but for the navigation's errors; mass and engine are taken for nominal.
"""

from collections import namedtuple

import numpy as np

from campaigns.geo_injection.design.coast import kepler
from campaigns.geo_injection.design.program import Program
from campaigns.geo_injection.inputs import CHOICES
from campaigns.geo_injection.program_table import Nominal, Polynomial, Steering, burn_row, nominal
from mc_engine.lanes import atan2, exp, floor, log, maximum, physics, sincos, sqrt, where
from mc_engine.physics.constants import MU_EARTH
from mc_engine.physics.vectors import Vector, added, added_scaled, cross, dot, norm, scaled, subtracted

# unit vector; stretch: of the duration; sensed: speed change at which the burn is shut down [m/s]; ignition: time [s]
Aim = namedtuple("Aim", "x y z stretch sensed ignition")
Impulse = namedtuple("Impulse", "wait x y z size")  # wait: time to it
Place = namedtuple("Place", "x y z vx vy vz")
# node: unit vector to the node on the final plane (planar: to perigee);  ahead: a quarter revolution ahead
# normal: to the orbit;  e: eccentricity vector;  h: angular momentum [m^2/s]
Orbit = namedtuple("Orbit", "node ahead normal e h")

PLANAR = 1e-3  # sine of a tilt to the final plane below which the orbit before the last burn has no node to speak of


@physics
def _over(a, size):
    """The vector a divided by a number, in the unit of the quotient."""
    return Vector(a.x / size, a.y / size, a.z / size)


@physics
def velocity(s):
    """Velocity [m/s] of a state, as a vector."""
    return Vector(s.vx, s.vy, s.vz)


@physics
def pole(tilt):
    """Unit vector normal to the final orbit, whose inclination is `tilt` [rad]."""
    sine, cosine = sincos(tilt)
    return Vector(0.0, 0.0 - sine, cosine)


@physics
def _orbit(s, final, planar):
    """The orbit through the state s [m, m/s].  final : unit vector normal to the final orbit.

    Curtis, Orbital Mechanics for Engineering Students, 3rd ed., algorithm 4.2.
    """
    momentum = cross(s, velocity(s))
    h = norm(momentum)
    u = _over(momentum, h)
    e = subtracted(_over(cross(velocity(s), momentum), MU_EARTH), _over(s, norm(s)))
    n = where(planar > 0.5, e, cross(final, u))
    n = _over(n, maximum(norm(n), 1e-300))
    return Orbit(node=n, ahead=cross(u, n), normal=u, e=e, h=h)


@physics
def impulse_at(s, angle, tilt, radius, planar):
    """The impulse [s, m/s] on the coast from the state s at an angle [rad] from its node (planar: perigee).

    tilt, radius : inclination [rad] and radius [m] of the final orbit, the radius being the semi-major axis wanted
    Derived here: in the direction d, r = h^2 / (mu (1 + e.d)) and v = (mu/h) u x (e + d); the velocity after the
    impulse is level, in the final plane, and of the size that the vis-viva equation gives.
    """
    orbit = _orbit(s, pole(tilt), planar)
    sine, cosine = sincos(angle)
    d = added(scaled(cosine, orbit.node), scaled(sine, orbit.ahead))
    r = orbit.h * orbit.h / MU_EARTH / (1.0 + dot(orbit.e, d))
    before = scaled(MU_EARTH / orbit.h, cross(orbit.normal, added(orbit.e, d)))
    level = cross(pole(tilt), d)
    wanted = sqrt(maximum(MU_EARTH * (2.0 / r - 1.0 / radius), 0.0)) / norm(level)
    change = subtracted(scaled(wanted, level), before)
    size = norm(change)
    to = _over(change, size)
    return Impulse(wait=_wait(s, d, orbit, r), x=to.x, y=to.y, z=to.z, size=size)


@physics
def known(s, p):
    """Place [m] and velocity [m/s] as navigation knows them: the true ones and its errors along the true local axes."""
    h = cross(s, velocity(s))
    n, r = _over(h, norm(h)), _over(s, norm(s))
    t = cross(n, r)
    place = added_scaled(s, p.navigation_position_r, r)
    place = added_scaled(added_scaled(place, p.navigation_position_t, t), p.navigation_position_n, n)
    v = added_scaled(velocity(s), p.navigation_velocity_r, r)
    v = added_scaled(added_scaled(v, p.navigation_velocity_t, t), p.navigation_velocity_n, n)
    return Place(x=place.x, y=place.y, z=place.z, vx=v.x, vy=v.y, vz=v.z)


@physics
def _wait(s, d, orbit, r):
    """Time [s] from the state s to the direction d, at r [m], less than a revolution: Kepler's equation (21)."""
    e2 = dot(orbit.e, orbit.e)
    a = orbit.h * orbit.h / MU_EARTH / (1.0 - e2)
    root = sqrt(maximum(a, 0.0) * MU_EARTH)
    across = dot(cross(orbit.normal, orbit.e), d)  # e sin f
    level = sqrt(maximum(1.0 - e2, 0.0))
    # e sin E = r e sin f / (a sqrt(1 - e^2)); e cos E = 1 - r / a
    sine1, sine0 = r * across / (a * level), dot(s, velocity(s)) / root
    m1 = atan2(sine1, 1.0 - r / a) - sine1
    m0 = atan2(sine0, 1.0 - norm(s) / a) - sine0
    turns = (m1 - m0) / (2.0 * np.pi)
    return (turns - floor(turns)) * (2.0 * np.pi) * a * a / root


@physics
def _commanded(row, sensed, o):
    """Speed change [m/s] at which the command is due: a nominal tail-off makes up for the rest.

    Derived here: its flow falls linearly, so it spends half of flow times its duration; rocket equation.
    """
    return sensed - o.thrust / o.mass_flow * log(1.0 + 0.5 * o.mass_flow * o.tail_off / row.end_mass)


@physics
def of_burn(burn, first, second, third):
    """The value that belongs to a burn, counted from 0, in its own unit."""
    return where(burn < 0.5, first, where(burn < 1.5, second, third))


@physics
def stored(burn, p, o):
    """The aim of a burn that is flown as stored, SI."""
    to, row = nominal(o.tables), burn_row(o.tables, burn)
    ignition = of_burn(burn, 0.0, p.ignition_2, p.ignition_3)
    return Aim(x=to.x, y=to.y, z=to.z, stretch=1.0, sensed=_commanded(row, row.sensed, o), ignition=ignition)


@physics
def next_aim(t, s, burn, p, o):
    """The aim [1, m/s, s] of the next burn, as a coast begins: as stored, or of the last burn, if guided, aimed now."""
    aim = stored(burn, p, o)
    if o.guidance == CHOICES.guidance.re_aimed:
        aim = where(burn + 1.0 >= nominal(o.tables).burns, _aimed(t, known(s, p), burn, p, o), aim)
    return aim


@physics
def _aimed(t, s, burn, p, o):
    """The aim of the last burn from the state s [m, m/s] at which a coast begins at the time t [s].

    The stored speed change is altered by what the impulse of this flight is larger than the nominal one; the burn's
    duration follows from the rocket equation, and its middle is put where the impulse is.
    """
    row, planned = burn_row(o.tables, burn), nominal(o.tables)
    to = impulse_at(s, planned.angle, o.final_inclination, o.final_radius, planned.planar)
    sensed = maximum(row.sensed + to.size - planned.size, 1.0)
    exhaust = o.thrust / o.mass_flow
    mass = row.end_mass + o.mass_flow * row.duration
    duration = mass / o.mass_flow * (1.0 - exp(-sensed / exhaust))
    delay = of_burn(burn, p.ignition_delay_1, p.ignition_delay_2, p.ignition_delay_3)
    ignition = maximum(t + to.wait - 0.5 * duration + delay, t)
    stretch, sensed = duration / row.duration, _commanded(row, sensed, o)
    return Aim(x=to.x, y=to.y, z=to.z, stretch=stretch, sensed=sensed, ignition=ignition)


@physics
def turned(steering, aim, o):
    """The steering turned by the least rotation [rad] from the nominal impulse to the aimed one: Rodrigues's rule."""
    a = nominal(o.tables)
    w = cross(a, aim)
    k = 1.0 / maximum(1.0 + a.x * aim.x + a.y * aim.y + a.z * aim.z, 1e-9)
    return Steering(
        x=_combined(steering, 1.0 - k * (w.y * w.y + w.z * w.z), k * w.x * w.y - w.z, k * w.x * w.z + w.y),
        y=_combined(steering, k * w.x * w.y + w.z, 1.0 - k * (w.x * w.x + w.z * w.z), k * w.y * w.z - w.x),
        z=_combined(steering, k * w.x * w.z - w.y, k * w.y * w.z + w.x, 1.0 - k * (w.x * w.x + w.y * w.y)),
    )


@physics
def _combined(c, a, b, d):
    """a x + b y + d z of every power of the steering, without unit."""
    return Polynomial(
        c0=a * c.x.c0 + b * c.y.c0 + d * c.z.c0,
        c1=a * c.x.c1 + b * c.y.c1 + d * c.z.c1,
        c2=a * c.x.c2 + b * c.y.c2 + d * c.z.c2,
        c3=a * c.x.c3 + b * c.y.c3 + d * c.z.c3,
        c4=a * c.x.c4 + b * c.y.c4 + d * c.z.c4,
        c5=a * c.x.c5 + b * c.y.c5 + d * c.z.c5,
        c6=a * c.x.c6 + b * c.y.c6 + d * c.z.c6,
        c7=a * c.x.c7 + b * c.y.c7 + d * c.z.c7,
        c8=a * c.x.c8 + b * c.y.c8 + d * c.z.c8,
        c9=a * c.x.c9 + b * c.y.c9 + d * c.z.c9,
        c10=a * c.x.c10 + b * c.y.c10 + d * c.z.c10,
        c11=a * c.x.c11 + b * c.y.c11 + d * c.z.c11,
    )


def nominal_impulse(program: Program) -> Nominal:
    """What the table keeps of the nominal last burn [m/s, rad]."""
    sequence, (*_, before, last) = program.sequence, program.burns
    state, tilt = Place(*before.end), sequence.final_inclination
    across = cross(pole(tilt), _orbit(state, pole(tilt), 0.0).normal)
    planar = float(norm(across) < PLANAR)
    orbit = _orbit(state, pole(tilt), planar)
    wait = last.ignition_s + 0.5 * last.duration_s - before.ignition_s - before.duration_s
    place, speed = np.reshape(before.end, (2, 1, 3))
    times = np.array([wait]) / sequence.time_unit
    middle = kepler(place / sequence.parking_radius, speed / sequence.speed_unit, times)[0][0]
    angle = float(np.arctan2(middle @ np.array(orbit.ahead), middle @ np.array(orbit.node)))
    to = impulse_at(state, angle, tilt, sequence.final_radius, planar)
    return Nominal(burns=len(program.burns), x=to.x, y=to.y, z=to.z, size=to.size, angle=angle, planar=planar)
