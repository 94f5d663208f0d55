"""The inspection law: when to correct, and by how much, so that the module keeps its distance from the target.

Numbers in brackets are equations of the source (`MODEL.source`); the procedure around them is the README's.
"""

from collections import namedtuple

from campaigns.geo_servicing.dynamics import MU, R0, RATE, SIDEREAL_DAY
from campaigns.geo_servicing.inputs import CHOICES
from campaigns.geo_servicing.navigation import navigated_elements
from mc_engine.lanes import atan2, floor, maximum, minimum, physics, sqrt, where
from mc_engine.physics.frames import TURN, half_turn
from mc_engine.physics.orbital_elements import equinoctial

# along: mean distance ahead of the target [m], drift of it [m/rev]; e: length of the difference of the eccentricity
# vectors, phase: anomaly on the relative ellipse [rad], 0 where the module is lowest
Relative = namedtuple("Relative", "along drift e phase")
NEVER = 1e3  # rev
LAST = 0.25  # rev by which a coast may fall short of its whole revolutions


@physics
def correction(y, v, t, chi1, chi2, weight, sigma):
    """Change of the drift by the correction law (3.57), in the unit of v.

    y : deviation from the nominal separation;  v : its drift per revolution;  t : coast that follows [rev]
    chi1, chi2 : L22/L11 [rev^2] and L12/L11 [rev] of the terminal matrix;  weight : w/L11;  sigma : of the execution
    """
    q = t * t + 2.0 * chi2 * t + chi1
    return -((t + chi2) * y + q * v) / (weight + (1.0 + sigma * sigma) * q)


@physics
def asked(y, v, p, o):
    """Change of the drift [m/rev] that the law asks for at a deviation y [m] and a drift v [m/rev]."""
    return correction(y, v, p.coast_revolutions, p.chi1, p.chi2, p.control_weight, o.assumed_thrust)


@physics
def relative_orbit(s, error):
    """The module's motion about the target, as navigation with this error measures it [m, m/rev, 1, rad].

    The distance is R0 times the difference of the mean longitudes, e and phase those of (3.43), (3.44); the drift,
    -3 pi R0 (a - a_target) / a_target per revolution, is derived here from T ~ a^1.5.
    """
    module = navigated_elements(s, error)
    target = equinoctial(s.target_x, s.target_y, s.target_z, s.target_vx, s.target_vy, s.target_vz, MU)
    dk, dh = module.k - target.k, module.h - target.h
    return Relative(
        along=R0 * half_turn(module.mean - target.mean),
        drift=-1.5 * TURN * R0 * (module.a - target.a) / target.a,
        e=sqrt(dk * dk + dh * dh),
        phase=module.true - atan2(dh, dk),
    )


@physics
def wait_until(x, phase, least):
    """Coast [rev] from now to the next time that the relative ellipse has this phase, `least` or more."""
    share = (phase - x.phase) / TURN
    share = share - floor(share)
    return share + maximum(-floor(share - least), 0.0)


@physics
def ends(x, p, o):
    """Coasts [rev] to the next lowest and highest point of the relative ellipse that are far enough away."""
    least = maximum(o.least_coast / SIDEREAL_DAY, p.coast_revolutions - LAST)
    return wait_until(x, 0.0, least), wait_until(x, 0.5 * TURN, least)


@physics
def candidate(x, wait, sign, p, o):
    """The coast [rev] where the law then asks for a correction of this sign; `NEVER` where it asks for another."""
    return where(asked(x.along - p.nominal + x.drift * wait, x.drift, p, o) * sign > 0.0, wait, NEVER)


@physics
def next_coast(x, p, o):
    """(coast [rev] to the next correction, 1 if there is one); without one, look again a revolution later.

    A relative ellipse that is wider than wanted is corrected where that makes it narrower, and the other way about.
    """
    low, high = ends(x, p, o)
    braking = where(x.e < p.around, -1.0, 1.0)  # sign of u at the lowest point
    wait = minimum(candidate(x, low, braking, p, o), candidate(x, high, -braking, p, o))
    wanted = wait < NEVER
    return where(wanted, wait, 1.0), where(wanted, 1.0, 0.0)


@physics
def first_of_pair(x, p, o):
    """Change of the drift [m/rev] now, half a revolution before that of the law, that takes the relative ellipse away.

    Both together change the eccentricity vectors' difference by what is too much of it, u_a - u_p = -+E with E the
    drift that belongs to V0 (e - wanted)/2, and u_p is the law's at its own time; two equations, solved for u_a.
    """
    g_y, g_v = -asked(1.0, 0.0, p, o), -asked(0.0, 1.0, p, o)  # gains of the law, which is linear
    low = where(abs(half_turn(x.phase)) < 0.25 * TURN, 1.0, -1.0)  # in the lower half of the relative ellipse
    apart = low * 1.5 * TURN * R0 * (x.e - p.around)  # drift of V0 e/2: 6 pi/w V0 e/2 = 3 pi R0 e
    y = x.along - p.nominal
    feedback = -g_y * (y + 0.5 * x.drift) - g_v * x.drift
    return (feedback + apart) / (1.0 + 0.5 * g_y + g_v)


@physics
def velocity_change(x, first, p, o):
    """Transverse velocity change [m/s] that the law asks for now: -u w / (6 pi), u in m/rev; first : 1 of a pair's."""
    u = asked(x.along - p.nominal, x.drift, p, o)
    if o.inspection_law == CHOICES.inspection_law.pairs:
        u = where(first > 0.5, first_of_pair(x, p, o), u)
    return -u * RATE / (3.0 * TURN)
