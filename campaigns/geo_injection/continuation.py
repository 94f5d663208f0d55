"""From the limit of large thrust to the wanted optimum, step by step.

Two burns: impulses give the guess at a large thrust, which is then lowered.  Three burns: a short burn is put one
revolution ahead of the two-burn optimum and lengthened until the primer vector is as long at the end of the coast
after it as at its start.  No number here depends on the orbit or on the engine.
"""

from dataclasses import replace

import numpy as np

from campaigns.geo_injection.coast import coast
from campaigns.geo_injection.impulsive import propellant_share, two_impulses
from campaigns.geo_injection.optimal import (
    Problem,
    Solution,
    first_states,
    local_axes,
    solve,
    switch_states,
)
from mc_engine.errors import ModelError

LARGE_THRUST = 5.0  # over the first weight: burns are then short arcs
WIDE = np.radians(20.0)  # plane change at which the search starts, if less is wanted
_FIRST_STEP, _LONGEST_STEP, _LEAST_STEP = 0.1, 0.25, 1e-5  # of the way
_FAR = 0.3  # of a step: distance of a solution from what was foreseen
_SHORT = 0.05  # first length of an added burn, and how it grows, over the burn that it relieves


def optimum(problem: Problem) -> Solution:
    """The optimum of two or three burns; ModelError tells how far the search got."""
    if problem.burns not in (2, 3):
        raise ModelError(f"the optimal sequence has 2 or 3 burns, not {problem.burns}")
    if problem.burns == 2:
        x = _two_burns(problem)
    else:
        x = _three_burns(problem)
    return Solution(problem, x, switch_states(problem, x[None])[0])


def _impulsive_guess(problem: Problem) -> np.ndarray:
    """Unknowns from two impulses: burns as long as the rocket equation says, centred on the apses."""
    two = two_impulses(problem.plane_change, problem.ratio)
    first = propellant_share(two.first, problem.exhaust) / problem.flow
    second = propellant_share(two.first + two.second, problem.exhaust) / problem.flow - first
    place = -0.5 * first
    axes = local_axes(problem.plane_change, np.array([place]))[0]
    primer = two.primer - 0.5 * first * two.rate
    return np.array(
        [place, *axes @ primer, *axes @ two.rate, first, second, np.pi * two.a**1.5 - 0.5 * (first + second)]
    )


def _two_burns(problem: Problem) -> np.ndarray:
    """Two-burn unknowns: impulses, then less thrust, then less inclination if it is small.

    At small plane changes every place on the parking orbit is nearly as good for the first ignition, and the search at
    a large thrust loses its way; so it goes by a larger plane change.
    """
    wide = problem if problem.plane_change == 0.0 else replace(problem, plane_change=max(problem.plane_change, WIDE))
    top = wide.with_thrust(max(LARGE_THRUST, problem.thrust))
    x = solve(top, _impulsive_guess(top))
    if x is None:
        raise ModelError("the search for the optimal burns did not start, not even at a large thrust")
    return _follow(wide, problem, _follow(top, wide, x))


def _between(start: Problem, end: Problem, share: float) -> Problem:
    """On the way from one problem to another: thrust along its logarithm, plane change along a line."""
    if share >= 1.0:
        return end
    thrust = start.thrust * (end.thrust / start.thrust) ** share
    change = start.plane_change + share * (end.plane_change - start.plane_change)
    return replace(start.with_thrust(thrust), plane_change=change)


def _follow(start: Problem, end: Problem, x: np.ndarray) -> np.ndarray:
    """Unknowns of the problem `end` from those of `start`, each step foreseen from the last two solutions.

    A solution far from what was foreseen belongs to another family of extremals, and the step is halved.
    """
    if start == end:
        return x
    done, step = 0.0, _FIRST_STEP
    last: tuple[float, np.ndarray] | None = None
    while done < 1.0:
        share = min(1.0, done + step)
        here, there = _between(start, end, done), _between(start, end, share)
        line = x if last is None else x + (share - done) / (done - last[0]) * (x - last[1])
        found = solve(there, _longer_burns(here, there, x) if last is None else line)
        guess = _longer_burns(here, there, x) if last is None else line
        if found is None or np.abs(found - guess).max() > _FAR * max(1.0, np.abs(found - x).max()):
            step *= 0.5
            if step < _LEAST_STEP:
                raise ModelError(_how_far(here, end))
            continue
        last, x, done, step = (done, x), found, share, min(1.5 * step, _LONGEST_STEP)
    return x


def _how_far(here: Problem, end: Problem) -> str:
    return (
        f"the search for the optimal {end.burns} burns stopped at {here.thrust / end.thrust:.3f} of the wanted thrust "
        f"and a plane change of {np.degrees(here.plane_change):.3f} of {np.degrees(end.plane_change):.3f} deg; "
        "more thrust, or more burns, may have a solution"
    )


def _longer_burns(here: Problem, there: Problem, x: np.ndarray) -> np.ndarray:
    """The same sequence with burns longer by what the thrust is smaller, about the same middles."""
    n, guess = here.burns, x.copy()
    longer = here.thrust / there.thrust
    guess[7 : 7 + n] *= longer
    guess[0] *= longer
    added = guess[7 : 7 + n] - x[7 : 7 + n]
    guess[7 + n :] -= 0.5 * (added[:-1] + added[1:])
    return guess


def _three_burns(problem: Problem) -> np.ndarray:
    """Unknowns of three burns: at the wanted thrust, or at the lowest one where the way there is open."""
    wide = problem if problem.plane_change == 0.0 else replace(problem, plane_change=max(problem.plane_change, WIDE))
    start = wide
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
    """Three-burn unknowns from those of two burns, or None."""
    grow = _SHORT * two[7]
    x = solve(problem, _short_burn_ahead(problem, two, grow), grow)
    last: tuple[float, np.ndarray] | None = None
    while x is not None and x[8] > _SHORT * two[7]:
        here = _gap(problem, x), x
        if last is not None and here[0] * last[0] < 0.0:
            return _where_lengths_agree(problem, last, here)
        longer = None
        while longer is None and grow > 1e-4 * two[7]:
            longer = _longer(problem, last, x, grow)
            grow = grow if longer is not None else 0.5 * grow
        last, x = here, longer
    return None


def _gap(problem: Problem, x: np.ndarray) -> float:
    """Length of the primer vector after the first coast less that before it."""
    size = np.linalg.norm(switch_states(problem, x[None])[0, :, 6:9], axis=1)
    return float(size[2] - size[1])


def _longer(problem: Problem, before: tuple | None, x: np.ndarray, grow: float) -> np.ndarray | None:
    """The solution with a first burn longer by `grow`."""
    guess = x.copy()
    if before is not None:
        guess = x + (x - before[1]) * grow / (x[7] - before[1][7])
    else:
        guess[8] -= grow
    guess[7] = x[7] + grow
    return solve(problem, guess, guess[7])


def _where_lengths_agree(problem: Problem, low: tuple, high: tuple) -> np.ndarray | None:
    """Between two solutions of opposite gaps: the Illinois rule, then all conditions at once."""
    (f0, x0), (f1, x1) = low, high
    x = x1
    for _ in range(20):
        share = f0 / (f0 - f1)
        guess = x0 + share * (x1 - x0)
        found = solve(problem, guess, guess[7])
        if found is None:
            return None
        x, f = found, _gap(problem, found)
        if abs(f) < 1e-9:
            break
        if f * f1 < 0.0:
            f0, x0 = f1, x1
        else:
            f0 *= 0.5
        f1, x1 = f, x
    return solve(problem, x)


def _short_burn_ahead(problem: Problem, two: np.ndarray, length: float) -> np.ndarray:
    """Guess of three burns: a burn where the primer vector is longest on the parking orbit, one revolution ahead."""
    start = first_states(problem.plane_change, two[None])
    times = np.linspace(-0.5, 2.0, 501)
    sizes = np.linalg.norm(coast(np.repeat(start, times.size, axis=0), times)[:, 6:9], axis=1)
    after = times[np.argmax(sizes)]
    y = coast(start, np.array([after - 0.5 * length]))[0]
    place = two[0] + after - 0.5 * length
    axes = local_axes(problem.plane_change, np.array([place]))[0]
    revolution = 2.0 * np.pi - after + 1.5 * length
    return np.array(
        [place, *axes @ y[6:9], *axes @ y[9:12], length, two[7] - length, two[8], revolution, two[9]]
    )  # fmt: skip
