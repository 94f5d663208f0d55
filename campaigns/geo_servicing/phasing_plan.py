"""The phasing plan: the source's corrections, or designed ones, with the gains that answer deviations.

Design: corrections and coasts of the drift model that leave the least cost, then the flight with finite burns in the
full dynamics tells what the model lacks at the end, and so on; four or five passes settle.  NumPy and SciPy, once for
all cases of the same settings.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize

from campaigns.geo_servicing import plan_table
from campaigns.geo_servicing.bellman import Corrections, best_corrections, planned_cost
from campaigns.geo_servicing.drift_model import DRIFT_PER_DV, E_PER_DV, braking, fastest, largest_last
from campaigns.geo_servicing.dynamics import SIDEREAL_DAY, TURN
from campaigns.geo_servicing.inputs import AIMS, SCHEDULES
from campaigns.geo_servicing.planned_flight import Craft, End, fly_plan
from mc_engine.errors import ModelError

# Coasts and burns of the source's corrections [s], and the signs that bring the drift to zero.
PUBLISHED = ((123_753.6, 7_726.3, 1.0), (37_692.0, 4_569.1, 1.0), (24_264.7, 1_290.3, -1.0))
FIRST_COAST, LEAST_COAST, LONGEST = 43_200.0, 21_600.0, 864_000.0  # s
Y_TOLERANCE, PERIOD_TOLERANCE, E_TOLERANCE = np.radians(0.05), 5.0, 4e-4
V_TOLERANCE = TURN * PERIOD_TOLERANCE / SIDEREAL_DAY  # rad/rev
E_PLANNED = 0.6 * E_TOLERANCE  # leaves the dispersions of thrust and pointing their part
PASSES = 6
SETTLED = 1e-3  # of the tolerances: a plan is done when its flight ends as near as that to what was aimed at
DV_OF_COST = 0.1  # m/s that one unit of expected cost is worth: a plan may spend so much to be surer of its end


@dataclass(frozen=True)
class Plan:
    """Coasts before the corrections [s] and their velocity changes [m/s], float64[n]."""

    coasts: np.ndarray
    dv: np.ndarray


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
    plan = published_plan(craft) if SCHEDULES[int(o.schedule)] == "published" else design(o, craft)
    flight = fly_plan(craft, plan.coasts, plan.dv)
    gains = gains_of(craft, plan, flight.ignition, float(o.assumed_thrust)).gains
    return plan_table.plan_rows(flight.ignition, plan.dv, flight.longitude, flight.drift, gains)


def published_plan(craft: Craft) -> Plan:
    """The source's corrections as velocity changes of this craft."""
    coasts, burns, signs = (np.array(one) for one in zip(*PUBLISHED, strict=True))
    return Plan(coasts, signs * craft.velocity_changes(burns))


def middles(craft: Craft, plan: Plan) -> tuple[np.ndarray, float]:
    """(times of the middles of the burns, time of the last cut-off) [rev]."""
    burns = craft.burn_times(plan.dv)
    ends = np.cumsum(plan.coasts + burns)
    return (ends - 0.5 * burns) / SIDEREAL_DAY, float(ends[-1]) / SIDEREAL_DAY


def modelled(craft: Craft, plan: Plan, lacking: Lacking) -> End:
    """The end of the plan by the drift model: impulses in the middles of the burns."""
    when, end = middles(craft, plan)
    u = DRIFT_PER_DV * plan.dv
    check = end + 0.5  # the longitude that counts is the mean of the day after
    y = craft.y + craft.v * check + (u * (check - when)).sum() + lacking.y
    before = craft.y + craft.v * when + np.array([(u[:k] * (when[k] - when[:k])).sum() for k in range(len(u))])
    direction = np.exp(1j * (craft.aim + TURN * when + before))
    e = craft.e + (E_PER_DV * plan.dv * direction).sum() + lacking.e
    return End(y, craft.v + u.sum() + lacking.v, e, end)


def steps(craft: Craft, plan: Plan) -> tuple[np.ndarray, np.ndarray]:
    """(A, B) of the deviations from one ignition to the next, and to the check at the end."""
    when, end = middles(craft, plan)
    ignition = when - 0.5 * craft.burn_times(plan.dv) / SIDEREAL_DAY
    following = np.append(ignition[1:], end + 0.5)
    a = np.array([[[1.0, t], [0.0, 1.0]] for t in following - ignition])
    return a, np.column_stack([following - when, np.ones(len(when))])


def gains_of(craft: Craft, plan: Plan, ignition: np.ndarray, sigma: float) -> Corrections:
    """Gains for deviations from the plan; the end counts in thirds of its tolerances."""
    a, b = steps(craft, plan)
    terminal = np.diag([(3.0 / Y_TOLERANCE) ** 2, (3.0 / V_TOLERANCE) ** 2])
    return best_corrections(a, b, np.zeros_like(b), np.zeros((2, 2)), 1e-6 * terminal[1, 1], terminal, sigma)


def design(o: Any, craft: Craft) -> Plan:
    """Corrections and coasts that end at the place, with the drift asked for and a small eccentricity."""
    lacking = Lacking()
    plan = None
    for _ in range(PASSES):
        plan = _best(o, craft, lacking, [plan] if plan else first_approximations(o, craft))
        flown = fly_plan(craft, plan.coasts, plan.dv).end
        wrong = modelled(craft, plan, lacking)
        lacking = Lacking(lacking.y + flown.y - wrong.y, lacking.v + flown.v - wrong.v, lacking.e + flown.e - wrong.e)
        if abs(flown.y) < SETTLED * Y_TOLERANCE and abs(flown.v - o.aim_drift) < SETTLED * V_TOLERANCE:
            return plan
    raise ModelError("the phasing plan does not settle; another number of corrections, or more time, may do")


def first_approximations(o: Any, craft: Craft) -> list[Plan]:
    """Plans to start the search from: the source's profiles at several lengths of the coasts."""
    n = int(o.planned_corrections)
    last = np.radians(_last(o))
    plans = []
    for longer in (0.0, 0.25, 0.5):
        shortest = np.full(n, LEAST_COAST / SIDEREAL_DAY + longer)
        shortest[0] = FIRST_COAST / SIDEREAL_DAY
        profile = braking if AIMS[int(o.aim)] == "fuel" else fastest
        u, t = profile(craft.y, craft.v, last, shortest)
        dv = u / DRIFT_PER_DV
        burns = craft.burn_times(dv)
        coasts = t * SIDEREAL_DAY - 0.5 * (burns + np.concatenate([[0.0], burns[:-1]]))
        plans.append(Plan(np.maximum(coasts, shortest * SIDEREAL_DAY), dv))
    return plans


def _last(o: Any) -> float:
    """Largest last correction [deg/rev]."""
    y, v = np.degrees(Y_TOLERANCE), np.degrees(V_TOLERANCE)
    return largest_last(y, v, E_TOLERANCE, max(float(o.assumed_thrust), 1e-6), 0.5)


def _best(o: Any, craft: Craft, lacking: Lacking, starts: list[Plan]) -> Plan:
    """The plan of least cost among those that the starts lead to."""
    found = [_improved(o, craft, lacking, start) for start in starts]
    good = [one for one in found if one is not None]
    if not good:
        raise ModelError("no phasing plan meets the limits on coasts, time, last correction and eccentricity")
    return min(good, key=lambda pair: pair[0])[1]


def _improved(o: Any, craft: Craft, lacking: Lacking, start: Plan) -> tuple[float, Plan] | None:
    """(cost, plan) of least cost near a start; None where the limits cannot be met from there."""
    n = len(start.dv)
    signs = np.sign(start.dv)
    sigma = float(o.assumed_thrust)
    sooner = AIMS[int(o.aim)] == "time"

    def plan(z):
        return Plan(SIDEREAL_DAY * z[:n], z[n:])

    def cost(z):
        one = plan(z)
        _, b = steps(craft, one)
        corrections = gains_of(craft, one, np.empty(0), sigma)
        spread = planned_cost(b, corrections.costs, DRIFT_PER_DV * one.dv, sigma)
        spent = (signs * one.dv).sum() + DV_OF_COST * spread
        return modelled(craft, one, lacking).time + 0.02 * spent if sooner else spent

    def equal(z):
        end = modelled(craft, plan(z), lacking)
        return np.array([end.y / Y_TOLERANCE, (end.v - o.aim_drift) / V_TOLERANCE])

    def inside(z):
        end = modelled(craft, plan(z), lacking)
        return np.array([1.0 - abs(end.e) ** 2 / E_PLANNED**2, LONGEST / SIDEREAL_DAY - end.time])

    least = np.full(n, LEAST_COAST / SIDEREAL_DAY)
    least[0] = FIRST_COAST / SIDEREAL_DAY
    largest = np.full(n, 20.0)
    largest[-1] = abs(np.radians(_last(o)) / DRIFT_PER_DV)
    bounds = [(low, LONGEST / SIDEREAL_DAY) for low in least]
    bounds += [(0.0, size) if sign > 0.0 else (-size, 0.0) for sign, size in zip(signs, largest, strict=True)]
    limits = ({"type": "eq", "fun": equal}, {"type": "ineq", "fun": inside})
    first = np.concatenate([start.coasts / SIDEREAL_DAY, start.dv])
    found = minimize(
        cost, first, method="SLSQP", bounds=bounds, constraints=limits, options={"maxiter": 300, "ftol": 1e-10}
    )
    good = np.abs(equal(found.x)).max() < 1e-6 and inside(found.x).min() > -1e-6
    return (float(found.fun), plan(found.x)) if good else None
