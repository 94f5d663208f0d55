"""Navigation: what is known of the servicing module, single fixes or a filter that works on them.

The estimate is the true state plus an error; the error is what is kept.  It has four components, place [m] and velocity
[m/s] outward and ahead: the motion out of the plane is not controlled and does not act on the one in it.  In the
inspection the error is that of the relative navigation of both craft.

The filter is a Kalman filter on Hill's equations, which its error obeys, too; no estimate is integrated beside the
flight.  Between fixes error and covariance go on by Hill's solution, a fix takes its share off both, and a burn adds
what it did differently from the command.

R. E. Kalman, Journal of Basic Engineering 82 (1960) 35-45; G. W. Hill, American Journal of Mathematics 1 (1878) 5-26.
"""

from collections import namedtuple

from campaigns.geo_servicing.dynamics import MU, RATE
from campaigns.geo_servicing.inputs import CHOICES
from mc_engine.lanes import physics, replace, sincos, where
from mc_engine.lanes.noise import normal_pair
from mc_engine.physics.earth_frames import ric_from_eci
from mc_engine.physics.orbital_elements import equinoctial
from mc_engine.physics.vectors import Vector, added_scaled

Error = namedtuple("Error", "r s u w")
EXACT = Error(0.0, 0.0, 0.0, 0.0)
# an error, and its covariance as the filter knows it
Estimate = namedtuple("Estimate", "r s u w prr prs pru prw pss psu psw puu puw pww")
NO_ESTIMATE = Estimate(*[0.0] * 14)


@physics
def hill(r, s, u, w, sine, cosine, t):
    """Deviation from a circular orbit t [s] later; sine, cosine of the angle flown.

    r, s : outward and ahead [m];  u, w : the inertial velocity's deviation along the turning axes [m/s]
    """
    n = RATE
    across = w - n * r  # rates seen in the turning axes
    along = u + n * s
    r1 = (4.0 - 3.0 * cosine) * r + (sine * along + 2.0 * (1.0 - cosine) * across) / n
    s1 = s + 6.0 * (sine - n * t) * r + (-2.0 * (1.0 - cosine) * along + (4.0 * sine - 3.0 * n * t) * across) / n
    along1 = 3.0 * n * sine * r + cosine * along + 2.0 * sine * across
    across1 = -6.0 * n * (1.0 - cosine) * r - 2.0 * sine * along + (4.0 * cosine - 3.0) * across
    return r1, s1, along1 - n * s1, across1 + n * r1


@physics
def propagated(e, t, noise):
    """The estimate t [s] later; noise : 1-sigma of the velocity [m/s] that unknown forces add to either axis."""
    sine, cosine = sincos(RATE * t)
    r, s, u, w = hill(e.r, e.s, e.u, e.w, sine, cosine, t)
    # the covariance: its columns go on like errors, then its rows
    a0, a1, a2, a3 = hill(e.prr, e.prs, e.pru, e.prw, sine, cosine, t)
    b0, b1, b2, b3 = hill(e.prs, e.pss, e.psu, e.psw, sine, cosine, t)
    c0, c1, c2, c3 = hill(e.pru, e.psu, e.puu, e.puw, sine, cosine, t)
    d0, d1, d2, d3 = hill(e.prw, e.psw, e.puw, e.pww, sine, cosine, t)
    prr, prs, pru, prw = hill(a0, b0, c0, d0, sine, cosine, t)
    _, pss, psu, psw = hill(a1, b1, c1, d1, sine, cosine, t)
    _, _, puu, puw = hill(a2, b2, c2, d2, sine, cosine, t)
    _, _, _, pww = hill(a3, b3, c3, d3, sine, cosine, t)
    q = noise * noise
    return Estimate(
        r=r, s=s, u=u, w=w,
        prr=prr, prs=prs, pru=pru, prw=prw, pss=pss, psu=psu, psw=psw, puu=puu + q, puw=puw, pww=pww + q,
    )  # fmt: skip


@physics
def first_measured(e, error, variance):
    """The estimate after a measurement of its first component with this error; Kalman (1960), scalar update.

    Its components are in the order s, u, w, r, so that the next measurement is that of the second.
    """
    inverse = 1.0 / (e.prr + variance)
    kr, ks, ku, kw = e.prr * inverse, e.prs * inverse, e.pru * inverse, e.prw * inverse
    news = error - e.r
    return Estimate(
        r=e.s + ks * news, s=e.u + ku * news, u=e.w + kw * news, w=e.r + kr * news,
        prr=e.pss - ks * e.prs, prs=e.psu - ks * e.pru, pru=e.psw - ks * e.prw, prw=variance * ks,
        pss=e.puu - ku * e.pru, psu=e.puw - ku * e.prw, psw=variance * ku,
        puu=e.pww - kw * e.prw, puw=variance * kw, pww=variance * kr,
    )  # fmt: skip


@physics
def fixed(e, fix, place, velocity):
    """The estimate after a fix with this Error, of 1-sigma `place` [m] and `velocity` [m/s] along each axis."""
    place2, velocity2 = place * place, velocity * velocity
    e = first_measured(first_measured(e, fix.r, place2), fix.s, place2)
    return first_measured(first_measured(e, fix.u, velocity2), fix.w, velocity2)


@physics
def single_fix(fix, place, velocity):
    """The estimate [m, m/s] that one fix alone gives: its errors, and their variances on the diagonal."""
    a, b = place * place, velocity * velocity
    return replace(NO_ESTIMATE, r=fix.r, s=fix.s, u=fix.u, w=fix.w, prr=a, pss=a, puu=b, pww=b)


@physics
def fix_error(draws, first, p):
    """The Error [m, m/s] of a fix, from two pairs of deviates, `first` and the next."""
    n1, n2 = normal_pair(draws, first)
    n3, n4 = normal_pair(draws, first + 1)
    return Error(r=p.nav_position * n1, s=p.nav_position * n2, u=p.nav_velocity * n3, w=p.nav_velocity * n4)


@physics
def burnt(e, burn, o):
    """The estimate [m, m/s] after a Burn: less what it gave over its command, uncertain as burns are assumed to be."""
    size = abs(burn.dv)
    outward, ahead = size * burn.outward / o.thrust, size * burn.ahead / o.thrust
    a, b = o.assumed_pointing * size, o.assumed_thrust * size
    return replace(e, u=e.u - outward, w=e.w - (ahead - burn.dv), puu=e.puu + a * a, pww=e.pww + b * b)


@physics
def control(t, m, p, o, draws):
    """A fix [m, m/s], if there are any; fresh deviates for a burn before the next, and the single fix after it."""
    fix = fix_error(draws, 0, p)
    d1, d2 = normal_pair(draws, 2)
    d3, _ = normal_pair(draws, 3)
    e = m.estimate
    if o.navigation != CHOICES.navigation.perfect:
        e = single_fix(fix, p.nav_position, p.nav_velocity)
    if o.navigation == CHOICES.navigation.filtered:
        going = propagated(m.estimate, o.fix_period, o.filter_noise * o.fix_period)
        e = where(t > 0.0, fixed(going, fix, p.nav_position, p.nav_velocity), e)
    return replace(m, estimate=e, after=fix_error(draws, 4, p), d1=d1, d2=d2, d3=d3)


@physics
def navigated_elements(s, e):
    """Equinoctial elements of the module as navigation measures them with the error e, an `Error` or `Estimate`."""
    true_v = Vector(s.vx, s.vy, s.vz)
    axes = ric_from_eci(s, true_v)
    outward, ahead = Vector(axes.xx, axes.xy, axes.xz), Vector(axes.yx, axes.yy, axes.yz)
    r = added_scaled(added_scaled(s, e.r, outward), e.s, ahead)
    v = added_scaled(added_scaled(true_v, e.u, outward), e.w, ahead)
    return equinoctial(r.x, r.y, r.z, v.x, v.y, v.z, MU)
