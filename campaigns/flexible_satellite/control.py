"""Sampled attitude control: the robust constrained PID, its torque limit, and what the thrusters make of it.

SI.  Numbers in brackets are equations of H. Taei, S. Ayati, S. F. Mousavi, Iranian Journal of Mechanical Engineering
24(3), 2022.  Everything is computed at a sample and held until the next, `o.step * o.steps_per_sample` later.
"""

from collections import namedtuple

from campaigns.flexible_satellite.dynamics import body_rate, initial
from campaigns.flexible_satellite.inputs import CHOICES
from mc_engine.lanes import any_lane, physics, replace, sqrt, where
from mc_engine.lanes.noise import normal_pair, uniform_pair
from mc_engine.physics.attitude import second_axis_in_body, turned_slightly
from mc_engine.physics.pulse_modulators import at_rest, sampled_pulses
from mc_engine.physics.vectors import Matrix, Vector, added, added_scaled, dot, matrix_times, scaled, subtracted

# integral of (13), half a sample behind; torques [N m]: asked for, of the actuators along their axes, on the body; the
# modulators of the axes; torques that late valves leave for the next sample and the one after
Memory = namedtuple("Memory", "integral command torque body x y z next then")


@physics
def start(p, o):
    """Before the first sample: nothing fired, no torque [N m].

    The integral of (13) starts half a sample back, so that the first sample of the trapezoidal rule brings it to zero.
    """
    none, calm = Vector(0.0, 0.0, 0.0), at_rest()
    q, w = known(initial(p), p, o)
    return Memory(
        integral=scaled(-0.5 * o.step * o.steps_per_sample, integrand(q, w, p)),
        command=none, torque=none, body=none, x=calm, y=calm, z=calm, next=none, then=none,
    )  # fmt: skip


@physics
def known(s, p, o):
    """Vector part of the attitude and the rate [rad/s] that the law works with, without errors."""
    w = body_rate(s, p)
    # relative to the orbital frame, which turns at -orbit_rate about its second axis (6)-(9)
    if o.rate_used == CHOICES.rate_used.orbital:
        w = added_scaled(w, p.orbit_rate, Vector(*second_axis_in_body(s.q0, s.q1, s.q2, s.q3)))
    return Vector(s.q1, s.q2, s.q3), w


@physics
def measured(s, p, o, draws):
    """The same [1, rad/s] as the sensors give it, each axis with a fresh error; the source has perfect sensors."""
    q, w = known(s, p, o)
    if any_lane(p.rate_noise + p.attitude_noise > 0.0):
        n1, n2 = normal_pair(draws, 0)
        n3, n4 = normal_pair(draws, 1)
        n5, n6 = normal_pair(draws, 2)
        w = added_scaled(w, p.rate_noise, Vector(n1, n2, n3))
        k = p.attitude_noise
        q = Vector(*turned_slightly(s.q0, q.x, q.y, q.z, k * n4, k * n5, k * n6))
    return q, w


@physics
def integrand(q, w, p):
    """c1 w + c2 qv of (13), q being the vector part of the attitude and w the rate [rad/s]."""
    return added_scaled(scaled(p.integral_rate_gain, w), p.integral_attitude_gain, q)


@physics
def sign(x):
    """-1, 0 or 1."""
    return where(x > 0.0, 1.0, where(x < 0.0, -1.0, 0.0))


@physics
def law(q, w, integral, p):
    """Commanded torque [N m] for the vector part of the attitude q and the rate w [rad/s].  (11), (13)-(16)

    The source's (12) and (13) subtract different multiples, here `integral_gamma`, of qv - qv(0) from the integral.
    """
    fast = dot(w, w) >= p.rate_limit * p.rate_limit
    kp, kd, ki = where(fast, p.kp_fast, p.kp), where(fast, p.kd_fast, p.kd), where(fast, p.ki_fast, p.ki)
    turned = subtracted(q, Vector(p.q1, p.q2, p.q3))
    integral = added_scaled(integral, -p.integral_gamma, turned)
    u = subtracted(subtracted(scaled(-kd, w), scaled(kp, q)), scaled(ki, integral))
    size2 = dot(u, u)
    over = size2 > p.torque_limit * p.torque_limit
    if any_lane(over):  # (15): shortened to the limit
        u = scaled(where(over, p.torque_limit / sqrt(where(over, size2, 1.0)), 1.0), u)
    if any_lane(p.dbar > 0.0):
        v = added_scaled(scaled(p.switching_rate_gain, w), p.switching_attitude_gain, q)
        u = added_scaled(u, -p.dbar, Vector(sign(v.x), sign(v.y), sign(v.z)))
    return u


@physics
def control(s, m, p, o, draws):
    """One sample: measure, integrate by trapezoids (13), command a torque [N m] (11)-(16), fire (18)-(21)."""
    period = o.step * o.steps_per_sample
    q, w = measured(s, p, o, draws)
    n = integrand(q, w, p)
    integral = added_scaled(m.integral, 0.5 * period, n)  # by trapezoids: m.integral is half a sample behind
    command = law(q, w, integral, p)
    torque = command
    if o.actuator == CHOICES.actuator.pwpf:
        x, y, z, fx, fy, fz = sampled_pulses(m.x, m.y, m.z, command.x, command.y, command.z, p, period)
        m, fired = replace(m, x=x, y=y, z=z), scaled(p.torque, Vector(fx, fy, fz))
        torque = fired
        if any_lane(p.now < 1.0):  # late valves: the shares now, next and then add to one, derived here
            torque = added_scaled(m.next, p.now, fired)
            m = replace(m, next=added_scaled(m.then, p.next, fired), then=scaled(p.then, fired))
    torque = Vector(p.thrust_x_factor * torque.x, p.thrust_y_factor * torque.y, p.thrust_z_factor * torque.z)
    offset = p.disturbance_offset
    if o.disturbance_draw == CHOICES.disturbance_draw.sample:
        drawn, _ = uniform_pair(draws, 3)
        offset = (p.disturbance_offset - 0.5) + drawn
    steady = p.disturbance_amplitude * offset
    body_from_thrusters = Matrix(p.axx, p.axy, p.axz, p.ayx, p.ayy, p.ayz, p.azx, p.azy, p.azz)
    body = added(matrix_times(body_from_thrusters, torque), Vector(steady, steady, steady))
    return replace(m, integral=added_scaled(m.integral, period, n), command=command, torque=torque, body=body)
