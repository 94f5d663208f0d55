"""Subset simulation: a small probability as a product of larger ones, each estimated by Markov chains.

The first level has plain cases.  The tenth of them with the smallest margins are the starts of Markov chains, which
explore the inputs at or below the largest of these margins.  The tenth with the smallest margins among all these start
the next level, and so on.  Several runs are flown together, one step of all their chains at a time.  They share only
the margins of the levels and the size of the steps.  The estimate is their mean, and the interval comes from their
scatter, so it does not depend on the correlation within chains.

Au & Beck, Probabilistic Engineering Mechanics 16 (2001), 263-277.  Chains: conditional sampling, which works in any
number of inputs, with adaptive step; Papaioannou, Betz, Zwirglmaier & Straub, Prob. Eng. Mech. 41 (2015), 89-103.
Runs with shared levels have no bias once the levels are given: Cerou, Del Moral, Furon & Guyader, Statistics and
Computing 22 (2012), 795-808.

Valid if the margin decreases gradually towards failure.  An abrupt failure, in a part of the inputs where margins are
large, may be missed by all runs; more cases per level help.
"""

import math
from typing import NamedTuple

import numpy as np

from mc_engine.sampling.streams import stream
from mc_engine.statistics.binomial import clopper_pearson
from mc_engine.statistics.rare_events import (
    FRESH,
    Flights,
    Level,
    Margin,
    RareEvent,
    interval_of_mean,
    plain_count,
)

RUNS = 10
SHARE = 0.1  # of a level's cases that start the chains of the next
FEWEST_SEEDS = 5  # of the chains of a level, for each run
MOST_LEVELS = 15
_WANTED_ACCEPTANCE = 0.44  # Papaioannou et al. (2015), section 4.2
_FIRST_SCALE = 0.6
_KEEPS_NOISE = 0.5  # share of the steps that leave the noise of the flight as it is
_POOR_ACCEPTANCE = 0.05
_POOR_RENEWAL = 0.01  # below it the intervals of planes with noise missed the probability in half of the trials
_DISAGREE = 30.0  # largest over smallest estimate of the runs; chance alone brings some 5


class Members(NamedTuple):
    """Cases that stand for a level: u float64[n, n_inputs], margin float64[n]; case, noise and run int64[n]."""

    u: np.ndarray
    margin: np.ndarray
    case: np.ndarray
    noise: np.ndarray
    run: np.ndarray

    def take(self, index: np.ndarray) -> "Members":
        return Members(*(values[index] for values in self))


class Climb(NamedTuple):
    """The last level reached.

    reached : float64[RUNS], each run's probability of the last level, which `members` represent.  weight : float64, of
        every case flown.  flat : whether equal margins ended the levels.  renewed : the least accepted fraction, of all
        levels, of the steps that drew the noise of the flight anew.
    """

    members: Members
    reached: np.ndarray
    levels: tuple[Level, ...]
    weight: np.ndarray
    flat: bool
    renewed: float


def subset_simulation(
    margin: Margin,
    n_inputs: int,
    *,
    cases_per_level: int = 10_000,
    seed: int = 0,
    confidence: float = 0.95,
    noise: bool = False,
) -> RareEvent:
    """Probability that margin(u) <= 0 for u of `n_inputs` independent standard normal numbers.

    margin : float64[n, n_inputs] -> float64[n];  NaN counts as failed.
    cases_per_level : of all runs together, at least 50 for each.
    noise : True: margin is called as margin(u, addresses), addresses int64[n]; see `rare_events`.
    Returns a RareEvent.
    """
    per_run = cases_per_level // RUNS
    if per_run * SHARE < FEWEST_SEEDS:
        least = round(RUNS * FEWEST_SEEDS / SHARE)
        raise ValueError(f"{cases_per_level} cases per level are too few; {least} are the least")
    flights, rng = Flights(margin, noise), stream(seed, "subset simulation", 0)
    climb = _run_levels(flights, rng, n_inputs, per_run)
    if len(climb.levels) == 1:
        return plain_count(flights, climb.levels, confidence)
    estimates = climb.reached * _shares(climb.members.run[climb.members.margin <= 0.0], per_run)
    lower, upper = interval_of_mean(estimates, confidence)
    cases = flights.evaluated(climb.weight)
    if not estimates.any():  # failure is rarer than the last level
        upper = interval_of_mean(climb.reached, confidence)[1]
    if climb.renewed < _POOR_RENEWAL:
        plain = cases.failed[cases.level == 0]
        low, high = clopper_pearson(int(plain.sum()), plain.size, confidence)
        lower, upper = min(lower, low), max(upper, high)
    mean = float(estimates.mean())
    error = float(estimates.std(ddof=1)) / (mean * math.sqrt(RUNS)) if mean > 0.0 else math.inf
    remarks = tuple(_remarks(climb, estimates))
    return RareEvent("subset", mean, lower, upper, confidence, error, climb.levels, cases, remarks)


def _run_levels(flights: Flights, rng: np.random.Generator, n_inputs: int, per_run: int) -> Climb:
    """Level by level to the failures, or until there is no further level."""
    n = per_run * RUNS
    fresh, run = np.full(n, FRESH), np.repeat(np.arange(RUNS), per_run)
    members = _flown(flights, rng.standard_normal((n, n_inputs)), fresh, run, 0)
    reached, scale, renewed = np.ones(RUNS), _FIRST_SCALE, 1.0
    levels, weights = [Level(math.inf, 1.0, RUNS, n, 1.0)], list[tuple[np.ndarray, np.ndarray]]()
    while True:
        threshold = _threshold(members.margin)
        weight = reached[members.run] / n
        if threshold is None or threshold <= 0.0 or len(levels) == MOST_LEVELS:
            total = np.zeros(flights.n)
            for cases, share in [*weights, (members.case, weight)]:
                np.add.at(total, cases, share)
            return Climb(members, reached, tuple(levels), total, threshold is None, renewed)
        near = members.margin <= threshold
        weights.append((members.case[~near], weight[~near]))
        reached = reached * _shares(members.run[near], per_run)
        before = flights.n
        seeds, level = members.take(near), len(levels)
        members, accepted, anew, scale = _chains(flights, rng, seeds, per_run, threshold, scale, level)
        renewed = min(renewed, anew)
        alive = int(np.count_nonzero(reached))
        levels.append(Level(threshold, float(reached.mean()), alive, flights.n - before, accepted))


def _shares(run: np.ndarray, per_run: int) -> np.ndarray:
    """float64[RUNS]: how much of each run's members these are."""
    return np.bincount(run, minlength=RUNS) / per_run


def _flown(flights: Flights, u: np.ndarray, noise: np.ndarray, run: np.ndarray, level: int) -> Members:
    return Members(u, *flights.fly(u, noise, level), run)


def _threshold(margin: np.ndarray) -> float | None:
    """Margin of the next level: the nearest tenth is at or below it.  Zero at the last, None if ties forbid one."""
    seeds = round(SHARE * margin.size)
    value = float(np.partition(margin, seeds - 1)[seeds - 1])
    if value <= 0.0:
        return 0.0
    if np.count_nonzero(margin <= value) <= margin.size // 2:
        return value
    below = margin[margin < value]  # most cases share one margin: the level goes below that plateau
    if below.size >= FEWEST_SEEDS * RUNS and below.max() > 0.0:
        return float(below.max())
    return None


def _chains(
    flights: Flights, rng: np.random.Generator, seeds: Members, per_run: int, threshold: float, scale: float, level: int
) -> tuple[Members, float, float, float]:
    """(members at or below the threshold, share of steps accepted, of those with new noise, scale); `per_run` a run.

    The seeds are among the members.  Candidate: rho u + sigma times a normal vector, rho^2 + sigma^2 = 1, which keeps
    the normal density, so it is accepted if it is at or below the threshold.  Papaioannou et al. (2015), eq. (15) and
    (24).  Half of the steps keep the noise of the flight, the others draw it anew with the inputs; both keep its
    distribution.
    """
    state, length = _shared_out(seeds.take(rng.permutation(seeds.case.size)), per_run)
    spread = np.minimum(seeds.u.std(axis=0), 1.0)
    kept, shares, anew = [state], list[float](), list[np.ndarray]()
    for step in range(1, int(length.max())):
        state, length = state.take(length > step), length[length > step]
        sigma = np.minimum(scale * spread, 1.0)
        u = np.sqrt(1.0 - sigma * sigma) * state.u + sigma * rng.standard_normal(state.u.shape)
        noise = np.where(rng.random(length.size) < _KEEPS_NOISE, state.noise, FRESH)
        flown = _flown(flights, u, noise, state.run, level)
        accepted = flown.margin <= threshold
        state = Members(
            np.where(accepted[:, None], flown.u, state.u),
            *(np.where(accepted, new, old) for new, old in zip(flown[1:], state[1:], strict=True)),
        )
        kept.append(state)
        shares.append(float(accepted.mean()))
        anew.append(accepted[noise == FRESH])
        scale = min(max(scale * math.exp((shares[-1] - _WANTED_ACCEPTANCE) / math.sqrt(len(shares))), 1e-3), 10.0)
    members = Members(*(np.concatenate(values) for values in zip(*kept, strict=True)))
    return members, float(np.mean(shares)), float(np.concatenate(anew).mean()), scale


def _shared_out(seeds: Members, per_run: int) -> tuple[Members, np.ndarray]:
    """(seeds, length of the chain of each), so that the chains of a run hold `per_run` members together."""
    order = np.argsort(seeds.run, kind="stable")
    seeds = seeds.take(order)
    _, first, count = np.unique(seeds.run, return_index=True, return_counts=True)
    place = np.arange(seeds.run.size) - np.repeat(first, count)
    each = np.repeat(count, count)
    return seeds, per_run // each + (place < per_run % each)


def _remarks(climb: Climb, estimates: np.ndarray) -> list[str]:
    remarks, levels = [], climb.levels
    if not estimates.any():
        remarks.append(
            f"No case failed in {len(levels)} levels: the probability is below the upper bound, and that is all that "
            "is shown."
        )
    elif not estimates.all():
        remarks.append(
            f"{np.count_nonzero(estimates == 0.0)} of {estimates.size} runs found no failed case: the interval is "
            "rough, and more cases per level are needed."
        )
    elif estimates.max() > _DISAGREE * estimates.min():
        remarks.append(
            f"The runs disagree, from {estimates.min():.1e} to {estimates.max():.1e}: there may be failures that "
            "some of them did not find. Fly more cases per level."
        )
    if climb.flat:
        remarks.append("On the way the margin became the same for nearly all cases; from there plain shares are used.")
    poor = [k for k, level in enumerate(levels) if level.accepted < _POOR_ACCEPTANCE]
    if poor:
        remarks.append(
            f"In level {poor[0]} only {levels[poor[0]].accepted:.1%} of the steps were accepted: the chains hardly "
            "move, because failure hangs on the noise of the flight or on very few inputs together. The interval may "
            "be too narrow."
        )
    if climb.renewed < _POOR_RENEWAL:
        remarks.append(
            "In a level fewer than 1 % of the steps with new noise of the flight were accepted, as where the noise "
            "decides the failures: the estimate may be far off. The interval includes that of the plain cases of level "
            "0."
        )
    return remarks
