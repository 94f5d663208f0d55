"""The guidance laws: from what the vehicle senses, once a sample, to the bank that it commands.

Law 1 has a complete navigation system and tracks altitude, flight-path angle and range over the speed.  Law 2 knows
speed, drag and altitude rate, and the range if it is "law2r".  Law 3 has one accelerometer along the body axis and a
clock, and reckons the range by them if it is "law3r".  "apollo" is the final phase of the Apollo guidance.  All
command the vertical share u = cos(bank) of the lift; roll relative to the vertical is known to all of them.
"""

from collections import namedtuple

from campaigns.reentry.bank import followed, lateral_miss, side_of
from campaigns.reentry.dynamics import Reckoning, Steering, Turn, exposure_of, from_planned_entry, velocity
from campaigns.reentry.guidance import reference_table as stored
from campaigns.reentry.inputs import CHOICES
from mc_engine.lanes import acos, any_lane, asin, atan2, log, maximum, minimum, physics, replace, where
from mc_engine.lanes.noise import normal_pair
from mc_engine.physics.aerodynamics import axial_coefficient
from mc_engine.physics.vectors import dot, norm

LEAST_SHARE = -0.9659258262890683  # cos 165 deg: never quite lift down
SCALE_HEIGHT = 7000.0  # m, by which drag is read as altitude
LARGEST_CLIMB, LARGEST_TILT = 6000.0, 0.03490658503988659  # 6 km and 2 deg: bounds of what drag is read as

# speed, altitude, flight-path angle, range, altitude rate: as navigated; drag, axial: decelerations as measured;
# load: total over axial load of the present trim, and total load over drag
Sensed = namedtuple("Sensed", "speed altitude path along climb drag axial load_by_axial load_by_drag")


@physics
def bounded(x, size):
    """x within -size and size, in their unit."""
    return minimum(maximum(x, -size), size)


@physics
def sensed(s, p, o, draws):
    """What navigation and accelerometer measure, with their errors, SI and radians; `Sensed` names the frames."""
    place, _, force, pressure, _ = exposure_of(s, p, o)
    up, ahead, _ = from_planned_entry(s, p)
    v = norm(velocity(s))
    wrong, stretch = p.accelerometer_bias, 1.0 + p.accelerometer_scale_error
    if any_lane(p.accelerometer_noise > 0.0):
        wrong = wrong + p.accelerometer_noise * normal_pair(draws, 0)[0]
    in_line = axial_coefficient(force.drag, force.lift, p.cos_misaligned, p.sin_misaligned)
    return Sensed(
        speed=v + p.nav_speed_error,
        altitude=place.altitude + p.nav_altitude_error,
        path=asin(bounded(dot(velocity(s), place.up) / v, 1.0)) + p.nav_flight_path_angle_error,
        along=p.radius * atan2(ahead, up) + p.nav_range_error,
        climb=place.climb + p.nav_climb_error,
        drag=stretch * (pressure * in_line) + wrong,
        axial=stretch * (pressure * force.sensed) + wrong,
        load_by_axial=force.total / force.axial,
        load_by_drag=force.total / force.drag,
    )


@physics
def navigated_share(x, p, o):
    """Laws 1 and 2: vertical share of the lift less that of the reference, u - u_r, without unit.

    u - u_r = -(k_h dh + k_gamma dgamma + k_s ds) at equal speed; law 2 takes dh = -H_s (D - D_r) / D_r and dgamma =
    (h' - h'_r) / V.  Derived here for the source's three laws, of which it gives the outline alone.
    """
    row = stored.BySpeed(*stored.by_speed(o.tables, p.reference, x.speed))
    along = x.along - row.range - (p.aim_down - p.planned_range)  # its end is moved to the target
    if o.guidance == CHOICES.guidance.law1:
        high, tilt = x.altitude - row.altitude, x.path - row.path
    else:
        high = bounded(-SCALE_HEIGHT * (x.drag / row.drag - 1.0), LARGEST_CLIMB)
        tilt = (x.climb - row.climb) / x.speed
    if o.guidance == CHOICES.guidance.law2:
        along = 0.0
    return -(row.k_altitude * high + row.k_path * tilt + row.k_range * along)


@physics
def apollo_share(x, p, o):
    """Vertical share of the lift, without unit, by the range that the flown influence coefficients predict.

    R = R_r + F1 (D - D_r) + F2 (h' - h'_r) [m] and L/D = 0.18 + K (to go - R) / F3, K = 4: R. Morth, R-532 (1966).
    """
    row = stored.Influence(*stored.by_speed(o.tables, p.reference, x.speed))
    predicted = row.range + row.by_drag * (x.drag - row.drag) + row.by_climb * (x.climb - row.climb)
    wanted = stored.REFERENCE_LIFT_TO_DRAG + stored.OVERCONTROL * (p.aim_down - x.along - predicted) / row.by_lift
    return wanted / p.planned_lift_to_drag


@physics
def reckoned(t, kept, x, p, o):
    """The accelerometer's account after a sample: by the clock until the air is felt, then by the speed lost [m/s].

    W = integral of n dt and the range [m] along W by trapezoids; derived here for the source's law 3.
    """
    period, before = o.guidance_period, kept.lost <= 0.0
    # of the sample in which the threshold is passed, the part beyond it
    part = (x.axial - stored.FELT) / where(x.axial > kept.axial, x.axial - kept.axial, 1.0)
    first = where(x.axial > stored.FELT, 0.5 * (x.axial + stored.FELT) * bounded(part, 1.0) * period, 0.0)
    lost = where(before, first, kept.lost + 0.5 * (x.axial + kept.axial) * period)
    row = stored.by_loss(o.tables, p.reference, lost)
    by_clock = stored.clocked_range(o.tables, p.reference, t)
    along = where(before, by_clock, kept.range + 0.5 * (row.range_rate + kept.rate) * period)
    excess = log(maximum(x.axial, 1e-6)) - row.log_axial
    return Reckoning(lost, along, row.range_rate, x.axial, excess)


@physics
def accelerometer_share(now, before, p, o):
    """Law 3: vertical share of the lift less that of the reference, without unit, and the stored speed [m/s].

    dh = -H_s (n - n_r) / n_r and h' = -H_s [rate of ln(n / n_r) + 2 (n - n_r) / V_r]: the logarithm of n ~ rho V^2
    differentiated in an exponential atmosphere, derived here.
    """
    row = stored.by_loss(o.tables, p.reference, now.lost)
    share = now.axial / row.axial - 1.0
    high = bounded(-SCALE_HEIGHT * share, LARGEST_CLIMB)
    growth = (now.excess - before.excess) / o.guidance_period
    climb = -SCALE_HEIGHT * (growth + 2.0 * (now.axial - row.axial) / row.speed)
    tilt = bounded(climb / row.speed, LARGEST_TILT)
    along = now.range - row.range - (p.aim_down - p.planned_range)
    if o.guidance == CHOICES.guidance.law3:
        along = 0.0
    return -(row.k_altitude * high + row.k_path * tilt + row.k_range * along), row.speed


@physics
def control(t, s, m, p, o, draws):
    """One sample: sense, ask for a share of the lift, choose its side, and send the bank [rad] after it."""
    if o.guidance == CHOICES.guidance.none:
        return m
    x, kept = sensed(s, p, o, draws), m.steering
    # what law 3 keeps, the speed by which the law goes, the deceleration that it knows
    reckoning, speed, felt, load = kept.reckoning, x.speed, x.drag, x.drag * x.load_by_drag
    if o.guidance == CHOICES.guidance.law3 or o.guidance == CHOICES.guidance.law3r:
        reckoning = reckoned(t, kept.reckoning, x, p, o)
        change, speed = accelerometer_share(reckoning, kept.reckoning, p, o)
        share, felt, load = p.planned_share + change, x.axial, x.axial * x.load_by_axial
    elif o.guidance == CHOICES.guidance.apollo:
        share = apollo_share(x, p, o)
    else:
        share = p.planned_share + navigated_share(x, p, o)
    active = where((kept.active > 0.5) | (felt > stored.STEERED), 1.0, 0.0)
    working = (active > 0.5) & (speed > stored.LAST_SPEED)
    share = where(working, share, p.planned_share)
    # a load above the limit calls for all the lift upwards, whatever the law wants
    share = where(load > p.load_limit, 1.0, share)
    inside = minimum(maximum(share, LEAST_SHARE), 1.0)
    side = where(active > 0.5, side_of(kept.side, lateral_miss(s, p), norm(velocity(s)), p), kept.side)
    bank, rate, command = kept.turn.next_bank, kept.turn.next_rate, side * acos(inside) + p.bank_error
    next_bank, next_rate = followed(bank, rate, command, p.bank_lag, p.bank_rate_limit, o.guidance_period)
    steering = Steering(
        turn=Turn(t, where(p.bank_lag > 0.0, bank, next_bank), rate, next_bank, next_rate),  # without a lag at once
        reckoning=reckoning,
        side=side,
        active=active,
        samples=kept.samples + where(working, 1.0, 0.0),
        saturated=kept.saturated + where(working & (share != inside), 1.0, 0.0),
        reversals=kept.reversals + where(side != kept.side, 1.0, 0.0),
    )
    return replace(m, steering=steering)
