"""Execution of a commanded bank angle, and the side that the lift is on.

The bank follows its command like a critically damped second-order lag, not faster than a limit.  Commands are held
from sample to sample, so its course over a sample is known: between samples the flight reads it off a cubic.
"""

from mc_engine.lanes import exp, maximum, minimum, physics, where
from mc_engine.physics.vectors import Vector, cross, dot, norm


@physics
def followed(bank, rate, command, lag, limit, period):
    """(bank [rad], its rate [rad/s]) one sample later.

    lag : time [s] by which a slow command is followed late, 0 for at once;  limit : of the rate [rad/s]
    x'' = -2 w x' - w^2 x for x = bank - command, with w = 2 / lag.
    """
    slow = lag > 0.0
    w = 2.0 / where(slow, lag, 1.0)
    x, decay = bank - command, exp(-w * period)
    lean = rate + w * x
    later = minimum(maximum((rate - w * lean * period) * decay, -limit), limit)
    # the cubic's rate half way, 1.5 change / period - (rate + later) / 4, keeps the limit too
    ends = 0.25 * (rate + later)
    change = command + (x + lean * period) * decay - bank
    change = minimum(maximum(change, (ends - limit) * (period / 1.5)), (ends + limit) * (period / 1.5))
    return where(slow, bank + change, command), where(slow, later, 0.0)


@physics
def angle_at(t, m, period):
    """Bank [rad] at a time t within the sample that the memory m is of: Hermite's cubic."""
    x = (t - m.sampled) / period
    change = m.next_bank - m.bank
    a, b = m.bank_rate * period - change, change - m.next_rate * period
    return m.bank + x * (change + (1.0 - x) * (a * (1.0 - x) + b * x))


@physics
def lateral_miss(s, p):
    """Distance [m] to the right of the target at which the plane of the present motion passes it."""
    right = cross(Vector(s.vx, s.vy, s.vz), s)
    size = norm(right)
    return -p.radius * dot(right, Vector(p.tx, p.ty, p.tz)) / where(size > 0.0, size, 1.0)


@physics
def side_of(side, miss, speed, p):
    """Side of the lift, 1 right or -1 left: away from where it is only if the lateral miss leaves its band.

    The band falls with the square of the speed, as does what is left of the lateral reach: R. Morth, R-532 (1966).
    """
    share = speed * (1.0 / p.relative_speed)
    band = p.reversal_floor + p.reversal_width * share * share
    return where(miss > band, -1.0, where(miss < -band, 1.0, side))
