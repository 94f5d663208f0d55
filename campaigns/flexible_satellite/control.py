"""Sampled attitude control: the robust constrained PID, its torque limit, and what the thrusters make of it.

SI.  Numbers in brackets are equations of H. Taei, S. Ayati, S. F. Mousavi, Iranian Journal of Mechanical Engineering
24(3), 2022.  Everything is computed at a sample and held until the next, `o.step * o.steps_per_sample` later.
"""

from campaigns.flexible_satellite.dynamics import Memory, body_rate, initial, orbital_rate
from mc_engine.lanes import any_lane, physics, sqrt, where
from mc_engine.lanes.noise import normal_pair, uniform_pair
from mc_engine.physics.attitude import turned_slightly
from mc_engine.physics.pulse_modulators import Pulses, at_rest, sampled_pulses

# settings arrive as numbers: places in the lists of words of `model.py`
PWPF = 1.0
ORBITAL = 1.0
PER_SAMPLE = 1.0


@physics
def start(p, o):
    """Before the first sample: nothing fired, no torque [N m].

    The integral of (13) starts half a sample back, so that the first sample of the trapezoidal rule brings it to zero.
    """
    zero, calm, half = 0.0, at_rest(), -0.5 * o.step * o.steps_per_sample
    q1, q2, q3, wx, wy, wz = known(initial(p, o), p, o)
    return Memory(
        integral_x=half * (p.c1 * wx + p.c2 * q1), integral_y=half * (p.c1 * wy + p.c2 * q2),
        integral_z=half * (p.c1 * wz + p.c2 * q3),
        command_x=zero, command_y=zero, command_z=zero, torque_x=zero, torque_y=zero, torque_z=zero, body_x=zero,
        body_y=zero, body_z=zero,
        filtered_x=calm.filtered, output_x=calm.output, age_x=calm.age, pulses_x=calm.pulses, shortest_x=calm.shortest,
        filtered_y=calm.filtered, output_y=calm.output, age_y=calm.age, pulses_y=calm.pulses, shortest_y=calm.shortest,
        filtered_z=calm.filtered, output_z=calm.output, age_z=calm.age, pulses_z=calm.pulses, shortest_z=calm.shortest,
        next_x=zero, next_y=zero, next_z=zero, then_x=zero, then_y=zero, then_z=zero,
    )  # fmt: skip


@physics
def known(s, p, o):
    """Vector part of the attitude and the rate [rad/s] that the law works with, without errors."""
    wx, wy, wz = body_rate(s, p)
    if o.rate_used == ORBITAL:
        wx, wy, wz = orbital_rate(s, wx, wy, wz, p)
    return s.q1, s.q2, s.q3, wx, wy, wz


@physics
def measured(s, p, o, draws):
    """The same [1, rad/s] as the sensors give it, each axis with a fresh error; the source has perfect sensors."""
    q1, q2, q3, wx, wy, wz = known(s, p, o)
    if any_lane(p.rate_noise + p.attitude_noise > 0.0):
        n1, n2 = normal_pair(draws, 0)
        n3, n4 = normal_pair(draws, 1)
        n5, n6 = normal_pair(draws, 2)
        wx, wy, wz = wx + p.rate_noise * n1, wy + p.rate_noise * n2, wz + p.rate_noise * n3
        k = p.attitude_noise
        q1, q2, q3 = turned_slightly(s.q0, q1, q2, q3, k * n4, k * n5, k * n6)
    return q1, q2, q3, wx, wy, wz


@physics
def limited(x, y, z, limit):
    """The vector, shortened to `limit` where it is longer.  (15)"""
    size2 = x * x + y * y + z * z
    over = size2 > limit * limit
    if any_lane(over):
        scale = where(over, limit / sqrt(where(over, size2, 1.0)), 1.0)
        x, y, z = scale * x, scale * y, scale * z
    return x, y, z


@physics
def sign(x):
    """-1, 0 or 1."""
    return where(x > 0.0, 1.0, where(x < 0.0, -1.0, 0.0))


@physics
def law(q1, q2, q3, wx, wy, wz, ix, iy, iz, p):
    """Commanded torque [N m]; i is the integral of c1 w + c2 qv.  (11), (13)-(16)

    The source's (12) and (13) subtract different multiples of qv - qv(0) from the integral; `gamma` is the multiple.
    """
    fast = wx * wx + wy * wy + wz * wz >= p.rate_limit * p.rate_limit
    kp, kd, ki = where(fast, p.kp_fast, p.kp), where(fast, p.kd_fast, p.kd), where(fast, p.ki_fast, p.ki)
    x = -kd * wx - kp * q1 - ki * (ix - p.gamma * (q1 - p.q1))
    y = -kd * wy - kp * q2 - ki * (iy - p.gamma * (q2 - p.q2))
    z = -kd * wz - kp * q3 - ki * (iz - p.gamma * (q3 - p.q3))
    x, y, z = limited(x, y, z, p.torque_limit)
    if any_lane(p.dbar > 0.0):
        x = x - p.dbar * sign(p.beta * wx + p.lambda2 * q1)
        y = y - p.dbar * sign(p.beta * wy + p.lambda2 * q2)
        z = z - p.dbar * sign(p.beta * wz + p.lambda2 * q3)
    return x, y, z


@physics
def late(fired, coming, after, p):
    """(torque now, in the next sample, in the one after it) [N m] of an axis whose valves open and close late.

    coming, after : what earlier samples have left for this sample and for the next.  The shares now, next and then add
    to one, so that the impulse is kept; derived here.
    """
    return coming + p.now * fired, after + p.next * fired, p.then * fired


@physics
def control(t, s, m, p, o, draws):
    """One sample: measure, integrate by trapezoids (13), command a torque [N m] (11)-(16), fire (18)-(21)."""
    period = o.step * o.steps_per_sample
    q1, q2, q3, wx, wy, wz = measured(s, p, o, draws)
    nx, ny, nz = p.c1 * wx + p.c2 * q1, p.c1 * wy + p.c2 * q2, p.c1 * wz + p.c2 * q3
    half = 0.5 * period  # by trapezoids: m.integral is half a sample behind
    ix, iy, iz = m.integral_x + half * nx, m.integral_y + half * ny, m.integral_z + half * nz
    ux, uy, uz = law(q1, q2, q3, wx, wy, wz, ix, iy, iz, p)
    tx, ty, tz = ux, uy, uz
    x = Pulses(m.filtered_x, m.output_x, m.age_x, m.pulses_x, m.shortest_x)
    y = Pulses(m.filtered_y, m.output_y, m.age_y, m.pulses_y, m.shortest_y)
    z = Pulses(m.filtered_z, m.output_z, m.age_z, m.pulses_z, m.shortest_z)
    next_x, next_y, next_z, then_x, then_y, then_z = m.next_x, m.next_y, m.next_z, m.then_x, m.then_y, m.then_z
    if o.actuator == PWPF:
        x, y, z, fx, fy, fz = sampled_pulses(x, y, z, ux, uy, uz, p, period)
        tx, ty, tz = p.torque * fx, p.torque * fy, p.torque * fz
        if any_lane(p.now < 1.0):
            tx, next_x, then_x = late(tx, m.next_x, m.then_x, p)
            ty, next_y, then_y = late(ty, m.next_y, m.then_y, p)
            tz, next_z, then_z = late(tz, m.next_z, m.then_z, p)
    tx, ty, tz = p.thrust_x * tx, p.thrust_y * ty, p.thrust_z * tz
    offset = p.disturbance_offset
    if o.disturbance_draw == PER_SAMPLE:
        drawn, _ = uniform_pair(draws, 3)
        offset = (p.disturbance_offset - 0.5) + drawn
    steady = p.disturbance_amplitude * offset
    return Memory(
        integral_x=m.integral_x + period * nx, integral_y=m.integral_y + period * ny,
        integral_z=m.integral_z + period * nz,
        command_x=ux, command_y=uy, command_z=uz, torque_x=tx, torque_y=ty, torque_z=tz,
        body_x=p.axx * tx + p.axy * ty + p.axz * tz + steady,
        body_y=p.ayx * tx + p.ayy * ty + p.ayz * tz + steady,
        body_z=p.azx * tx + p.azy * ty + p.azz * tz + steady,
        filtered_x=x.filtered, output_x=x.output, age_x=x.age, pulses_x=x.pulses, shortest_x=x.shortest,
        filtered_y=y.filtered, output_y=y.output, age_y=y.age, pulses_y=y.pulses, shortest_y=y.shortest,
        filtered_z=z.filtered, output_z=z.output, age_z=z.age, pulses_z=z.pulses, shortest_z=z.shortest,
        next_x=next_x, next_y=next_y, next_z=next_z, then_x=then_x, then_y=then_y, then_z=then_z,
    )  # fmt: skip
