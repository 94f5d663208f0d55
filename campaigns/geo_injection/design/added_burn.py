"""Three burns out of two: a short burn is put one revolution ahead of the two-burn optimum and lengthened until the
primer vector is as long at the end of the coast after it as at its start.  Canonical units.
"""

import numpy as np
import scipy  # loads its packages when they are used

from campaigns.geo_injection.design.coast import coast
from campaigns.geo_injection.design.optimal import (
    Problem,
    first_burn,
    first_states,
    local_axes,
    solve,
    switch_states,
    unknowns_of,
)

_SHORT = 0.05  # first length of an added burn, and how it grows, over the burn that it relieves


def with_burn_ahead(problem: Problem, two: np.ndarray) -> np.ndarray | None:
    """Three-burn unknowns from those of two burns, canonical, or None."""
    grow = _SHORT * two[7]
    x = solve(problem, _short_burn_ahead(problem, two, grow), first_burn(problem))
    last = None
    while x is not None and x[8] > _SHORT * two[7]:
        if last is not None and _gap(problem, x) * _gap(problem, last) < 0.0:
            return _where_lengths_agree(problem, last, x)
        longer = None
        while longer is None and grow > 1e-4 * two[7]:
            longer = _longer(problem, last, x, grow)
            grow = grow if longer is not None else 0.5 * grow
        last, x = x, longer
    return None


def _gap(problem: Problem, x: np.ndarray) -> float:
    """Length of the primer vector after the first coast less that before; 0 at the optimum (Lawden, chapter 5)."""
    size = np.linalg.norm(switch_states(problem, x[None])[0, :, 6:9], axis=1)
    return float(size[2] - size[1])


def _longer(problem: Problem, before: np.ndarray | None, x: np.ndarray, grow: float) -> np.ndarray | None:
    """The solution with a first burn longer by `grow`, canonical time; the guess is linear in that burn's duration."""
    guess = x.copy()
    if before is not None:
        guess = x + (x - before) * grow / (x[7] - before[7])
    else:
        guess[8] -= grow
    guess[7] = x[7] + grow
    return solve(problem, guess, first_burn(problem))


def _where_lengths_agree(problem: Problem, low: np.ndarray, high: np.ndarray) -> np.ndarray | None:
    """Between two solutions of opposite gaps: a root of the gap, canonical, then all conditions at once."""

    def between(share: float) -> np.ndarray | None:
        return solve(problem, low + share * (high - low), first_burn(problem))

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

    Lawden, chapter 5: where that length exceeds 1 on a coast, an impulse there saves propellant.
    """
    period = 2.0 * np.pi / (1.0 - problem.eccentricity) ** 1.5
    start = first_states(problem, two[None])
    times = np.linspace(-0.5, 2.0, 501)
    sizes = np.linalg.norm(coast(np.repeat(start, times.size, axis=0), times)[:, 6:9], axis=1)
    after = times[np.argmax(sizes)]
    y = coast(start, np.array([after - 0.5 * length]))[0]
    at_node = local_axes(problem.plane_change, np.zeros(1))[0]
    place = float(np.arctan2(at_node[1] @ y[:3], at_node[0] @ y[:3]))
    burns, coasts = [length, two[7] - length, two[8]], [period - after + 1.5 * length, two[9]]
    return unknowns_of(problem, place, y[6:9], y[9:12], burns, coasts)
