"""Navigation: what is known of the servicing module, single fixes or a filter that works on them.

The estimate is the true state plus an error; the error is what is kept.  It has four components, place [m] and velocity
[m/s] outward and ahead: the motion out of the plane is not controlled and does not act on the one in it.  In the
inspection the error is that of the relative navigation of both craft.

The filter is a Kalman filter on Hill's equations.  Its error obeys the same equations without the model's help, so no
estimate need be integrated beside the flight: between fixes error and covariance go on by Hill's solution, a fix takes
its share off both, and a burn adds what it did differently from the command.

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
    """The estimate [m, m/s] after a measurement of its first component with this error.

    Kalman (1960), scalar update.
    """
    inverse = 1.0 / (e.prr + variance)
    kr, ks, ku, kw = e.prr * inverse, e.prs * inverse, e.pru * inverse, e.prw * inverse
    news = error - e.r
    return Estimate(
        r=e.r + kr * news, s=e.s + ks * news, u=e.u + ku * news, w=e.w + kw * news,
        prr=variance * kr, prs=variance * ks, pru=variance * ku, prw=variance * kw,
        pss=e.pss - ks * e.prs, psu=e.psu - ks * e.pru, psw=e.psw - ks * e.prw,
        puu=e.puu - ku * e.pru, puw=e.puw - ku * e.prw, pww=e.pww - kw * e.prw,
    )  # fmt: skip


@physics
def rotated(e):
    """The same estimate with its components in the order s, u, w, r."""
    return Estimate(
        r=e.s, s=e.u, u=e.w, w=e.r, prr=e.pss, prs=e.psu, pru=e.psw, prw=e.prs, pss=e.puu, psu=e.puw, psw=e.pru,
        puu=e.pww, puw=e.prw, pww=e.prr,
    )  # fmt: skip


@physics
def fixed(e, fix, place, velocity):
    """The estimate after a fix with this Error, of 1-sigma `place` [m] and `velocity` [m/s] along each axis."""
    place2, velocity2 = place * place, velocity * velocity
    e = rotated(first_measured(e, fix.r, place2))
    e = rotated(first_measured(e, fix.s, place2))
    e = rotated(first_measured(e, fix.u, velocity2))
    return rotated(first_measured(e, fix.w, velocity2))


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
def burnt(e, outward, ahead, dv, thrust_sigma, pointing_sigma):
    """The estimate after a burn of dv [m/s] that gave so much more than commanded outward and ahead [m/s]."""
    a, b = pointing_sigma * dv, thrust_sigma * dv
    return replace(e, u=e.u - outward, w=e.w - ahead, puu=e.puu + a * a, pww=e.pww + b * b)


@physics
def control(t, m, p, o, draws):
    """A fix [m, m/s], if there are any, and what a burn before the next needs.

    That is fresh deviates for the burn's errors, and the single fix that follows it.
    """
    fix = fix_error(draws, 0, p)
    d1, d2 = normal_pair(draws, 2)
    d3, _ = normal_pair(draws, 3)
    place, velocity, e = p.nav_position, p.nav_velocity, m.estimate
    if o.navigation == CHOICES.navigation.raw:
        e = single_fix(fix, place, velocity)
    elif o.navigation == CHOICES.navigation.filtered:
        going = propagated(e, o.fix_period, o.filter_noise * o.fix_period)
        e = where(t > 0.0, fixed(going, fix, place, velocity), single_fix(fix, place, velocity))
    return replace(m, estimate=e, after=fix_error(draws, 4, p), d1=d1, d2=d2, d3=d3)


@physics
def navigated_elements(s, e):
    """Equinoctial elements of the module as navigation measures them: e.r, e.s [m] and e.u, e.w [m/s] are its errors.

    r, u : outward;  s, w : ahead.
    """
    true_v = Vector(s.vx, s.vy, s.vz)
    axes = ric_from_eci(s, true_v)
    outward, ahead = Vector(axes.xx, axes.xy, axes.xz), Vector(axes.yx, axes.yy, axes.yz)
    r = added_scaled(added_scaled(s, e.r, outward), e.s, ahead)
    v = added_scaled(added_scaled(true_v, e.u, outward), e.w, ahead)
    return equinoctial(r.x, r.y, r.z, v.x, v.y, v.z, MU)
