"""Flight of the de-orbit craft: gravity, disturbances, feedback linearization, thrusters, pulses.

Inertial axes (x to the ascending node, z to the north pole), SI.  Numbers in brackets are equations of
S. Divsalar, R. Nadafi, M. Kabganian, Electronics Industries Quarterly 7(1), 2016.

The state is the deviation from the desired path, not the place itself (Encke's form): the thrust is a small
difference of large numbers, and within a Runge-Kutta step two places taken apart would feign a difference.
"""

from collections import namedtuple

from campaigns.deorbit.elements import osculating
from mc_engine.lanes import any_lane, exp, physics, sincos, sqrt, where
from mc_engine.lanes.noise import normal_pair
from mc_engine.physics.atmosphere import layered
from mc_engine.physics.constants import EARTH_RATE, EQUATORIAL_RADIUS, MU_EARTH
from mc_engine.physics.frames import half_turn
from mc_engine.physics.gravity import j2_perturbation, point_mass
from mc_engine.physics.pulse_modulators import lag_rate

# x to vz: deviation of position and velocity; f_desired: true anomaly of the place on the desired path;
# impulse: S; filtered: output of the modulator's lag
State = namedtuple("State", "x y z vx vy vz f_desired impulse filtered")
# navigation error held since the last fix, along R, T, N of the desired path; modulator; one over the first error
# of each element
Memory = namedtuple("Memory", "r_r r_t r_n v_r v_t v_n on pulses a_scale e_scale omega_scale")
Parameters = namedtuple(
    "Parameters",
    "x y z vx vy vz f_desired "  # first state: deviation just after the burn
    "px py pz qx qy qz p e "  # desired path: unit vectors to perigee and 90 deg on; semi-latus rectum; eccentricity
    "a omega "  # desired semi-major axis and argument of perigee
    "theta_burn dv alpha duration "  # planned burn: argument of latitude, size, angle; time from it to entry
    "gain mass exhaust limit thrust_factor ballistic radius delay greenwich "
    "misled bias_r bias_t bias_n bias_vr bias_vt bias_vn noise_position noise_velocity "
    "input_gain feedback_gain time_constant on off",
)
Events = namedtuple("Events", "entry pulse_on pulse_off")
Desired = namedtuple("Desired", "x y z vx vy vz ax ay az rx ry rz tx ty tz rate")

# settings arrive as numbers: places in the lists of words of `model.py`
CONTINUOUS, CLIPPED, PULSED, OFF = 0.0, 1.0, 2.0, 3.0
FEED_CONTINUOUS = 0.0
BURNING = 1.0


@physics
def initial(p, o):
    """State just after the burn."""
    return State(
        x=p.x, y=p.y, z=p.z, vx=p.vx, vy=p.vy, vz=p.vz,
        f_desired=p.f_desired, impulse=0.0, filtered=0.0,
    )  # fmt: skip


@physics
def element_errors(s, p):
    """Flown less desired (a [m], e, omega [rad, within half a turn])."""
    x, y, z, vx, vy, vz = flown(s, desired_motion(s.f_desired, p))
    a, e, omega = osculating(x, y, z, vx, vy, vz)
    return a - p.a, e - p.e, half_turn(omega - p.omega)


@physics
def inverse(first, scale):
    """1 / first, and 0 where the first error is nothing but rounding: below 1e-9 of the element's scale."""
    known = abs(first) > 1e-9 * scale
    return where(known, 1.0 / where(known, first, 1.0), 0.0)


@physics
def start(p, o):
    """Navigation errors are the constant ones until the first fix; the thruster is off."""
    a, e, omega = element_errors(initial(p, o), p)
    return Memory(
        r_r=p.bias_r, r_t=p.bias_t, r_n=p.bias_n, v_r=p.bias_vr, v_t=p.bias_vt, v_n=p.bias_vn,
        on=0.0, pulses=0.0,
        a_scale=inverse(a, p.a), e_scale=inverse(e, 1.0), omega_scale=inverse(omega, 1.0),
    )  # fmt: skip


@physics
def fix_position(t, s, m, p, o, draws):
    """A new navigation fix: constant error plus a fresh normal deviate on every component [m, m/s along R, T, N]."""
    k, w = p.noise_position, p.noise_velocity
    n1 = n2 = n3 = n4 = n5 = n6 = 0.0 * k
    if any_lane(k + w > 0.0):  # without noise the deviates would be multiplied by zero: save them
        n1, n2 = normal_pair(draws, 0)
        n3, n4 = normal_pair(draws, 1)
        n5, n6 = normal_pair(draws, 2)
    r_r, r_t, r_n = p.bias_r + k * n1, p.bias_t + k * n2, p.bias_n + k * n3
    v_r, v_t, v_n = p.bias_vr + w * n4, p.bias_vt + w * n5, p.bias_vn + w * n6
    return Memory(
        r_r=r_r, r_t=r_t, r_n=r_n, v_r=v_r, v_t=v_t, v_n=v_n,
        on=m.on, pulses=m.pulses,
        a_scale=m.a_scale, e_scale=m.e_scale, omega_scale=m.omega_scale,
    )  # fmt: skip


@physics
def desired_motion(f, p):
    """Where the craft should be: position, velocity, acceleration, unit vectors R and T, rate of f.  (31)-(38)"""
    s, c = sincos(f)
    u = (1.0 + p.e * c) * (1.0 / p.p)  # 1/r; what is inverted here stays the same all the flight
    r = 1.0 / u
    h = sqrt(MU_EARTH * p.p)
    rx, ry, rz = c * p.px + s * p.qx, c * p.py + s * p.qy, c * p.pz + s * p.qz
    tx, ty, tz = c * p.qx - s * p.px, c * p.qy - s * p.py, c * p.qz - s * p.pz
    v_r, v_t = h * (p.e / p.p) * s, h * u  # (34)
    g = -MU_EARTH * (u * u)  # (35)
    return Desired(
        x=r * rx,
        y=r * ry,
        z=r * rz,
        vx=v_r * rx + v_t * tx,
        vy=v_r * ry + v_t * ty,
        vz=v_r * rz + v_t * tz,
        ax=g * rx,
        ay=g * ry,
        az=g * rz,
        rx=rx,
        ry=ry,
        rz=rz,
        tx=tx,
        ty=ty,
        tz=tz,
        rate=h * (u * u),  # (33)
    )


@physics
def flown(s, d):
    """Inertial position [m] and velocity [m/s]."""
    return d.x + s.x, d.y + s.y, d.z + s.z, d.vx + s.vx, d.vy + s.vy, d.vz + s.vz


@physics
def law(d, ex, ey, ez, wx, wy, wz, p, o):
    """Commanded acceleration [m/s^2] for these errors of position (e) and velocity (w).  (28)"""
    x, y, z = d.x + ex, d.y + ey, d.z + ez
    gx, gy, gz = point_mass(x, y, z, MU_EARTH)
    k = p.gain
    ux = d.ax - gx - 2.0 * k * wx - k * k * ex
    uy = d.ay - gy - 2.0 * k * wy - k * k * ey
    uz = d.az - gz - 2.0 * k * wz - k * k * ez
    if o.j2_feedforward:
        jx, jy, jz = j2_perturbation(x, y, z, MU_EARTH)
        ux, uy, uz = ux - jx, uy - jy, uz - jz
    return ux, uy, uz


@physics
def measured(s, d, m):
    """Errors of position [m] and velocity [m/s] as the navigation sees them, inertial axes.  (24), (25)

    Its own errors lie along R, T, N of the desired path and are added here; the source has none.
    """
    nx, ny, nz = d.ry * d.tz - d.rz * d.ty, d.rz * d.tx - d.rx * d.tz, d.rx * d.ty - d.ry * d.tx
    return (
        s.x + m.r_r * d.rx + m.r_t * d.tx + m.r_n * nx,
        s.y + m.r_r * d.ry + m.r_t * d.ty + m.r_n * ny,
        s.z + m.r_r * d.rz + m.r_t * d.tz + m.r_n * nz,
        s.vx + m.v_r * d.rx + m.v_t * d.tx + m.v_n * nx,
        s.vy + m.v_r * d.ry + m.v_t * d.ty + m.v_n * ny,
        s.vz + m.v_r * d.rz + m.v_t * d.tz + m.v_n * nz,
    )


@physics
def ideal_errors(t, p):
    """Errors that the exact law would have left by now: x = (x0 + (v0 + k x0) t) exp(-k t), the solution of (29)."""
    k, decay = p.gain, exp(-p.gain * t)
    bx, by, bz = p.vx + k * p.x, p.vy + k * p.y, p.vz + k * p.z
    return (
        (p.x + bx * t) * decay,
        (p.y + by * t) * decay,
        (p.z + bz * t) * decay,
        (p.vx - k * bx * t) * decay,
        (p.vy - k * by * t) * decay,
        (p.vz - k * bz * t) * decay,
    )


@physics
def craft_mass(s, p, o):
    """Mass [kg]: constant as in the source, or falling with the impulse.  (40)"""
    if o.mass_model == BURNING:
        mass = p.mass * exp(-s.impulse / p.exhaust)
    else:
        mass = p.mass
    return mass


@physics
def command(t, s, m, d, p, o):
    """Commanded force [N], components and size; zero when the control is off."""
    if o.control == PULSED and o.pulse_feed == FEED_CONTINUOUS:
        ex, ey, ez, wx, wy, wz = ideal_errors(t, p)
        ux, uy, uz = law(d, ex, ey, ez, wx, wy, wz, p, o)
    elif any_lane(p.misled > 0.0):
        ex, ey, ez, wx, wy, wz = measured(s, d, m)
        ux, uy, uz = law(d, ex, ey, ez, wx, wy, wz, p, o)
    else:  # the same numbers as with errors of zero, for half the work
        ux, uy, uz = law(d, s.x, s.y, s.z, s.vx, s.vy, s.vz, p, o)
    mass = craft_mass(s, p, o)
    if o.control == OFF:
        mass = 0.0 * mass
    return mass * ux, mass * uy, mass * uz, mass * sqrt(ux * ux + uy * uy + uz * uz)


@physics
def thrust(size, m, p, o):
    """(scale, force): what the thrusters make of a command of this size [N]; force [N] is the true one."""
    if o.control == CLIPPED:
        scale = where(size > p.limit, p.limit / where(size > 0.0, size, 1.0), 1.0)
    elif o.control == PULSED:
        scale = m.on * p.limit / where(size > 0.0, size, 1.0)
    else:
        scale = 1.0 + 0.0 * size
    scale = scale * p.thrust_factor
    return scale, scale * size


@physics
def disturbances(x, y, z, vx, vy, vz, p, o):
    """Acceleration [m/s^2] by oblateness and drag, as far as they are switched on."""
    ax, ay, az = 0.0 * x, 0.0 * y, 0.0 * z
    if o.j2:
        ax, ay, az = j2_perturbation(x, y, z, MU_EARTH)
    if o.drag:
        ux, uy = vx + EARTH_RATE * y, vy - EARTH_RATE * x
        speed = sqrt(ux * ux + uy * uy + vz * vz)
        h = sqrt(x * x + y * y + z * z) - EQUATORIAL_RADIUS
        k = -0.5 * layered(h) * speed / p.ballistic
        ax, ay, az = ax + k * ux, ay + k * uy, az + k * vz
    return ax, ay, az


@physics
def rhs(t, s, m, p, o):
    """Time derivative of the state: (2) less the desired acceleration (35), (33), and S' = |F|/m."""
    d = desired_motion(s.f_desired, p)
    x, y, z, vx, vy, vz = flown(s, d)
    gx, gy, gz = point_mass(x, y, z, MU_EARTH)
    fx, fy, fz, size = command(t, s, m, d, p, o)
    scale, force = thrust(size, m, p, o)
    inverse_mass = 1.0 / craft_mass(s, p, o)
    k = scale * inverse_mass
    ax, ay, az = disturbances(x, y, z, vx, vy, vz, p, o)
    if o.control == PULSED:
        filtered = lag_rate(s.filtered, size, m.on * p.limit, p.input_gain, p.feedback_gain, p.time_constant)
    else:
        filtered = 0.0 * size
    return State(
        x=s.vx,
        y=s.vy,
        z=s.vz,
        vx=gx - d.ax + ax + k * fx,
        vy=gy - d.ay + ay + k * fy,
        vz=gz - d.az + az + k * fz,
        f_desired=d.rate,
        impulse=force * inverse_mass,
        filtered=filtered,
    )


@physics
def events(t, s, m, p, o):
    """Entry interface as r^2 - R^2 [m^2]; Schmitt trigger of the modulator on its filtered input [N].

    M. J. Sidi, Spacecraft Dynamics and Control (1997), which the source follows.
    """
    x, y, z, _vx, _vy, _vz = flown(s, desired_motion(s.f_desired, p))
    above = x * x + y * y + z * z - p.radius * p.radius
    firing = m.on > 0.5
    return Events(above, where(firing, -1.0, s.filtered - p.on), where(firing, s.filtered - p.off, 1.0))


@physics
def switch(t, s, m, p, o, hit):
    """The trigger of the modulator turns: on counts a pulse.  M. J. Sidi, Spacecraft Dynamics and Control (1997)."""
    on = where(hit.pulse_on > 0.5, 1.0, where(hit.pulse_off > 0.5, 0.0, m.on))
    pulses = m.pulses + where(hit.pulse_on > 0.5, 1.0, 0.0)
    return s, Memory(
        r_r=m.r_r, r_t=m.r_t, r_n=m.r_n, v_r=m.v_r, v_t=m.v_t, v_n=m.v_n,
        on=on, pulses=pulses,
        a_scale=m.a_scale, e_scale=m.e_scale, omega_scale=m.omega_scale,
    )  # fmt: skip


@physics
def propellant(s, p):
    """Propellant [kg] spent for the impulse S so far.  (40)"""
    return p.mass * (1.0 - exp(-s.impulse / p.exhaust))
