"""The phasing plan: the source's corrections, or designed ones, with the gains that answer deviations.

Design: corrections and coasts of the drift model that leave the least cost, then the flight with finite burns in the
full dynamics tells what the model lacks at the end, and so on; two or three passes settle.  NumPy and SciPy, once for
all cases of the same settings.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize

from campaigns.geo_servicing import plan_table
from campaigns.geo_servicing.bellman import Corrections, best_corrections, planned_cost
from campaigns.geo_servicing.drift_model import DRIFT_PER_DV, E_PER_DV, after_correction, braking, fastest, largest_last
from campaigns.geo_servicing.dynamics import SIDEREAL_DAY
from campaigns.geo_servicing.inputs import AIMS, SCHEDULES
from campaigns.geo_servicing.planned_flight import Craft, End, Flight, fly_plan
from mc_engine.errors import ModelError
from mc_engine.physics.frames import TURN

# Coasts and burns of the source's corrections [s], and the signs that bring the drift to zero.
PUBLISHED = ((123_753.6, 7_726.3, 1.0), (37_692.0, 4_569.1, 1.0), (24_264.7, 1_290.3, -1.0))
E_PLANNED = 0.6  # of the tolerance: leaves the dispersions of thrust and pointing their part
PASSES = 6
SETTLED = 1e-3  # of the tolerances: a plan is done when its flight ends as near as that to what was aimed at
DV_OF_COST = 0.1  # m/s that one unit of expected cost is worth: a plan may spend so much to be surer of its end


@dataclass(frozen=True)
class Plan:
    """Coasts before the corrections [s] and their velocity changes [m/s], float64[n]."""

    coasts: np.ndarray
    dv: np.ndarray


@dataclass(frozen=True)
class Limits:
    """What a plan must keep.

    y, v, e : tolerances of the end [rad, rad/rev, 1];  first, least, longest : coasts and whole transfer [rev]
    last : largest last correction [rad/rev]
    """

    y: float
    v: float
    e: float
    first: float
    least: float
    longest: float
    last: float

    def coasts(self, n: int) -> np.ndarray:
        """Least coasts before n corrections [rev]."""
        return np.array([self.first, *[self.least] * (n - 1)])


@dataclass(frozen=True)
class Lacking:
    """What the flight has at the end beyond the drift model: longitude [rad], drift [rad/rev], eccentricity vector."""

    y: float = 0.0
    v: float = 0.0
    e: complex = 0.0


def plan_of(o: Any, tables: np.ndarray, first: Any) -> np.ndarray:
    """The table of the plan for the settings o (see `plan_table`).

    tables : of the model behind the plan;  first : the nominal case's kernel parameters
    """
    craft = Craft(o, tables, first)
    if SCHEDULES[int(o.schedule)] == "published":
        plan = published_plan(craft)
        flight = fly_plan(craft, plan.coasts, plan.dv)
    else:
        plan, flight = design(o, craft)
    gains = gains_of(craft, plan, limits_of(o), float(o.assumed_thrust)).gains
    return plan_table.plan_rows(flight.ignition, plan.dv, flight.longitude, flight.drift, gains)


def published_plan(craft: Craft) -> Plan:
    """The source's corrections as velocity changes of this craft."""
    coasts, burns, signs = (np.array(column) for column in zip(*PUBLISHED, strict=True))
    return Plan(coasts, signs * craft.velocity_changes(burns))


def middles(craft: Craft, plan: Plan) -> tuple[np.ndarray, float]:
    """(times of the middles of the burns, time of the last cut-off) [rev]."""
    burns = craft.burn_times(plan.dv)
    ends = np.cumsum(plan.coasts + burns)
    return (ends - 0.5 * burns) / SIDEREAL_DAY, float(ends[-1]) / SIDEREAL_DAY


def modelled(craft: Craft, plan: Plan, lacking: Lacking) -> End:
    """The end of the plan by the drift model: impulses in the middles of the burns, the mean pull between them.

    Longitude [rad] and drift [rad/rev] by (3.46) over each coast; an impulse moves the eccentricity vector by 2 dv / V0
    along the radius.
    """
    when, end = middles(craft, plan)
    y, v = after_correction(craft.y, craft.v, 0.0, when[0], *craft.pull)
    e = craft.e
    check = end + 0.5  # the longitude that counts is the mean of the day after
    for dv, now, following in zip(plan.dv, when, [*when[1:], check], strict=True):
        e = e + E_PER_DV * dv * np.exp(1j * (craft.aim + TURN * now + y))
        y, v = after_correction(y, v, DRIFT_PER_DV * dv, following - now, *craft.pull)
    # what the drift will be is that of the longitude, which the outward pull joins
    return End(y + lacking.y, v + craft.pull[1] + lacking.v, e + lacking.e, end)


def steps(craft: Craft, plan: Plan) -> tuple[np.ndarray, np.ndarray]:
    """(A, B) of the deviations [rad, rad/rev] from one ignition to the next, and to the check at the end.  (3.46)"""
    when, end = middles(craft, plan)
    ignition = when - 0.5 * craft.burn_times(plan.dv) / SIDEREAL_DAY
    following = np.append(ignition[1:], end + 0.5)
    a = np.array([[[1.0, t], [0.0, 1.0]] for t in following - ignition])
    return a, np.column_stack([following - when, np.ones(len(when))])


def gains_of(craft: Craft, plan: Plan, limits: Limits, sigma: float) -> Corrections:
    """Gains for deviations [rad, rad/rev] from the plan, (3.25)-(3.30); the end counts in thirds of its tolerances."""
    a, b = steps(craft, plan)
    terminal = np.diag([(3.0 / limits.y) ** 2, (3.0 / limits.v) ** 2])
    return best_corrections(a, b, np.zeros_like(b), np.zeros((2, 2)), 1e-6 * terminal[1, 1], terminal, sigma)


def design(o: Any, craft: Craft) -> tuple[Plan, Flight]:
    """Corrections and coasts that end at the place, with the drift asked for and a small eccentricity; their flight.

    The source's successive approximations: the plan of the drift model is flown in the full dynamics, and what the
    model lacks at the end [rad, rad/rev] is added to the next plan's aim.
    """
    limits, lacking, plan = limits_of(o), Lacking(), None
    for _ in range(PASSES):
        plan = _best(o, craft, limits, lacking, [plan] if plan else first_approximations(o, craft, limits))
        flight = fly_plan(craft, plan.coasts, plan.dv)
        flown = flight.end
        wrong = modelled(craft, plan, lacking)
        lacking = Lacking(lacking.y + flown.y - wrong.y, lacking.v + flown.v - wrong.v, lacking.e + flown.e - wrong.e)
        if abs(flown.y) < SETTLED * limits.y and abs(flown.v - o.aim_drift) < SETTLED * limits.v:
            return plan, flight
    raise ModelError("the phasing plan does not settle; another number of corrections, or more time, may do")


def first_approximations(o: Any, craft: Craft, limits: Limits) -> list[Plan]:
    """Plans to start the search from: the source's profiles at several lengths of the coasts."""
    n = int(o.planned_corrections)
    plans = []
    for longer in (0.0, 0.25, 0.5):
        shortest = limits.coasts(n)
        shortest[1:] += longer
        profile = braking if AIMS[int(o.aim)] == "fuel" else fastest
        u, t = profile(craft.y, craft.v, limits.last, shortest)
        dv = u / DRIFT_PER_DV
        burns = craft.burn_times(dv)
        coasts = t * SIDEREAL_DAY - 0.5 * (burns + np.concatenate([[0.0], burns[:-1]]))
        plans.append(Plan(np.maximum(coasts, shortest * SIDEREAL_DAY), dv))
    return plans


def limits_of(o: Any) -> Limits:
    """The limits that the settings ask for [rad, rad/rev, rev]; the last correction by `largest_last`."""
    v = TURN * float(o.period_tolerance) / SIDEREAL_DAY
    y, e, sigma = float(o.longitude_tolerance), float(o.eccentricity_tolerance), max(float(o.assumed_thrust), 1e-6)
    last = np.radians(largest_last(np.degrees(y), np.degrees(v), e, sigma, 0.5))
    first, least, longest = (float(time) / SIDEREAL_DAY for time in (o.first_coast, o.least_coast, o.longest_transfer))
    return Limits(y, v, e, first, least, longest, float(o.largest_last) or float(last))


def _best(o: Any, craft: Craft, limits: Limits, lacking: Lacking, starts: list[Plan]) -> Plan:
    """The plan of least cost among those that the starts lead to."""
    improved = [_improved(o, craft, limits, lacking, start) for start in starts]
    feasible = [candidate for candidate in improved if candidate is not None]
    if not feasible:
        raise ModelError("no phasing plan meets the limits on coasts, time, last correction and eccentricity")
    return min(feasible, key=lambda pair: pair[0])[1]


def _improved(o: Any, craft: Craft, limits: Limits, lacking: Lacking, start: Plan) -> tuple[float, Plan] | None:
    """(cost [m/s or rev], plan) of least cost near a start; None where the limits cannot be met from there."""
    n = len(start.dv)
    signs = np.sign(start.dv)
    sigma = float(o.assumed_thrust)
    sooner = AIMS[int(o.aim)] == "time"

    def plan(z):
        return Plan(SIDEREAL_DAY * z[:n], z[n:])

    def cost(z):
        candidate = plan(z)
        _, b = steps(craft, candidate)
        corrections = gains_of(craft, candidate, limits, sigma)
        spread = planned_cost(b, corrections.costs, DRIFT_PER_DV * candidate.dv, sigma)
        spent = (signs * candidate.dv).sum() + DV_OF_COST * spread
        return modelled(craft, candidate, lacking).time + 0.02 * spent if sooner else spent

    def equal(z):
        end = modelled(craft, plan(z), lacking)
        return np.array([end.y / limits.y, (end.v - o.aim_drift) / limits.v])

    def inside(z):
        end = modelled(craft, plan(z), lacking)
        return np.array([1.0 - abs(end.e) ** 2 / (E_PLANNED * limits.e) ** 2, limits.longest - end.time])

    largest = np.full(n, 20.0)
    largest[-1] = abs(limits.last / DRIFT_PER_DV)
    bounds = [(low, limits.longest) for low in limits.coasts(n)]
    bounds += [(0.0, size) if sign > 0.0 else (-size, 0.0) for sign, size in zip(signs, largest, strict=True)]
    conditions = ({"type": "eq", "fun": equal}, {"type": "ineq", "fun": inside})
    first = np.concatenate([start.coasts / SIDEREAL_DAY, start.dv])
    search = minimize(
        cost, first, method="SLSQP", bounds=bounds, constraints=conditions, options={"maxiter": 300, "ftol": 1e-10}
    )
    feasible = np.abs(equal(search.x)).max() < 1e-6 and inside(search.x).min() > -1e-6
    return (float(search.fun), plan(search.x)) if feasible else None
