"""The closed loop: the last burn is aimed again when the one before it has ended.

An impulse stands for the last burn.  It is put where the coast crosses the same angle from the node as the middle of
the nominal burn (planar: from the perigee), and gives the speed that makes the orbit there equatorial, level and of the
geostationary semi-major axis.  Against the impulse of the nominal flight it tells by how much the stored program is to
be turned, lengthened and shifted.  So the flight without errors is the stored program itself, and an error is met to
first order: drift and inclination go to zero, what remains is an eccentricity, which one burn cannot remove.
Place and velocity are known but for the navigation's errors; mass and engine are taken for nominal.
"""

from collections import namedtuple

import numpy as np

from campaigns.geo_injection.design.coast import kepler
from campaigns.geo_injection.design.program import Program
from campaigns.geo_injection.program_table import AIM, burn_row
from mc_engine.lanes import atan2, exp, floor, look_up, maximum, physics, sincos, sqrt, where
from mc_engine.physics.constants import MU_EARTH

Aim = namedtuple("Aim", "x y z stretch sensed ignition")  # unit vector; of the duration; speed change; time
Impulse = namedtuple("Impulse", "wait x y z size")  # wait: time to it
Place = namedtuple("Place", "x y z vx vy vz")

PLANAR = 1e-3  # sine of a tilt to the final plane below which the orbit before the last burn has no node to speak of


@physics
def _cross(ax, ay, az, bx, by, bz):
    """Vector product a x b; SI."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@physics
def _axes(s, tilt_sin, tilt_cos, planar):
    """(n, q, u, e, h) of the orbit through the state s [m, m/s].

    n : unit vector to the node on the final plane (planar: to perigee);  q : a quarter revolution ahead;  u : normal
    e : eccentricity vector;  h : angular momentum [m^2/s].  Curtis, 3rd ed., algorithm 4.2.
    """
    hx, hy, hz = _cross(s.x, s.y, s.z, s.vx, s.vy, s.vz)
    h = sqrt(hx * hx + hy * hy + hz * hz)
    ux, uy, uz = hx / h, hy / h, hz / h
    r = sqrt(s.x * s.x + s.y * s.y + s.z * s.z)
    cx, cy, cz = _cross(s.vx, s.vy, s.vz, hx, hy, hz)
    ex, ey, ez = cx / MU_EARTH - s.x / r, cy / MU_EARTH - s.y / r, cz / MU_EARTH - s.z / r
    # the final orbit's normal is (0, -sin, cos) of its inclination
    nx, ny, nz = _cross(0.0 * h, -tilt_sin + 0.0 * h, tilt_cos + 0.0 * h, ux, uy, uz)
    in_plane = planar > 0.5
    nx, ny, nz = where(in_plane, ex, nx), where(in_plane, ey, ny), where(in_plane, ez, nz)
    n = maximum(sqrt(nx * nx + ny * ny + nz * nz), 1e-300)
    nx, ny, nz = nx / n, ny / n, nz / n
    qx, qy, qz = _cross(ux, uy, uz, nx, ny, nz)
    return (nx, ny, nz), (qx, qy, qz), (ux, uy, uz), (ex, ey, ez), h


@physics
def impulse_at(s, angle, tilt, radius, planar):
    """The impulse [s, m/s] on the coast from the state s at an angle [rad] from its node (planar: perigee).

    tilt : inclination of the final orbit [rad];  radius : of it, and the semi-major axis that is wanted [m]

    Derived here: in the direction d, r = h^2 / (mu (1 + e.d)) and v = (mu/h) u x (e + d); the velocity after the
    impulse is level, in the final plane, and of the size that the vis-viva equation gives.
    """
    tilt_sin, tilt_cos = sincos(tilt + 0.0 * s.x)
    n, q, u, e, h = _axes(s, tilt_sin, tilt_cos, planar)
    sine, cosine = sincos(angle + 0.0 * s.x)
    dx, dy, dz = cosine * n[0] + sine * q[0], cosine * n[1] + sine * q[1], cosine * n[2] + sine * q[2]
    along = e[0] * dx + e[1] * dy + e[2] * dz
    r = h * h / MU_EARTH / (1.0 + along)
    vx, vy, vz = _cross(u[0], u[1], u[2], e[0] + dx, e[1] + dy, e[2] + dz)
    k = MU_EARTH / h
    lx, ly, lz = _cross(0.0 * h, -tilt_sin, tilt_cos, dx, dy, dz)
    wanted = sqrt(maximum(MU_EARTH * (2.0 / r - 1.0 / radius), 0.0)) / sqrt(lx * lx + ly * ly + lz * lz)
    cx, cy, cz = wanted * lx - k * vx, wanted * ly - k * vy, wanted * lz - k * vz
    size = sqrt(cx * cx + cy * cy + cz * cz)
    return Impulse(_wait(s, dx, dy, dz, u, e, along, r, h), cx / size, cy / size, cz / size, size)


@physics
def known(s, p):
    """Place [m] and velocity [m/s] as navigation knows them: the true ones and its errors along the true local axes."""
    hx, hy, hz = _cross(s.x, s.y, s.z, s.vx, s.vy, s.vz)
    h = sqrt(hx * hx + hy * hy + hz * hz)
    r = sqrt(s.x * s.x + s.y * s.y + s.z * s.z)
    nx, ny, nz = hx / h, hy / h, hz / h
    rx, ry, rz = s.x / r, s.y / r, s.z / r
    tx, ty, tz = _cross(nx, ny, nz, rx, ry, rz)
    return Place(
        s.x + p.known_r * rx + p.known_t * tx + p.known_n * nx,
        s.y + p.known_r * ry + p.known_t * ty + p.known_n * ny,
        s.z + p.known_r * rz + p.known_t * tz + p.known_n * nz,
        s.vx + p.known_vr * rx + p.known_vt * tx + p.known_vn * nx,
        s.vy + p.known_vr * ry + p.known_vt * ty + p.known_vn * ny,
        s.vz + p.known_vr * rz + p.known_vt * tz + p.known_vn * nz,
    )


@physics
def _wait(s, dx, dy, dz, u, e, along, r, h):
    """Time [s] from the state s to the direction d on its ellipse, less than a revolution: Kepler's equation (21)."""
    r0 = sqrt(s.x * s.x + s.y * s.y + s.z * s.z)
    e2 = e[0] * e[0] + e[1] * e[1] + e[2] * e[2]
    a = h * h / MU_EARTH / (1.0 - e2)
    root = sqrt(maximum(a, 0.0) * MU_EARTH)
    vx, vy, vz = _cross(u[0], u[1], u[2], e[0], e[1], e[2])
    across = vx * dx + vy * dy + vz * dz  # e sin f, as `along` is e cos f
    level = sqrt(maximum(1.0 - e2, 0.0))
    # e sin E = r e sin f / (a sqrt(1 - e^2)); e cos E = 1 - r / a
    sine1, sine0 = r * across / (a * level), (s.x * s.vx + s.y * s.vy + s.z * s.vz) / root
    m1 = atan2(sine1, 1.0 - r / a) - sine1
    m0 = atan2(sine0, 1.0 - r0 / a) - sine0
    turns = (m1 - m0) / (2.0 * np.pi)
    return (turns - floor(turns)) * (2.0 * np.pi) * a * a / root


@physics
def stored(burn, o):
    """The aim of a burn that is flown as stored, SI; its ignition is set elsewhere."""
    row = burn_row(o.tables, burn)
    zero = 0.0 * burn
    x, y, z = look_up(o.tables, AIM + zero), look_up(o.tables, AIM + 1.0 + zero), look_up(o.tables, AIM + 2.0 + zero)
    return Aim(x, y, z, 1.0 + zero, row.sensed, row.ignition)


@physics
def aimed(t, s, burn, o):
    """The aim of the last burn from the state s [m, m/s] at which a coast begins at the time t [s].

    The stored speed change is altered by what the impulse of this flight is larger than the nominal one; the burn's
    duration follows from the rocket equation, and its middle is put where the impulse is.
    """
    row, zero = burn_row(o.tables, burn), 0.0 * burn
    size, angle = look_up(o.tables, AIM + 3.0 + zero), look_up(o.tables, AIM + 4.0 + zero)
    impulse = impulse_at(s, angle, o.final_inclination, o.final_radius, look_up(o.tables, AIM + 5.0 + zero))
    sensed = maximum(row.sensed + impulse.size - size, 1.0)
    exhaust = o.thrust / o.mass_flow
    mass = row.end_mass + o.mass_flow * row.duration
    duration = mass / o.mass_flow * (1.0 - exp(-sensed / exhaust))
    return Aim(impulse.x, impulse.y, impulse.z, duration / row.duration, sensed, t + impulse.wait - 0.5 * duration)


@physics
def turned(steering, aim, o):
    """The steering turned by the least rotation [rad] from the nominal impulse to the aimed one: Rodrigues's rule."""
    zero = 0.0 * aim.x
    a = look_up(o.tables, AIM + zero), look_up(o.tables, AIM + 1.0 + zero), look_up(o.tables, AIM + 2.0 + zero)
    wx, wy, wz = _cross(a[0], a[1], a[2], aim.x, aim.y, aim.z)
    k = 1.0 / maximum(1.0 + a[0] * aim.x + a[1] * aim.y + a[2] * aim.z, 1e-9)
    xx, xy, xz = 1.0 - k * (wy * wy + wz * wz), k * wx * wy - wz, k * wx * wz + wy
    yx, yy, yz = k * wx * wy + wz, 1.0 - k * (wx * wx + wz * wz), k * wy * wz - wx
    zx, zy, zz = k * wx * wz - wy, k * wy * wz + wx, 1.0 - k * (wx * wx + wy * wy)
    return (*_combined(steering, xx, xy, xz), *_combined(steering, yx, yy, yz), *_combined(steering, zx, zy, zz))


@physics
def _combined(c, a, b, d):
    """a x + b y + d z of every power of the steering, dimensionless."""
    return (
        a * c[0] + b * c[12] + d * c[24],
        a * c[1] + b * c[13] + d * c[25],
        a * c[2] + b * c[14] + d * c[26],
        a * c[3] + b * c[15] + d * c[27],
        a * c[4] + b * c[16] + d * c[28],
        a * c[5] + b * c[17] + d * c[29],
        a * c[6] + b * c[18] + d * c[30],
        a * c[7] + b * c[19] + d * c[31],
        a * c[8] + b * c[20] + d * c[32],
        a * c[9] + b * c[21] + d * c[33],
        a * c[10] + b * c[22] + d * c[34],
        a * c[11] + b * c[23] + d * c[35],
    )


def nominal_aim(program: Program) -> np.ndarray:
    """float64[6] for the table: direction and size of the nominal impulse, its angle, and whether that is planar."""
    sequence, last = program.sequence, program.burns[-1]
    state = Place(*(float(number) for number in program.burns[-2].end))
    tilt = sequence.final_inclination
    tilt_sin, tilt_cos = np.sin(tilt), np.cos(tilt)
    normal = np.cross(state[:3], state[3:]) / np.linalg.norm(np.cross(state[:3], state[3:]))
    planar = float(np.linalg.norm(np.cross([0.0, -tilt_sin, tilt_cos], normal)) < PLANAR)
    n, q, *_ = _axes(state, tilt_sin, tilt_cos, planar)
    unit, speed = sequence.parking_radius, sequence.speed_unit
    before = program.burns[-2]
    wait = (last.ignition + 0.5 * last.duration - before.ignition - before.duration) / sequence.time_unit
    middle, _ = kepler(np.array([state[:3]]) / unit, np.array([state[3:]]) / speed, np.array([wait]))
    angle = float(np.arctan2(middle[0] @ np.array(q), middle[0] @ np.array(n)))
    impulse = impulse_at(state, angle, tilt, sequence.final_radius, planar)
    return np.array([impulse.x, impulse.y, impulse.z, impulse.size, angle, planar])
