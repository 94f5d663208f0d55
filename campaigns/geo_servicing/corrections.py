"""Events between coasts: ignitions, cut-offs, decisions, and the evaluation at the end of a transfer.

The memory holds the next action, `mode`, and the time at which it is due.

mode        action                                          next
IGNITION    start the burn                                  CUT_OFF
CUT_OFF     end the burn                                    IGNITION, DECISION (inspection) or DAY_LATER (phasing)
DECISION    inspection: choose the next coast               IGNITION or DECISION
DAY_LATER   phasing: evaluate the sidereal day after        NOTHING

The phasing follows the plan, with feedback on what navigation measures at ignition; the inspection follows the law.
"""

from collections import namedtuple
from typing import NamedTuple

from campaigns.geo_servicing.drift_model import DRIFT_PER_DV
from campaigns.geo_servicing.dynamics import MU, RATE, SIDEREAL_DAY, longitudes
from campaigns.geo_servicing.inputs import CHOICES
from campaigns.geo_servicing.inspection import ends, next_coast, relative_orbit, velocity_change
from campaigns.geo_servicing.navigation import EXACT, NO_ESTIMATE, Error, Estimate, burnt, navigated_elements
from campaigns.geo_servicing.plan_table import corrections, planned
from mc_engine.lanes import any_lane, atan, exp, maximum, minimum, physics, replace, sincos, sqrt, where
from mc_engine.model import Event
from mc_engine.physics.frames import TURN, half_turn
from mc_engine.physics.radiation import discs
from mc_engine.physics.sun_moon import ephemeris

IGNITION, CUT_OFF, DECISION, DAY_LATER, NOTHING = 0.0, 1.0, 2.0, 3.0, 4.0
NEVER = 1e15  # s
FIRST_LOOK = 1.0  # s: the inspection decides first when the first fix is there
SHORTEST_BURN = 1e-6  # s
SOON = 1e-6  # s, of an ignition at the start, where an event does not rise

# velocity change that is commanded [m/s]; thrust [N] outward, ahead and to the normal
Burn = namedtuple("Burn", "dv outward ahead across")
NO_BURN = Burn(0.0, 0.0, 0.0, 0.0)
# at the end of the last phasing burn, SI and radians, by the names of outputs and metrics; longitude_sum: of the state
TransferEnd = namedtuple(
    "TransferEnd",
    "transfer_time longitude_deviation mean_longitude_deviation drift_rate eccentricity inclination longitude_sum "
    "daily_mean_longitude_deviation actual_drift_rate",
)
NO_END = TransferEnd(*[float("nan")] * 9)
Shadow = namedtuple("Shadow", "penumbra umbra")


class Memory(NamedTuple):
    """What is due, and what has been; SI, radians."""

    due: float = NEVER
    mode: float = NOTHING
    burns: float = 0.0  # so far
    burn: Burn = NO_BURN
    settled: float = 0.0  # 1 once the inspection counts as settled
    second: float = 0.0  # 1 between two burns that make a pair
    end: TransferEnd = NO_END
    reference: float = 0.0  # longitude deviation [rad] from which that of longitude_sum is counted
    estimate: Estimate = NO_ESTIMATE
    after: Error = EXACT  # of the single fix that follows the next burn
    d1: float = 0.0  # fresh normal deviates for that burn
    d2: float = 0.0
    d3: float = 0.0


@physics
def start(o):
    """Before the first sample: what is due first, and when [s]."""
    if o.phase == CHOICES.phase.inspection:
        # settled from the start where no time is given to settle: an event at the start does not rise
        return Memory(
            due=maximum(o.observation, FIRST_LOOK), mode=DECISION, settled=where(o.settle_time > 0.0, 0.0, 1.0)
        )
    if o.phase == CHOICES.phase.phasing:
        return Memory(due=maximum(planned(o.tables, 0.0).ignition, SOON), mode=IGNITION)
    return Memory()


@physics
def shadow_edges(t, s, p, o):
    """Angles [rad] of the Sun from the edges of the Earth's shadow, seen from the craft; 1 where sunlight has no push.

    Steps end at the edges, corners of the light that no step may go over.
    """
    if o.sunlight > 0.5:
        sx, sy, sz, _, _, _ = ephemeris(p.sun_moon_time + t, o.tables, p.sun_moon)
        sun, earth, apart = discs(s.x, s.y, s.z, sx, sy, sz)
        return Shadow(penumbra=apart - earth - sun, umbra=apart - earth + sun)
    return Shadow(penumbra=1.0, umbra=1.0)


EVENTS = {
    "due": Event(physics(lambda t, m: t - m.due), "rising", "switch", rare=True),
    "settle": Event(physics(lambda t, o: t - o.settle_time), "rising", "switch", rare=True),
    "penumbra": Event(shadow_edges, "either", "switch", rare=True),
    "umbra": Event(shadow_edges, "either", "switch", rare=True),
}


@physics
def drift_of(a):
    """Drift [rad/rev], east positive, of an orbit of semi-major axis a [m]: 2 pi (T0 - T)/T."""
    return TURN * (SIDEREAL_DAY / (TURN * a * sqrt(a / MU)) - 1.0)


@physics
def ended(t, s, p):
    """The `TransferEnd` [s, rad, rad/rev] of a transfer that ends here; the day after is still to come."""
    true, mean, x = longitudes(t, s, p)
    return replace(
        NO_END,
        transfer_time=t,
        longitude_deviation=true,
        mean_longitude_deviation=mean,
        drift_rate=drift_of(x.a),
        eccentricity=sqrt(x.k * x.k + x.h * x.h),
        inclination=2.0 * atan(sqrt(x.q * x.q + x.p * x.p)),
        longitude_sum=s.longitude_sum,
    )


@physics
def phasing_change(t, s, m, p, o):
    """Velocity change [m/s] of the present correction: the plan's, with feedback on measured deviations from it."""
    plan = planned(o.tables, m.burns)
    dv = plan.dv
    if o.feedback > 0.5:
        x = navigated_elements(s, m.estimate)
        y = half_turn(x.mean - (p.aim + RATE * t) - plan.longitude)  # of the mean longitude [rad]
        v = drift_of(x.a) - plan.drift  # [rad/rev]
        dv = dv - (plan.gain_y * y + plan.gain_v * v) / DRIFT_PER_DV
    return dv


@physics
def of_burn(k, a, b, c, d, e):
    """The value that belongs to burn k, counted from 0."""
    return where(k < 0.5, a, where(k < 1.5, b, where(k < 2.5, c, where(k < 3.5, d, e))))


@physics
def ignited(t, s, m, p, o):
    """The memory as a burn begins, m c (1 - exp(-|dv|/c)) / F long; errors stretch its thrust and tilt it."""
    thrust = of_burn(m.burns, p.thrust_1, p.thrust_2, p.thrust_3, p.thrust_4, p.thrust_5)
    radial = of_burn(m.burns, p.radial_1, p.radial_2, p.radial_3, p.radial_4, p.radial_5)
    normal = of_burn(m.burns, p.normal_1, p.normal_2, p.normal_3, p.normal_4, p.normal_5)
    if o.phase == CHOICES.phase.inspection:  # fresh errors, besides those that hold for all burns
        thrust = thrust + p.thrust_noise * m.d1
        radial, normal = radial + p.pointing_noise * m.d2, normal + p.pointing_noise * m.d3
        dv = velocity_change(relative_orbit(s, m.estimate), 1.0 - m.second, p, o)
    else:
        dv = phasing_change(t, s, m, p, o)
    length = s.mass_left * p.exhaust / o.thrust * (1.0 - exp(-abs(dv) / p.exhaust))
    push = o.thrust * (1.0 + thrust)
    sine_r, cosine_r = sincos(radial)
    sine_n, cosine_n = sincos(normal)
    ahead = where(dv < 0.0, -push, push)
    burn = Burn(dv, ahead * sine_r, ahead * cosine_r * cosine_n, ahead * cosine_r * sine_n)
    return replace(m, due=t + maximum(length, SHORTEST_BURN), mode=CUT_OFF, burn=burn)


@physics
def cut_off(m, o):
    """The memory after a burn.

    Without a filter there is a fix of its own, so that what is decided now does not share the errors of the ignition.
    """
    e = m.estimate
    if o.navigation == CHOICES.navigation.filtered:
        e = burnt(e, m.burn, o)
    elif o.navigation == CHOICES.navigation.raw:
        e = replace(e, r=m.after.r, s=m.after.s, u=m.after.u, w=m.after.w)
    return replace(m, burns=m.burns + 1.0, burn=NO_BURN, estimate=e)


@physics
def next_correction(t, s, m, p, o):
    """The memory of the phasing after a burn: the next is due, or, after the last, the sidereal day is evaluated."""
    n = corrections(o.tables)
    over = m.burns > n - 0.5
    ignition = maximum(planned(o.tables, where(over, n - 1.0, m.burns)).ignition, t + 1.0)
    end = ended(t, s, p)
    last = replace(m, due=t + SIDEREAL_DAY, mode=DAY_LATER, end=end, reference=end.longitude_deviation)
    return where(over, last, replace(m, due=ignition, mode=IGNITION))


@physics
def day_later(t, s, m, p):
    """The memory a sidereal day after the last phasing burn."""
    _, mean, _ = longitudes(t, s, p)
    day_mean = half_turn(m.reference + (s.longitude_sum - m.end.longitude_sum) / SIDEREAL_DAY)
    day_drift = half_turn(mean - m.end.mean_longitude_deviation)
    end = replace(m.end, daily_mean_longitude_deviation=day_mean, actual_drift_rate=day_drift)
    return replace(m, due=NEVER, mode=NOTHING, end=end)


@physics
def decided(t, s, m, cut, p, o):
    """The memory of the inspection with the next coast and what ends it; cut : where a burn has just ended."""
    x = relative_orbit(s, m.estimate)
    if o.inspection_law == CHOICES.inspection_law.pairs:
        second = where(cut, 1.0 - m.second, 0.0)
        coast, burns = where(second > 0.5, 0.5, minimum(*ends(x, p, o))), 1.0
    else:
        (coast, burns), second = next_coast(x, p, o), 0.0
    return replace(m, due=t + SIDEREAL_DAY * coast, mode=where(burns > 0.5, IGNITION, DECISION), second=second)


@physics
def switch(t, s, m, p, o, hit):
    """Do what is due, and set what is due next, and when [s]."""
    now = hit.due > 0.5
    ignite, cut = now & (m.mode == IGNITION), now & (m.mode == CUT_OFF)
    decide, day = now & (m.mode == DECISION), now & (m.mode == DAY_LATER)
    m = where(hit.settle > 0.5, replace(m, settled=1.0), m)
    m = where(cut, cut_off(m, o), m)
    if o.phase == CHOICES.phase.phasing:
        m = where(cut, next_correction(t, s, m, p, o), m)
        m = where(day, day_later(t, s, m, p), m)
    elif any_lane(cut | decide):
        m = where(cut | decide, decided(t, s, m, cut, p, o), m)
    if any_lane(ignite):
        m = where(ignite, ignited(t, s, m, p, o), m)
    return s, m
