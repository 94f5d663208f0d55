"""From the limit of large thrust to the wanted optimum, step by step.  Canonical units, unknowns as in `unknowns_of`.

Two burns: impulses give the guess at a large thrust, which is then lowered.  Three burns grow out of two.  An elliptic
parking orbit is reached from the circle through its perigee, with the first burn about either node, or from the planar
sequence, with the first burn about perigee; the cheapest of what is found is the optimum.  No number here depends on
the orbit or on the engine.
"""

from collections import namedtuple
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import scipy  # loads its packages when they are used

from campaigns.geo_injection.design.coast import coast
from campaigns.geo_injection.design.optimal import (
    FIRST_OF_THREE,
    FIRST_PLACE,
    Instead,
    Problem,
    Solution,
    first_states,
    local_axes,
    solve,
    switch_states,
    unknowns_of,
)
from mc_engine.errors import ModelError

LARGE_THRUSTS = (5.0, 100.0, 1000.0)  # over the first weight: burns are then short arcs, near enough to impulses
GENTLE_THRUST = 0.1  # over the first weight: burns are still short enough for another one to be put ahead of them
WIDE = np.radians(20.0)  # plane change at which the search starts, if less is wanted
_FIRST_STEP, _LONGEST_STEP, _LEAST_STEP = 0.1, 0.25, 1e-5  # of the way
_FAR = 0.3  # of a step: distance of a solution from what was foreseen
_PLACE_STEP = 0.1  # rad, in which the first place is looked for
_VANISHING = 0.01  # of all burning: a burn that short is about to leave the sequence
_SHORT = 0.05  # first length of an added burn, and how it grows, over the burn that it relieves

# speed changes; semi-major axis of the transfer orbit; primer vector at the first impulse and its rate
Impulsive = namedtuple("Impulsive", "first second a primer rate")


def optimum(problem: Problem) -> Solution:
    """The optimum of two or three burns, in canonical units; ModelError tells how far the search got."""
    if problem.burns not in (2, 3):
        raise ModelError(f"the optimal sequence has 2 or 3 burns, not {problem.burns}")
    apogee = (1.0 + problem.eccentricity) / (1.0 - problem.eccentricity)
    if apogee >= problem.ratio:
        raise ModelError(
            f"the parking orbit reaches {apogee / problem.ratio:.4g} of the final radius; sequences are designed to "
            "circles outside of it: lower parking_altitude_km or parking_eccentricity, or raise final_radius_km"
        )
    x = _two_burns(problem) if problem.burns == 2 else _three_burns(problem)
    durations, coasts, states = x[7 : 7 + problem.burns], x[7 + problem.burns :], switch_states(problem, x[None])[0]
    ends = states[1:-1:2]
    a = 1.0 / (2.0 / np.linalg.norm(ends[:, :3], axis=1) - (ends[:, 3:6] ** 2).sum(1))
    # a coast of a period, 2 pi a^1.5 by Kepler's third law, ends at a later apsis than the first: another sequence
    if not (coasts < 2.0 * np.pi * a**1.5).all():
        raise ModelError(f"the search for the optimal {problem.burns} burns found only one that lets a revolution pass")
    return Solution(problem, durations, coasts, np.cumsum([0.0, *(durations[:-1] + coasts)]), states)


def two_impulses(plane_change: float, ratio: float) -> Impulsive:
    """Two impulses at the apses on the node, between circles of radius 1 and `ratio`, canonical units.

    Least in speed over a split of the plane change: a bound of every sequence's propellant from below, and a guess.
    """
    a = 0.5 * (1.0 + ratio)
    at_perigee, at_apogee, final = np.sqrt(ratio / a), np.sqrt(1.0 / (ratio * a)), np.sqrt(1.0 / ratio)

    def changes(inclination: float) -> tuple[np.ndarray, np.ndarray]:
        """Velocity changes at perigee and apogee over a transfer orbit of this inclination [rad]."""
        along = np.array([0.0, np.cos(inclination), np.sin(inclination)])
        before = np.array([0.0, np.cos(plane_change), np.sin(plane_change)])
        return at_perigee * along - before, at_apogee * along - np.array([0.0, final, 0.0])

    def cost(inclination: float) -> float:
        return float(sum(np.linalg.norm(change) for change in changes(inclination)))

    best = scipy.optimize.minimize_scalar(cost, bounds=(0.0, plane_change), options={"xatol": 1e-12}).x
    first, second = changes(best)
    start = np.array([1.0, 0.0, 0.0, 0.0, at_perigee * np.cos(best), at_perigee * np.sin(best)])
    sizes = float(np.linalg.norm(first)), float(np.linalg.norm(second))
    primer = first / sizes[0]
    return Impulsive(*sizes, a, primer, _primer_rate(start, primer, second / sizes[1], np.pi * a**1.5))


def _primer_rate(start: np.ndarray, first: np.ndarray, second: np.ndarray, dt: float) -> np.ndarray:
    """Rate of the primer vector at the first impulse: it becomes `second` after dt, and is longest at both.

    Half a revolution leaves one component free, so the five conditions (Lawden, 1963, chapter 5) on three numbers are
    met by least squares.  Canonical units.
    """
    basis = np.zeros((4, 12))
    basis[:, :6] = start
    basis[0, 6:9] = first
    basis[1:, 9:12] = np.eye(3)
    moved = coast(basis, np.full(4, dt))[:, 6:]
    own, by_rate = moved[0], moved[1:].T
    rows = np.vstack([by_rate[:3], first, second @ by_rate[3:]])
    return np.linalg.lstsq(rows, np.array([*(second - own[:3]), 0.0, -second @ own[3:]]), rcond=1e-9)[0]


def propellant_share(speed_change: float, exhaust: float) -> float:
    """Fraction of the initial mass that impulses of a total speed change need: eq. (1), integrated."""
    return float(-np.expm1(-speed_change / exhaust))


def _impulsive_guess(problem: Problem) -> np.ndarray:
    """Unknowns from two impulses: burns by the rocket equation, eq. (1), centred on the apses."""
    two = two_impulses(problem.plane_change, problem.ratio)
    first = propellant_share(two.first, problem.exhaust) / problem.flow
    second = propellant_share(two.first + two.second, problem.exhaust) / problem.flow - first
    primer, wait = two.primer - 0.5 * first * two.rate, np.pi * two.a**1.5 - 0.5 * (first + second)
    return unknowns_of(problem, -0.5 * first, primer, two.rate, [first, second], [wait])


def _two_burns(problem: Problem) -> np.ndarray:
    """Two-burn unknowns: from a circle as it comes, from an ellipse the cheapest of all ways."""
    ways: list[Callable[[Problem], np.ndarray]] = [_from_node]
    if problem.eccentricity > 0.0:
        ways = [_from_node, partial(_from_node, descending=True), _from_perigee]
        ways = ways if problem.plane_change > 0.0 else ways[2:]
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
    """The problem with a plane change that is not small: at a small one, a large thrust may begin nearly anywhere."""
    return problem if problem.plane_change == 0.0 else replace(problem, plane_change=max(problem.plane_change, WIDE))


def _from_node(problem: Problem, descending: bool = False) -> np.ndarray:
    """Impulses at a large thrust, then the eccentricity, then less thrust, then less plane change if it is small.

    About the descending node: from the mirror image about the earth's centre, which a circle allows.
    """
    wide = _widened(problem)
    for large in LARGE_THRUSTS:
        circle = replace(wide.with_thrust(max(large, wide.thrust)), eccentricity=0.0)
        x = solve(circle, _impulsive_guess(circle))
        if x is not None:
            break
    else:
        raise ModelError("the search for the optimal burns did not start, not even at a large thrust")
    if descending:
        x[[3, 6]] *= -1.0  # the normal components
        x[0] += np.pi
    ellipse = replace(circle, eccentricity=problem.eccentricity)
    return _follow(wide, problem, _follow(ellipse, wide, _follow(circle, ellipse, x)))


def _from_perigee(problem: Problem) -> np.ndarray:
    """The planar circle, then eccentricity and plane change with the first place [rad] held, then the best place.

    A planar circle has no place of its own, and an ellipse that is nearly one only a soft one.  Less thrust comes last.
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
    for by in (_PLACE_STEP, -_PLACE_STEP):
        step = by * np.eye(1, x.size)[0]
        while (moved := solve(problem, x + step, FIRST_PLACE)) is not None and moved[7:9].sum() < x[7:9].sum():
            x = moved
    best = solve(problem, x)
    if best is None or abs(best[0] - x[0]) > 3.0 * _PLACE_STEP:
        raise ModelError("the search for the optimal burns found no best place of the first one on the parking orbit")
    return best


def _between(start: Problem, end: Problem, share: float) -> Problem:
    """A fraction of the way from one problem to another: thrust along its logarithm, the rest along lines."""
    if share >= 1.0:
        return end
    thrust = start.thrust * (end.thrust / start.thrust) ** share
    change = start.plane_change + share * (end.plane_change - start.plane_change)
    e = start.eccentricity + share * (end.eccentricity - start.eccentricity)
    return replace(start.with_thrust(thrust), plane_change=change, eccentricity=e)


def _follow(start: Problem, end: Problem, x: np.ndarray, instead: Instead | None = None) -> np.ndarray:
    """Unknowns of the problem `end` from those of `start`, by steps that are fractions of the way.

    Each is foreseen from the last two solutions (secant).  A solution far from what was foreseen belongs to another
    family of extremals, and the step is halved.
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
    """How far the search got: thrust as a fraction of the wanted one, angles in the unit deg; and what may help."""
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

    The burn times scale with 1 / thrust; sqrt(1 + e) is the rate of the place at perigee, in canonical units.
    """
    n, guess = here.burns, x.copy()
    guess[7 : 7 + n] *= here.thrust / there.thrust
    added = guess[7 : 7 + n] - x[7 : 7 + n]
    guess[0] -= 0.5 * added[0] * np.sqrt(1.0 + here.eccentricity)
    guess[7 + n :] -= 0.5 * (added[:-1] + added[1:])
    return guess


def _three_burns(problem: Problem) -> np.ndarray:
    """Unknowns of three burns, canonical units, by the first thrust of a series of ratio 1.5 that opens a way."""
    wide = _widened(problem) if problem.eccentricity == 0.0 else problem
    start = wide.with_thrust(max(wide.thrust, GENTLE_THRUST))
    for _ in range(8):
        try:
            x = _with_burn_ahead(start, _two_burns(replace(start, burns=2)))
        except ModelError:
            x = None
        if x is not None:
            return _follow(wide, problem, _follow(start, wide, x))
        start = start.with_thrust(1.5 * start.thrust)
    raise ModelError("the search for three optimal burns found no burn to put ahead of the two-burn optimum")


def _with_burn_ahead(problem: Problem, two: np.ndarray) -> np.ndarray | None:
    """Three-burn unknowns from those of two burns, or None.

    A short burn one revolution ahead is lengthened until the primer vector is as long at the end of the coast after it
    as at its start.  Durations in canonical units, the short burn as a fraction of the first of the two.
    """
    grow = _SHORT * two[7]
    x = solve(problem, _short_burn_ahead(problem, two, grow), FIRST_OF_THREE)
    last = None
    while x is not None and x[8] > _SHORT * two[7]:
        if last is not None and _gap(problem, x) * _gap(problem, last) < 0.0:
            return _where_lengths_agree(problem, last, x)
        while (longer := _longer(problem, last, x, grow)) is None and grow > 2e-4 * two[7]:
            grow *= 0.5
        last, x = x, longer
    return None


def _gap(problem: Problem, x: np.ndarray) -> float:
    """Length of the primer vector after the first coast less that before, 0 at the optimum: Lawden, chapter 5."""
    size = np.linalg.norm(switch_states(problem, x[None])[0, :, 6:9], axis=1)
    return float(size[2] - size[1])


def _longer(problem: Problem, before: np.ndarray | None, x: np.ndarray, grow: float) -> np.ndarray | None:
    """The solution with a first burn longer by `grow`, canonical units; the guess is linear in that burn's duration."""
    guess = x - grow * np.eye(1, x.size, 8)[0] if before is None else x + (x - before) * grow / (x[7] - before[7])
    guess[7] = x[7] + grow
    return solve(problem, guess, FIRST_OF_THREE)


def _where_lengths_agree(problem: Problem, low: np.ndarray, high: np.ndarray) -> np.ndarray | None:
    """Between two solutions of opposite gaps: a root of the gap, then all conditions; canonical units."""

    def between(share: float) -> np.ndarray | None:
        """Unknowns solved for from a guess that is a fraction of the way from `low` to `high`."""
        return solve(problem, low + share * (high - low), FIRST_OF_THREE)

    def gap(share: float) -> float:
        x = between(share)
        return np.nan if x is None else _gap(problem, x)

    try:
        x = between(scipy.optimize.brentq(gap, 0.0, 1.0, xtol=1e-9))
    except ValueError:  # a gap is not a number: there is no solution on the way
        return None
    return None if x is None else solve(problem, x)


def _short_burn_ahead(problem: Problem, two: np.ndarray, length: float) -> np.ndarray:
    """Guess of three burns, canonical: a short burn one revolution ahead, centred where the primer vector is longest.

    Lawden (1963), chapter 5: where that length exceeds 1 on a coast, an impulse there saves propellant.
    """
    period = 2.0 * np.pi / (1.0 - problem.eccentricity) ** 1.5  # of the parking orbit
    start = first_states(problem, two[None])[0]
    times = np.linspace(-0.5, 2.0, 501)
    after = times[np.argmax(np.linalg.norm(coast(start, times)[:, 6:9], axis=1))]
    y = coast(start, np.array([after - 0.5 * length]))[0]
    at_node = local_axes(problem.plane_change, np.zeros(1))[0]
    place = float(np.arctan2(at_node[1] @ y[:3], at_node[0] @ y[:3]))
    burns, coasts = [length, two[7] - length, two[8]], [period - after + 1.5 * length, two[9]]
    return unknowns_of(problem, place, y[6:9], y[9:12], burns, coasts)
