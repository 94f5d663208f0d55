"""From the limit of large thrust to the wanted optimum, step by step.

Two burns: impulses give the guess at a large thrust, which is then lowered.  Three burns (`added_burn.py`) grow out of
two.  An elliptic parking orbit is reached from the circle through its perigee, with the first burn about either node,
or from the planar sequence, with the first burn about perigee; the cheapest of what is found is the optimum.  No
number here depends on the orbit or on the engine.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from campaigns.geo_injection.design.added_burn import with_burn_ahead
from campaigns.geo_injection.design.impulsive import propellant_share, two_impulses
from campaigns.geo_injection.design.optimal import (
    FIRST_PLACE,
    Instead,
    Problem,
    Solution,
    solve,
    switch_states,
    unknowns_of,
)
from mc_engine.errors import ModelError

LARGE_THRUST = 5.0  # over the first weight: burns are then short arcs
GENTLE_THRUST = 0.1  # over the first weight: burns are still short enough for another one to be put ahead of them
WIDE = np.radians(20.0)  # plane change at which the search starts, if less is wanted
_FIRST_STEP, _LONGEST_STEP, _LEAST_STEP = 0.1, 0.25, 1e-5  # of the way
_FAR = 0.3  # of a step: distance of a solution from what was foreseen
_PLACE_STEP = 0.1  # rad, in which the first place is looked for
_VANISHING = 0.01  # of all burning: a burn that short is about to leave the sequence


def optimum(problem: Problem) -> Solution:
    """The optimum of two or three burns; ModelError tells how far the search got."""
    if problem.burns not in (2, 3):
        raise ModelError(f"the optimal sequence has 2 or 3 burns, not {problem.burns}")
    _refuse_descents(problem)
    x = _two_burns(problem) if problem.burns == 2 else _three_burns(problem)
    solution = Solution(problem, x, switch_states(problem, x[None])[0])
    _refuse_waiting(solution)
    return solution


def _refuse_descents(problem: Problem) -> None:
    """The sequences begin about perigee and end at apogee, so the final circle has to lie outside the parking orbit.

    Compared in canonical radii: the apogee is (1 + e) / (1 - e).
    """
    farthest = (1.0 + problem.eccentricity) / (1.0 - problem.eccentricity)
    if farthest >= problem.ratio:
        raise ModelError(
            f"the parking orbit reaches {farthest / problem.ratio:.4g} of the final radius; sequences are designed to "
            "circles outside of it: lower parking_altitude_km or parking_eccentricity, or raise final_radius_km"
        )


def _refuse_waiting(solution: Solution) -> None:
    """Each coast ends at the first apsis that serves: one that lasts longer belongs to another sequence.

    The period of a coast's orbit is 2 pi a^1.5 in canonical units (Kepler's third law).
    """
    ends = solution.states[1:-1:2]
    a = 1.0 / (2.0 / np.linalg.norm(ends[:, :3], axis=1) - (ends[:, 3:6] ** 2).sum(1))
    if not (solution.coasts < 2.0 * np.pi * a**1.5).all():
        raise ModelError(
            f"the search for the optimal {solution.problem.burns} burns found only one that lets a revolution pass"
        )


def _impulsive_guess(problem: Problem) -> np.ndarray:
    """Unknowns from two impulses: burns by the rocket equation, eq. (1), centred on the apses; canonical units."""
    two = two_impulses(problem.plane_change, problem.ratio)
    first = propellant_share(two.first, problem.exhaust) / problem.flow
    second = propellant_share(two.first + two.second, problem.exhaust) / problem.flow - first
    primer, coast = two.primer - 0.5 * first * two.rate, np.pi * two.a**1.5 - 0.5 * (first + second)
    return unknowns_of(problem, -0.5 * first, primer, two.rate, [first, second], [coast])


def _two_burns(problem: Problem) -> np.ndarray:
    """Two-burn unknowns, canonical: from a circle as it comes, from an ellipse the cheapest of all ways."""
    ways: list[Callable[[Problem], np.ndarray]] = [_from_node]
    if problem.eccentricity > 0.0:
        ways = [_from_perigee]
        if problem.plane_change > 0.0:
            ways = [_from_node, partial(_from_node, descending=True), _from_perigee]
    solved, failed = [], []
    for way in ways:
        try:
            solved.append(way(problem))
        except ModelError as error:
            failed.append(error)
    if not solved:
        raise failed[-1]
    return min(solved, key=lambda x: float(x[7] + x[8]))


def _widened(problem: Problem) -> Problem:
    """The problem with a plane change that is not small.

    At small plane changes every place on a circle is nearly as good for the first ignition, and the search at a large
    thrust loses its way; so it goes by a larger plane change.
    """
    return problem if problem.plane_change == 0.0 else replace(problem, plane_change=max(problem.plane_change, WIDE))


def _from_node(problem: Problem, descending: bool = False) -> np.ndarray:
    """Impulses at a large thrust, then the eccentricity, then less thrust, then less plane change if it is small.

    The first burn is about the ascending node, or about the descending one: from the mirror image about the earth's
    centre, which a circle allows.  It changes the sign of the normal components and moves the place by pi [rad].
    """
    wide = _widened(problem)
    circle = replace(wide.with_thrust(max(LARGE_THRUST, wide.thrust)), eccentricity=0.0)
    x = solve(circle, _impulsive_guess(circle))
    if x is None:
        raise ModelError("the search for the optimal burns did not start, not even at a large thrust")
    if descending:
        x[[3, 6]] *= -1.0
        x[0] += np.pi
    ellipse = replace(circle, eccentricity=problem.eccentricity)
    return _follow(wide, problem, _follow(ellipse, wide, _follow(circle, ellipse, x)))


def _from_perigee(problem: Problem) -> np.ndarray:
    """The planar circle, then the eccentricity and the plane change with the first place held, then the best place.

    A planar circle has no place of its own, and an ellipse that is nearly one only a soft one.  Less thrust comes last.

    Canonical units.
    """
    strong = problem.with_thrust(max(problem.thrust, 2.0 * GENTLE_THRUST))
    circle = replace(strong, plane_change=0.0, eccentricity=0.0)
    x = _from_node(circle)
    x[0] += problem.perigee
    planar = replace(strong, plane_change=0.0)
    x = _follow(planar, strong, _follow(circle, planar, x, FIRST_PLACE), FIRST_PLACE)
    return _follow(strong, problem, _best_place(strong, x))


def _best_place(problem: Problem, x: np.ndarray) -> np.ndarray:
    """Unknowns with the first place [rad] free: it is moved by steps while the burns grow shorter."""

    def moved(x: np.ndarray, by: float) -> np.ndarray | None:
        return solve(problem, x + by * np.eye(1, x.size)[0], FIRST_PLACE)

    for by in (_PLACE_STEP, -_PLACE_STEP):
        following = moved(x, by)
        while following is not None and following[7:9].sum() < x[7:9].sum():
            x, following = following, moved(following, by)
    best = solve(problem, x)
    if best is None or abs(best[0] - x[0]) > 3.0 * _PLACE_STEP:
        raise ModelError("the search for the optimal burns found no best place of the first one on the parking orbit")
    return best


def _between(start: Problem, end: Problem, share: float) -> Problem:
    """On the way from one problem to another, canonical: thrust along its logarithm, the rest along lines."""
    if share >= 1.0:
        return end
    thrust = start.thrust * (end.thrust / start.thrust) ** share
    change = start.plane_change + share * (end.plane_change - start.plane_change)
    e = start.eccentricity + share * (end.eccentricity - start.eccentricity)
    return replace(start.with_thrust(thrust), plane_change=change, eccentricity=e)


def _follow(start: Problem, end: Problem, x: np.ndarray, instead: Instead | None = None) -> np.ndarray:
    """Unknowns of the problem `end` from those of `start`, each step foreseen from the last two solutions.

    A solution far from what was foreseen belongs to another family of extremals, and the step is halved.

    Secant prediction; the unknowns and their distances are canonical.
    """
    if start == end:
        return x
    done, step = 0.0, _FIRST_STEP
    last: tuple[float, np.ndarray] | None = None
    while done < 1.0:
        share = min(1.0, done + step)
        here, there = _between(start, end, done), _between(start, end, share)
        line = x if last is None else x + (share - done) / (done - last[0]) * (x - last[1])
        guess = _longer_burns(here, there, x) if last is None else line
        solution = solve(there, guess, instead)
        if solution is None or np.abs(solution - guess).max() > _FAR * max(1.0, np.abs(solution - x).max()):
            step *= 0.5
            if step < _LEAST_STEP:
                raise ModelError(_how_far(here, end, x))
            continue
        last, x, done, step = (done, x), solution, share, min(1.5 * step, _LONGEST_STEP)
    return x


def _how_far(here: Problem, end: Problem, x: np.ndarray) -> str:
    """How far the search got from thrust, plane change [deg] and eccentricity that it began with, and what may help."""
    where = [f"{here.thrust / end.thrust:.3f} of the wanted thrust"]
    where.append(f"a plane change of {np.degrees(here.plane_change):.3f} of {np.degrees(end.plane_change):.3f} deg")
    if end.eccentricity > 0.0:
        where.append(f"a parking eccentricity of {here.eccentricity:.4f} of {end.eccentricity:.4f}")
    burns = x[7 : 7 + here.burns]
    advice = "more thrust, or more burns, may have a solution"
    if burns.min() < _VANISHING * burns.sum():
        advice = f"burn {np.argmin(burns) + 1} was vanishing there: one burn less may do"
    return f"the search for the optimal {end.burns} burns stopped at {', '.join(where[:-1])} and {where[-1]}; {advice}"


def _longer_burns(here: Problem, there: Problem, x: np.ndarray) -> np.ndarray:
    """The same sequence with burns longer by what the thrust is smaller, about the same middles.

    The burn times scale with 1 / thrust, in canonical units; sqrt(1 + e) is the rate of the place at perigee.
    """
    n, guess = here.burns, x.copy()
    longer = here.thrust / there.thrust
    guess[7 : 7 + n] *= longer
    added = guess[7 : 7 + n] - x[7 : 7 + n]
    guess[0] -= 0.5 * added[0] * np.sqrt(1.0 + here.eccentricity)
    guess[7 + n :] -= 0.5 * (added[:-1] + added[1:])
    return guess


def _three_burns(problem: Problem) -> np.ndarray:
    """Unknowns of three burns: at the wanted thrust, or at the lowest larger one where the way there is open."""
    wide = _widened(problem) if problem.eccentricity == 0.0 else problem
    start = wide.with_thrust(max(wide.thrust, GENTLE_THRUST))
    for _ in range(8):
        try:
            x = with_burn_ahead(start, _two_burns(replace(start, burns=2)))
        except ModelError:
            x = None
        if x is not None:
            return _follow(wide, problem, _follow(start, wide, x))
        start = start.with_thrust(1.5 * start.thrust)
    raise ModelError("the search for three optimal burns found no burn to put ahead of the two-burn optimum")
