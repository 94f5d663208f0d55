"""The phasing plan: the source's corrections, or designed ones, with the gains that answer deviations.

NumPy and SciPy, once for all cases of the same settings.
"""

from collections import namedtuple
from typing import Any

import numpy as np
import scipy  # loads its packages when they are used

from campaigns.geo_servicing import drift_model
from campaigns.geo_servicing.dynamics import SIDEREAL_DAY
from campaigns.geo_servicing.inputs import CHOICES
from campaigns.geo_servicing.plan_table import Row, plan_rows
from campaigns.geo_servicing.planned_flight import Craft, End, Plan
from mc_engine.errors import ModelError
from mc_engine.physics.frames import TURN

# Coasts and burns of the source's corrections [s], and the signs that bring the drift to zero.
PUBLISHED = ((123_753.6, 7_726.3, 1.0), (37_692.0, 4_569.1, 1.0), (24_264.7, 1_290.3, -1.0))
E_PLANNED = 0.6  # of the tolerance: leaves the dispersions of thrust and pointing their part
PASSES = 20  # where little is left for the last correction, each pass only halves what is lacking
SETTLED = 1e-3  # of the tolerances: a plan is done when its flight ends as near as that to what was aimed at
DV_OF_COST = 0.1  # m/s that one unit of expected cost is worth: a plan may spend so much to be surer of its end


# what a plan must keep: tolerances of the end [rad, rad/rev, 1], least coast before each correction and longest
# transfer [rev], largest last correction [rad/rev]
Limits = namedtuple("Limits", "y v e coasts longest last")


def plan_of(o: Any, first: Any) -> np.ndarray:
    """The table of the plan (see `plan_table`), SI; o, first : see `Craft`."""
    craft = Craft(o, first)
    if o.schedule == CHOICES.schedule.published:
        coasts, burns, signs = np.transpose(PUBLISHED)
        plan = Plan(coasts, signs * craft.velocity_changes(burns))
    else:
        plan = design(craft)
    (ignition, longitude, drift), _ = craft.fly_plan(plan)
    _, gains, _ = feedback(craft, plan, limits_of(o))
    return plan_rows(Row(ignition, plan.dv, longitude, drift, *gains.T))


def middles(craft: Craft, plan: Plan) -> tuple[np.ndarray, float]:
    """(times of the middles of the burns, time of the last cut-off) [rev]."""
    burns = craft.burn_times(plan.dv)
    ends = np.cumsum(plan.coasts + burns)
    return (ends - 0.5 * burns) / SIDEREAL_DAY, float(ends[-1]) / SIDEREAL_DAY


def modelled(craft: Craft, plan: Plan, lacking: End) -> End:
    """The end of the plan by the drift model: impulses in the middles of the burns, the mean pull between them.

    lacking : what the flight has beyond the drift model.
    Longitude [rad] and drift [rad/rev] by (3.46) over each coast; an impulse moves the eccentricity vector by 2 dv / V0
    along the radius.
    """
    when, end = middles(craft, plan)
    y, v = drift_model.after_correction(craft.y, craft.v, 0.0, when[0], *craft.pull)
    e = craft.e
    check = end + 0.5  # the longitude that counts is the mean of the day after
    for dv, now, following in zip(plan.dv, when, [*when[1:], check], strict=True):
        e = e + drift_model.E_PER_DV * dv * np.exp(1j * (craft.aim + TURN * now + y))
        y, v = drift_model.after_correction(y, v, drift_model.DRIFT_PER_DV * dv, following - now, *craft.pull)
    # what the drift will be is that of the longitude, which the outward pull joins
    return End(y + lacking.y, v + craft.pull[1] + lacking.v, e + lacking.e, end)


def feedback(craft: Craft, plan: Plan, limits: Limits) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(B, gains, costs) for deviations [rad, rad/rev] from one ignition to the next, and to the check at the end.

    (3.46) and (3.25)-(3.30), see `drift_model.best_corrections`; the end counts in thirds of its tolerances.
    """
    when, end = middles(craft, plan)
    ignition = when - 0.5 * craft.burn_times(plan.dv) / SIDEREAL_DAY
    following = np.append(ignition[1:], end + 0.5)
    a = np.array([[[1.0, t], [0.0, 1.0]] for t in following - ignition])
    b = np.column_stack([following - when, np.ones(len(when))])
    terminal = np.diag([(3.0 / limits.y) ** 2, (3.0 / limits.v) ** 2])
    return b, *drift_model.best_corrections(a, b, 1e-6 * terminal[1, 1], terminal, craft.o.assumed_thrust)


def design(craft: Craft) -> Plan:
    """Corrections and coasts that end at the place, with the drift asked for and a small eccentricity.

    The source's successive approximations: the plan of the drift model that costs least is flown with finite burns in
    the full dynamics, and what the model lacks at the end is added to the next plan's aim; most settle in two or three
    passes.
    Coasts [s], corrections [m/s].
    """
    limits, lacking = limits_of(craft.o), End(0.0, 0.0, 0.0, 0.0)
    starts = first_approximations(craft, limits)
    for _ in range(PASSES):
        improved = [better for start in starts if (better := _improved(craft, limits, lacking, start))]
        if not improved:
            raise ModelError(
                "no phasing plan was found within the limits on coasts, time, last correction and eccentricity; "
                "another aim or number of corrections may do"
            )
        _, plan = min(improved, key=lambda pair: pair[0])
        _, flown = craft.fly_plan(plan)
        if abs(flown.y) < SETTLED * limits.y and abs(flown.v - craft.o.aim_drift) < SETTLED * limits.v:
            return plan
        wrong, starts = modelled(craft, plan, lacking), [plan]
        lacking = End(*(have + flew - model for have, flew, model in zip(lacking, flown, wrong, strict=True)))
    raise ModelError("the phasing plan does not settle; another number of corrections, or more time, may do")


def first_approximations(craft: Craft, limits: Limits) -> list[Plan]:
    """Plans to start the search from: the source's profiles at several lengths of the coasts; [s, m/s]."""
    profile = drift_model.braking if craft.o.aim == CHOICES.aim.fuel else drift_model.fastest
    plans = []
    for longer in (0.0, 0.25, 0.5):
        shortest = limits.coasts.copy()
        shortest[1:] = np.maximum(shortest[1:] + longer, 0.01)  # no two impulses at once bring the craft to its place
        u, t = profile(craft.y, craft.v, limits.last, shortest)
        dv = u / drift_model.DRIFT_PER_DV
        burns = craft.burn_times(dv)
        coasts = t * SIDEREAL_DAY - 0.5 * (burns + np.concatenate([[0.0], burns[:-1]]))
        plans.append(Plan(np.maximum(coasts, shortest * SIDEREAL_DAY), dv))
    return plans


def limits_of(o: Any) -> Limits:
    """The limits that the settings ask for [rad, rad/rev, rev]; the last correction by `largest_last`."""
    y, v, e = o.longitude_tolerance, TURN * o.period_tolerance / SIDEREAL_DAY, o.eccentricity_tolerance
    coasts = np.full(int(o.planned_corrections), o.least_coast / SIDEREAL_DAY)
    coasts[0] = o.first_coast / SIDEREAL_DAY
    least = coasts.sum() * SIDEREAL_DAY
    if o.longest_transfer < least:
        raise ModelError(
            f"the least coasts of {coasts.size} corrections take {least / 86_400.0:.2f} days: give more "
            "longest_transfer_days, or less first_coast_h or least_coast_h"
        )
    last = np.radians(drift_model.largest_last(np.degrees(y), np.degrees(v), e, max(o.assumed_thrust, 1e-6), 0.5))
    return Limits(y, v, e, coasts, o.longest_transfer / SIDEREAL_DAY, o.largest_last or last)


def _improved(craft: Craft, limits: Limits, lacking: End, start: Plan) -> tuple[float, Plan] | None:
    """(cost [m/s] or [rev], plan) of least cost near a start; None where the limits cannot be met from there."""
    n = len(start.dv)
    signs = np.sign(start.dv)

    def plan(z):
        """Plan, coasts [s] and corrections [m/s], of unknowns with the coasts [rev] first."""
        return Plan(SIDEREAL_DAY * z[:n], z[n:])

    def cost(z):
        """Speed change [m/s] with the spread's share in it; where time is the aim, the time [rev] and 0.02 of that."""
        candidate = plan(z)
        b, _, costs = feedback(craft, candidate, limits)
        spread = drift_model.planned_cost(b, costs, drift_model.DRIFT_PER_DV * candidate.dv, craft.o.assumed_thrust)
        spent = (signs * candidate.dv).sum() + DV_OF_COST * spread
        return modelled(craft, candidate, lacking).time + 0.02 * spent if craft.o.aim == CHOICES.aim.time else spent

    def equal(z):
        """Longitude and drift at the end against those aimed at, in the unit of their limits."""
        end = modelled(craft, plan(z), lacking)
        return np.array([end.y / limits.y, (end.v - craft.o.aim_drift) / limits.v])

    def inside(z):
        """What may not be negative: 1 less the squared fraction of the eccentricity's limit used; time left [rev]."""
        end = modelled(craft, plan(z), lacking)
        return np.array([1.0 - abs(end.e) ** 2 / (E_PLANNED * limits.e) ** 2, limits.longest - end.time])

    largest = np.append(np.full(n - 1, 20.0), abs(limits.last / drift_model.DRIFT_PER_DV))
    bounds = [(low, limits.longest) for low in limits.coasts]
    bounds += [(0.0, size) if sign > 0.0 else (-size, 0.0) for sign, size in zip(signs, largest, strict=True)]
    conditions = ({"type": "eq", "fun": equal}, {"type": "ineq", "fun": inside})
    first = np.concatenate([start.coasts / SIDEREAL_DAY, start.dv])
    search = scipy.optimize.minimize(
        cost, first, method="SLSQP", bounds=bounds, constraints=conditions, options={"maxiter": 300, "ftol": 1e-10}
    )
    feasible = np.abs(equal(search.x)).max() < 1e-6 and inside(search.x).min() > -1e-6
    return (float(search.fun), plan(search.x)) if feasible else None
