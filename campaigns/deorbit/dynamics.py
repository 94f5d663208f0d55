"""Flight of the de-orbit craft: gravity, disturbances, feedback linearization, thrusters, pulses.

Inertial axes (x to the ascending node, z to the north pole), SI.  Numbers in brackets are equations of
S. Divsalar, R. Nadafi, M. Kabganian, Electronics Industries Quarterly 7(1), 2016.

The state is the deviation from the desired path, not the place itself (Encke's form): the thrust is a small
difference of large numbers, and within a Runge-Kutta step two places taken apart would feign a difference.
"""

from collections import namedtuple

from campaigns.deorbit.inputs import CHOICES
from mc_engine.lanes import any_lane, atan2, exp, merged, physics, replace, sincos, sqrt, where
from mc_engine.lanes.noise import normal_pair
from mc_engine.model import Event, states
from mc_engine.physics.atmosphere import layered
from mc_engine.physics.constants import EARTH_RATE, EQUATORIAL_RADIUS, MU_EARTH
from mc_engine.physics.frames import half_turn
from mc_engine.physics.gravity import j2_perturbation, point_mass
from mc_engine.physics.pulse_modulators import lag_rate
from mc_engine.physics.vectors import Vector, added, added_scaled, cross, dot, norm, scaled, subtracted

State = states(
    **{f"deviation_{axis}_m": f"inertial position less the desired one, {axis}" for axis in "xyz"},
    **{f"deviation_v{axis}_m_s": f"inertial velocity less the desired one, {axis}" for axis in "xyz"},
    f_desired_deg="true anomaly on the desired path",
    impulse_m_s="impulse S per mass",
    filtered_n="output of the modulator's lag",
)
# navigation errors held since the last fix, along R, T, N of the desired path; one over the first error of each
# element; modulator
Memory = namedtuple("Memory", "position_error velocity_error scale on pulses", defaults=(0.0, 0.0))
Elements = namedtuple("Elements", "a e omega")
Trigger = namedtuple("Trigger", "pulse_on pulse_off")
Desired = namedtuple("Desired", "position velocity acceleration radial transverse rate")


@physics
def initial(p):
    """State just after the burn."""
    return merged(State, p, impulse=0.0, filtered=0.0)


@physics
def deviation(s):
    """Flown less desired position [m] and velocity [m/s]; of the parameters, those just after the burn.  (24), (25)"""
    return Vector(s.deviation_x, s.deviation_y, s.deviation_z), Vector(s.deviation_vx, s.deviation_vy, s.deviation_vz)


@physics
def osculating(r, v):
    """(a [m], e, omega [rad]) of the orbit through an inertial position [m] and velocity [m/s].

    omega from the eccentricity vector's components along and across the node, by atan2: near-circular orbits
    keep all digits.  Curtis, Orbital Mechanics for Engineering Students, 3rd ed., algorithm 4.2.  An orbit in the
    equator has its node on x, as the desired path has.
    """
    w, u = dot(v, v) * (1.0 / MU_EARTH), 1.0 / norm(r)
    h, e = cross(r, v), subtracted(scaled(w - u, r), scaled(dot(r, v) * (1.0 / MU_EARTH), v))
    nx, ny = where((h.x == 0.0) & (h.y == 0.0), 1.0, -h.y), h.x  # node vector; across it in the plane lies h x node
    along = nx * e.x + ny * e.y
    across = h.z * (nx * e.y - ny * e.x) + (h.x * ny - h.y * nx) * e.z  # times h
    return Elements(a=1.0 / (2.0 * u - w), e=norm(e), omega=atan2(across, along * norm(h)))


@physics
def element_errors(s, p):
    """Flown less desired elements: a [m], e, omega [rad, within half a turn]."""
    r, v = flown(s, desired_motion(s.f_desired, p))
    at = osculating(r, v)
    return Elements(a=at.a - p.a, e=at.e - p.e, omega=half_turn(at.omega - p.omega))


@physics
def inverse(first, scale):
    """1 / first, in 1 / its unit; 0 where the first error is only rounding, below 1e-9 of the element's scale."""
    known = abs(first) > 1e-9 * scale
    return where(known, 1.0 / where(known, first, 1.0), 0.0)


@physics
def start(p):
    """Before the first navigation fix, which is at once; the thruster is off."""
    first, none = element_errors(initial(p), p), Vector(0.0, 0.0, 0.0)
    scale = Elements(a=inverse(first.a, p.a), e=inverse(first.e, 1.0), omega=inverse(first.omega, 1.0))
    return Memory(position_error=none, velocity_error=none, scale=scale)


@physics
def control(m, p, draws):
    """A new navigation fix: constant error plus a fresh normal deviate on every component [m, m/s along R, T, N]."""
    position = Vector(
        p.navigation_radial_position_error, p.navigation_transverse_position_error, p.navigation_normal_position_error
    )
    velocity = Vector(
        p.navigation_radial_velocity_error, p.navigation_transverse_velocity_error, p.navigation_normal_velocity_error
    )
    k, w = p.navigation_position_noise, p.navigation_velocity_noise
    if any_lane(k + w > 0.0):  # without noise the deviates would be multiplied by zero: save them
        n1, n2 = normal_pair(draws, 0)
        n3, n4 = normal_pair(draws, 1)
        n5, n6 = normal_pair(draws, 2)
        position = added_scaled(position, k, Vector(n1, n2, n3))
        velocity = added_scaled(velocity, w, Vector(n4, n5, n6))
    return replace(m, position_error=position, velocity_error=velocity)


@physics
def desired_motion(f, p):
    """Where the craft should be: position, velocity, acceleration, unit vectors R and T, rate of f.  (31)-(38)"""
    s, c = sincos(f)
    u = (1.0 + p.e * c) * (1.0 / p.p)  # 1/r; what is inverted here stays the same all the flight
    h = sqrt(MU_EARTH * p.p)
    to_perigee, ahead = Vector(p.px, p.py, p.pz), Vector(p.qx, p.qy, p.qz)
    radial = added_scaled(scaled(c, to_perigee), s, ahead)
    transverse = subtracted(scaled(c, ahead), scaled(s, to_perigee))
    return Desired(
        position=scaled(1.0 / u, radial),
        velocity=added_scaled(scaled(h * (p.e / p.p) * s, radial), h * u, transverse),  # (34)
        acceleration=scaled(-MU_EARTH * (u * u), radial),  # (35)
        radial=radial,
        transverse=transverse,
        rate=h * (u * u),  # (33)
    )


@physics
def flown(s, d):
    """Inertial position [m] and velocity [m/s]."""
    r, v = deviation(s)
    return added(d.position, r), added(d.velocity, v)


@physics
def law(d, e, w, p, o):
    """Commanded acceleration [m/s^2] for these errors of position, e, and velocity, w.  (28)"""
    r, k = added(d.position, e), p.gain
    free = subtracted(d.acceleration, Vector(*point_mass(r.x, r.y, r.z, MU_EARTH)))
    u = subtracted(subtracted(free, scaled(2.0 * k, w)), scaled(k * k, e))
    if o.j2_feedforward:
        u = subtracted(u, Vector(*j2_perturbation(r.x, r.y, r.z, MU_EARTH)))
    return u


@physics
def measured(e, rtn, d):
    """Error of position [m] or velocity [m/s] as the navigation sees it: e, and its own along R, T, N; inertial axes.

    The source's navigation has no errors.
    """
    normal = cross(d.radial, d.transverse)
    return added_scaled(added_scaled(added_scaled(e, rtn.x, d.radial), rtn.y, d.transverse), rtn.z, normal)


@physics
def ideal_errors(t, p):
    """Errors that the exact law would have left by now: x = (x0 + (v0 + k x0) t) exp(-k t), the solution of (29)."""
    x0, v0 = deviation(p)
    k, decay = p.gain, exp(-p.gain * t)
    b = added_scaled(v0, k, x0)
    return scaled(decay, added_scaled(x0, t, b)), scaled(decay, subtracted(v0, scaled(t, scaled(k, b))))


@physics
def craft_mass(s, p, o):
    """Mass [kg]: constant as in the source, or falling with the impulse.  (40)"""
    mass = p.initial_mass
    if o.mass_model == CHOICES.mass_model.burning:
        mass = mass * exp(-s.impulse / p.exhaust)
    return mass


@physics
def thrust(t, s, m, d, p, o):
    """(command, size, scale, force): the commanded force [N] as a vector, its size, and what the thrusters make of it.

    scale : of the true force over the commanded one;  force : size of the true one [N].  Zero when the control is off.
    """
    e, w = deviation(s)
    if o.control == CHOICES.control.pulsed and o.pulse_feed == CHOICES.pulse_feed.continuous:
        e, w = ideal_errors(t, p)
        u = law(d, e, w, p, o)
    elif any_lane(p.misled > 0.0):
        u = law(d, measured(e, m.position_error, d), measured(w, m.velocity_error, d), p, o)
    else:  # the same numbers as with errors of zero, for half the work
        u = law(d, e, w, p, o)
    mass = craft_mass(s, p, o)
    if o.control == CHOICES.control.off:
        mass = 0.0
    size, scale = mass * norm(u), 1.0
    if o.control == CHOICES.control.clipped:
        scale = where(size > p.thrust_limit, p.thrust_limit / where(size > 0.0, size, 1.0), 1.0)
    elif o.control == CHOICES.control.pulsed:
        scale = m.on * p.thrust_limit / where(size > 0.0, size, 1.0)
    scale = scale * p.thrust_factor
    return scaled(mass, u), size, scale, scale * size


@physics
def disturbances(r, v, p, o):
    """Acceleration [m/s^2] by oblateness and drag, as far as they are switched on."""
    a = Vector(0.0, 0.0, 0.0)
    if o.j2:
        a = Vector(*j2_perturbation(r.x, r.y, r.z, MU_EARTH))
    if o.drag:
        wind = Vector(v.x + EARTH_RATE * r.y, v.y - EARTH_RATE * r.x, v.z)
        k = -0.5 * layered(norm(r) - EQUATORIAL_RADIUS) * norm(wind) / p.ballistic_coefficient
        a = added_scaled(a, k, wind)
    return a


@physics
def rhs(t, s, m, p, o):
    """Time derivative of the state: (2) less the desired acceleration (35), (33), and S' = |F|/m."""
    d = desired_motion(s.f_desired, p)
    r, v = flown(s, d)
    gravity = Vector(*point_mass(r.x, r.y, r.z, MU_EARTH))  # (1) before the law, which need not compute it again
    command, size, scale, force = thrust(t, s, m, d, p, o)
    inverse_mass = 1.0 / craft_mass(s, p, o)
    free = added(subtracted(gravity, d.acceleration), disturbances(r, v, p, o))
    a = added_scaled(free, scale * inverse_mass, command)
    filtered = 0.0
    if o.control == CHOICES.control.pulsed:
        k_in, k_fb = p.modulator_input_gain, p.modulator_feedback_gain
        filtered = lag_rate(s.filtered, size, m.on * p.thrust_limit, k_in, k_fb, p.modulator_time_constant)
    return State(
        deviation_x=s.deviation_vx, deviation_y=s.deviation_vy, deviation_z=s.deviation_vz,
        deviation_vx=a.x, deviation_vy=a.y, deviation_vz=a.z,
        f_desired=d.rate, impulse=force * inverse_mass, filtered=filtered,
    )  # fmt: skip


@physics
def entry(s, p):
    """Entry interface as r^2 - R^2 [m^2]."""
    r, _ = flown(s, desired_motion(s.f_desired, p))
    return dot(r, r) - p.target_radius * p.target_radius


@physics
def trigger(s, m, p):
    """Filtered input [N] over the levels of the modulator's Schmitt trigger, each while it is looked for.

    M. J. Sidi, Spacecraft Dynamics and Control (1997), which the source follows.
    """
    on = m.on > 0.5
    off_level = where(on, s.filtered - p.modulator_off, 1.0)
    return Trigger(pulse_on=where(on, -1.0, s.filtered - p.modulator_on), pulse_off=off_level)


EVENTS = {
    "entry": Event(entry, "falling", "stop"),
    "pulse_on": Event(trigger, "rising", "switch", rare=True),
    "pulse_off": Event(trigger, "falling", "switch", rare=True),
}


@physics
def switch(s, m, hit):
    """The trigger turns: on counts a pulse."""
    on = where(hit.pulse_on > 0.5, 1.0, where(hit.pulse_off > 0.5, 0.0, m.on))
    return s, replace(m, on=on, pulses=m.pulses + hit.pulse_on)
