"""Events between coasts: ignitions, cut-offs, decisions, and the evaluation at the end of a transfer.

The memory holds the next action, `mode`, and the time at which it is due.

mode        action                                          next
IGNITION    start the burn                                  CUT_OFF
CUT_OFF     end the burn                                    IGNITION, DECISION (inspection) or DAY_LATER (phasing)
DECISION    inspection: choose the next coast               IGNITION or DECISION
DAY_LATER   phasing: evaluate the sidereal day after        NOTHING

In the phasing, corrections follow the plan, with feedback on what navigation measures at ignition.  In the inspection
the law chooses each coast and each correction.
"""

from collections import namedtuple

from campaigns.geo_servicing import plan_table
from campaigns.geo_servicing.drift_model import DRIFT_PER_DV
from campaigns.geo_servicing.dynamics import (
    INSPECTION,
    MU,
    PHASING,
    RATE,
    SIDEREAL_DAY,
    Memory,
    longitudes,
)
from campaigns.geo_servicing.inspection import PAIRS, next_coast, next_pair, relative_orbit, velocity_change
from campaigns.geo_servicing.navigation import FILTERED, RAW, Estimate, burnt, estimate_of, navigated_elements
from mc_engine.lanes import any_lane, atan, exp, maximum, physics, sincos, sqrt, where
from mc_engine.physics.frames import TURN, half_turn
from mc_engine.physics.radiation import discs
from mc_engine.physics.sun_moon import ephemeris

Events = namedtuple("Events", "due settle penumbra umbra")
# push: commanded thrust ahead [N]; tilts: sines of the pointing errors outward and to the normal
Burn = namedtuple("Burn", "dv length outward ahead across")
# as the memory's end_... and day_...
TransferEnd = namedtuple("TransferEnd", "time true mean drift e inclination sum day_mean day_drift")
IGNITION, CUT_OFF, DECISION, DAY_LATER, NOTHING = 0.0, 1.0, 2.0, 3.0, 4.0
NEVER = 1e15  # s
FIRST_LOOK = 1.0  # s: the inspection decides first when the first fix is there
SHORTEST_BURN = 1e-6  # s
MISSING = float("nan")


@physics
def start(p, o):
    """Before the first sample: what is due first, and when [s]."""
    zero = 0.0 * p.x
    due, mode = zero + NEVER, zero + NOTHING
    if o.phase == PHASING:
        none = plan_table.corrections(o.tables) < 0.5
        due = zero + where(none, NEVER, plan_table.planned(o.tables, 0.0, plan_table.IGNITION))
        mode = zero + where(none, NOTHING, IGNITION)
    elif o.phase == INSPECTION:
        due, mode = zero + maximum(o.observation, FIRST_LOOK), zero + DECISION
    gone = zero + MISSING
    return Memory(
        due=due, mode=mode, burns=zero, outward=zero, ahead=zero, across=zero, dv=zero, settled=zero, second=zero,
        end_time=gone, end_true=gone, end_mean=gone, end_drift=gone, end_e=gone, end_inclination=gone, end_sum=gone,
        day_mean=gone, day_drift=gone,
        r=zero, s=zero, u=zero, w=zero, prr=zero, prs=zero, pru=zero, prw=zero, pss=zero, psu=zero, psw=zero,
        puu=zero, puw=zero, pww=zero,
        after_r=zero, after_s=zero, after_u=zero, after_w=zero, d1=zero, d2=zero, d3=zero,
    )  # fmt: skip


@physics
def events(t, s, m, p, o):
    """What is due [s], when the inspection counts as settled [s], and the edges of the Earth's shadow [rad].

    At the edges nothing is done: steps end there, since the light has corners that no step may go over.
    """
    penumbra, umbra = 1.0 + 0.0 * t, 1.0 + 0.0 * t
    if o.sunlight > 0.5:
        sx, sy, sz, _, _, _ = ephemeris(p.sun_moon_time + t, o.tables, p.sun_moon)
        sun, earth, apart = discs(s.x, s.y, s.z, sx, sy, sz)
        penumbra, umbra = apart - earth - sun, apart - earth + sun
    return Events(t - m.due, t - o.settle_time, penumbra, umbra)


@physics
def drift_of(a):
    """Drift [rad/rev], east positive, of an orbit of semi-major axis a [m]: 2 pi (T0 - T)/T."""
    return TURN * (SIDEREAL_DAY / (TURN * a * sqrt(a / MU)) - 1.0)


@physics
def inclination_of(elements):
    """Inclination [rad] of equinoctial elements."""
    return 2.0 * atan(sqrt(elements.q * elements.q + elements.p * elements.p))


@physics
def navigated(t, s, m, p):
    """(mean longitude deviation [rad], drift [rad/rev]) as navigation measures them."""
    x = navigated_elements(s, m)
    mean = x.mean - (p.aim + RATE * t)
    return half_turn(mean), drift_of(x.a)


@physics
def phasing_change(t, s, m, p, o):
    """Velocity change [m/s] of the present correction: the plan's, and feedback on the deviation from the plan."""
    dv = plan_table.planned(o.tables, m.burns, plan_table.DV)
    if o.feedback > 0.5:
        y, v = navigated(t, s, m, p)
        y = y - plan_table.planned(o.tables, m.burns, plan_table.LONGITUDE)
        v = v - plan_table.planned(o.tables, m.burns, plan_table.DRIFT)
        gain_y = plan_table.planned(o.tables, m.burns, plan_table.GAIN_Y)
        gain_v = plan_table.planned(o.tables, m.burns, plan_table.GAIN_V)
        dv = dv - (gain_y * y + gain_v * v) / DRIFT_PER_DV
    return dv


@physics
def of_burn(k, a, b, c, d, e):
    """The value that belongs to burn k, counted from 0, in its own unit."""
    return where(k < 0.5, a, where(k < 1.5, b, where(k < 2.5, c, where(k < 3.5, d, e))))


@physics
def execution(m, p, o):
    """(thrust error, tilt outward [rad], tilt to the normal [rad]) of the present burn.

    In phasing those of the case; in the inspection fresh ones, besides what holds for all its burns.
    """
    thrust = of_burn(m.burns, p.thrust_1, p.thrust_2, p.thrust_3, p.thrust_4, p.thrust_5)
    radial = of_burn(m.burns, p.radial_1, p.radial_2, p.radial_3, p.radial_4, p.radial_5)
    normal = of_burn(m.burns, p.normal_1, p.normal_2, p.normal_3, p.normal_4, p.normal_5)
    if o.phase == INSPECTION:
        thrust = thrust + p.thrust_noise * m.d1
        radial, normal = radial + p.pointing_noise * m.d2, normal + p.pointing_noise * m.d3
    return thrust, radial, normal


@physics
def ignited(t, s, m, p, o):
    """The burn that begins now: velocity change [m/s], duration [s], thrust [N] outward, ahead and to the normal.

    Duration by the rocket equation, m c (1 - exp(-|dv|/c)) / F; the errors stretch the thrust and tilt it.
    """
    dv = (
        phasing_change(t, s, m, p, o)
        if o.phase == PHASING
        else velocity_change(relative_orbit(s, m), 1.0 - m.second, p, o)
    )
    length = s.mass * p.exhaust / p.thrust * (1.0 - exp(-abs(dv) / p.exhaust))
    error, radial, normal = execution(m, p, o)
    push = p.thrust * (1.0 + error)
    sine_r, cosine_r = sincos(radial)
    sine_n, cosine_n = sincos(normal)
    ahead = where(dv < 0.0, -push, push)
    return Burn(
        dv,
        maximum(length, SHORTEST_BURN),
        ahead * sine_r,
        ahead * cosine_r * cosine_n,
        ahead * cosine_r * sine_n,
    )


@physics
def estimate_after_burn(m, p, o, cut):
    """The estimate [m, m/s] after a burn, where `cut` holds.

    A filter adds what the burn gave over the command to its error, and the assumed errors to its covariance; without a
    filter there is a fix of its own.
    """
    e = estimate_of(m)
    if o.navigation == FILTERED:
        # what the burn gave: the command, stretched and tilted
        size = where(cut, abs(m.dv), 0.0)
        outward, ahead = size * m.outward / p.thrust, size * m.ahead / p.thrust
        e = burnt(e, outward, ahead - where(cut, m.dv, 0.0), size, o.assumed_thrust, o.assumed_pointing)
    elif o.navigation == RAW:
        e = fix_after_burn(e, m, cut)
    return e


@physics
def fix_after_burn(e, m, cut):
    """A fix of its own where `cut` holds: what is decided after a burn does not share the errors of its ignition."""
    return Estimate(
        r=where(cut, m.after_r, e.r), s=where(cut, m.after_s, e.s), u=where(cut, m.after_u, e.u),
        w=where(cut, m.after_w, e.w),
        prr=e.prr, prs=e.prs, pru=e.pru, prw=e.prw, pss=e.pss, psu=e.psu, psw=e.psw, puu=e.puu, puw=e.puw, pww=e.pww,
    )  # fmt: skip


@physics
def inspection_coast(s, m, e, cut, p, o):
    """(coast [rev] from now, 1 if it ends with a burn, 1 if that is the second of a pair); e : the estimate."""
    x = relative_orbit(s, e)
    if o.inspection_law == PAIRS:
        second = where(cut, 1.0 - m.second, 0.0)
        coast, burns = where(second > 0.5, 0.5, next_pair(x, p, o)), 1.0 + 0.0 * second
    else:
        coast, burns = next_coast(x, p, o)
        second = 0.0 * coast
    return coast, burns, second


@physics
def switch(t, s, m, p, o, hit):
    """Do what is due, and set what is due next, and when [s]."""
    now = hit.due > 0.5
    ignite, cut = now & (m.mode == IGNITION), now & (m.mode == CUT_OFF)
    decide, day = now & (m.mode == DECISION), now & (m.mode == DAY_LATER)
    e = estimate_after_burn(m, p, o, cut)
    due, mode, second, over = m.due, m.mode, m.second, cut & (not cut)
    if o.phase == PHASING:
        burns = m.burns + where(cut, 1.0, 0.0)
        n = plan_table.corrections(o.tables)
        over = cut & (burns > n - 0.5)
        following = plan_table.planned(o.tables, where(burns > n - 0.5, n - 1.0, burns), plan_table.IGNITION)
        due = where(cut, where(over, t + SIDEREAL_DAY, maximum(following, t + 1.0)), due)
        mode = where(cut, where(over, DAY_LATER, IGNITION), mode)
        due, mode = where(day, NEVER, due), where(day, NOTHING, mode)
    else:
        deciding = cut | decide
        if any_lane(deciding):
            coast, fires, second = inspection_coast(s, m, e, cut, p, o)
            due = where(deciding, t + SIDEREAL_DAY * coast, due)
            mode = where(deciding, where(fires > 0.5, IGNITION, DECISION), mode)
            second = where(deciding, second, m.second)
    outward, ahead, across, dv = m.outward, m.ahead, m.across, m.dv
    if any_lane(ignite):
        burn = ignited(t, s, m, p, o)
        due, mode, dv = where(ignite, t + burn.length, due), where(ignite, CUT_OFF, mode), where(ignite, burn.dv, dv)
        outward, ahead = where(ignite, burn.outward, outward), where(ignite, burn.ahead, ahead)
        across = where(ignite, burn.across, across)
    end = ended(t, s, m, p, over, day)
    return s, Memory(
        due=due, mode=mode, burns=m.burns + where(cut, 1.0, 0.0),
        outward=where(cut, 0.0, outward), ahead=where(cut, 0.0, ahead), across=where(cut, 0.0, across), dv=dv,
        settled=where(hit.settle > 0.5, 1.0, m.settled), second=second,
        end_time=end.time, end_true=end.true, end_mean=end.mean, end_drift=end.drift, end_e=end.e,
        end_inclination=end.inclination, end_sum=end.sum,
        day_mean=end.day_mean, day_drift=end.day_drift,
        r=e.r, s=e.s, u=e.u, w=e.w, prr=e.prr, prs=e.prs, pru=e.pru, prw=e.prw, pss=e.pss, psu=e.psu, psw=e.psw,
        puu=e.puu, puw=e.puw, pww=e.pww,
        after_r=m.after_r, after_s=m.after_s, after_u=m.after_u, after_w=m.after_w, d1=m.d1, d2=m.d2, d3=m.d3,
    )  # fmt: skip


@physics
def ended(t, s, m, p, over, day):
    """The `TransferEnd` [s, rad, rad/rev]: kept at the last cut-off, and a sidereal day later."""
    true, mean, x = longitudes(t, s, p)
    return TransferEnd(
        time=where(over, t, m.end_time),
        true=where(over, true, m.end_true),
        mean=where(over, mean, m.end_mean),
        drift=where(over, drift_of(x.a), m.end_drift),
        e=where(over, sqrt(x.k * x.k + x.h * x.h), m.end_e),
        inclination=where(over, inclination_of(x), m.end_inclination),
        sum=where(over, s.longitude_sum, m.end_sum),
        day_mean=where(day, (s.longitude_sum - m.end_sum) / SIDEREAL_DAY, m.day_mean),
        day_drift=where(day, mean - m.end_mean, m.day_drift),
    )
