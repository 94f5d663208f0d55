"""Which inputs, and which pairs of them, separate the failed cases from the passed ones.

Numbers have two rank tests: whether failed cases are at one end of the range, and whether they are at both ends or in
the middle.  Words and switches: whether a level has more than its proportion of the failed cases.  Pairs: whether the
product of the two rank scores explains failures beyond a straight line and a parabola of each input.  The
false-discovery rate is controlled over all tests of a kind, over all inputs and requirements.

A driver is a difference between two groups of cases, not a cause: an input that is correlated with a driver is found,
too.

Sobol' points are not independent: the few of them in a narrow part of one input may all lie in one half of another one,
which then separates failed from passed cases without an effect.  With 10 to 19 failed cases, inputs without effect were
found in 30 % of tests, and with independent cases in 9 %; with 20 and more as rarely as with independent cases.  Pairs
without effect were found in up to a third of tests, so pairs are not tested.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy  # loads its packages when they are used

from mc_engine.statistics.binomial import clopper_pearson, hypergeometric_tails
from mc_engine.statistics.input_columns import InputColumn, average_ranks, equal_bins, input_columns
from mc_engine.statistics.picked_cases import picked_rows

FALSE_DISCOVERIES = 0.05  # at most this share of what is reported, on average
ONE_END = 1.96  # standard deviations of a half of an input, or between the two halves: 5 % by chance
FEWEST = 5  # failed, and passed, cases for a single driver
FEWEST_FOR_PAIRS = 10
FEWEST_OF_SOBOL = 20  # for a single driver, where the cases are Sobol' points
MOST_LEVELS = 20  # of a group that enters pairs
MOST_ROWS = 20_000  # above: half of it failed cases and half others, picked of each if they are more
BINS = 10  # of the success probability along an input


@dataclass(frozen=True)
class Driver:
    """An input, or a pair, that separates failed from passed cases.

    where : at what values cases fail, one text for each input: "high", "low", "at both ends", "at the high end", "at
        the low end", "in the middle", or a level.
    effect : Cliff's delta, 2 P(a failed case ranks above a passed one) - 1, in the direction of `where`; 1: complete
        separation, 0: none.  adjusted : p-value after Benjamini & Hochberg.
    inside_failed of inside_tried : for a pair, cases in the cell `where` (outer thirds of numbers); 0 for one input.
    """

    requirement: str
    inputs: tuple[str, ...]
    where: tuple[str, ...]
    effect: float
    p_value: float
    adjusted: float
    inside_failed: int = 0
    inside_tried: int = 0


@dataclass(frozen=True)
class Drivers:
    """Single inputs and pairs found, strongest evidence first, and how many of each were tested.

    undecided : requirements with fewer than `fewest` failed or passed cases.
    """

    singles: tuple[Driver, ...]
    pairs: tuple[Driver, ...]
    singles_tested: int
    pairs_tested: int
    undecided: tuple[str, ...]
    fewest: int


@dataclass(frozen=True)
class SuccessCurve:
    """Success probability in bins of an input, with Clopper-Pearson limits; all float64[n_bins] or int64[n_bins].

    middle, low, high : of the input's values in the bin; for words and switches, the index of the level.
    """

    middle: np.ndarray
    low: np.ndarray
    high: np.ndarray
    passed: np.ndarray
    tried: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    levels: tuple[str, ...]


def failure_drivers(inputs: Mapping[str, Any], failed: Mapping[str, np.ndarray], *, sobol: bool = False) -> Drivers:
    """The drivers of each requirement's failures.  failed : bool[n] by requirement, True also without a number.

    sobol : the cases are Sobol' points; pairs are not tested then.  Nor are pairs with an input that a case lacks.
    Benjamini & Hochberg, J. R. Stat. Soc. B 57 (1995), 289-300, over all tests of singles, and over all of pairs.
    """
    every = np.array([np.asarray(cases, dtype=bool) for cases in failed.values()])
    fewest = FEWEST_OF_SOBOL if sobol else FEWEST
    decided = [k for k, lost in enumerate(every) if _fewer_group(lost) >= fewest]
    names = list(failed)
    undecided = tuple(name for k, name in enumerate(names) if k not in decided)
    if not decided:
        return Drivers((), (), 0, 0, undecided, fewest)
    whole = input_columns(inputs)
    known = np.flatnonzero(np.broadcast_to(np.any([np.isfinite(one.values) for one in whole], axis=0), every.shape[1]))
    whole, every = [column.at(known) for column in whole], every[:, known]
    complete = {column.name: column for column in whole if np.isfinite(column.values).all()}
    singles: list[Driver] = []
    pairs: list[Driver] = []
    for group in [decided] if len(known) <= MOST_ROWS else [[k] for k in decided]:
        rows = _tested_rows(every[group[0]])
        columns, tested = [column.at(rows) for column in whole], {names[k]: every[k, rows] for k in group}
        singles += _single_tests(columns, tested, fewest)
        columns = [column for column in columns if column.varies and column.name in complete]
        rich = {name: lost for name, lost in tested.items() if not sobol and _fewer_group(lost) >= FEWEST_FOR_PAIRS}
        pairs += _pair_tests(columns, rich) if rich and len(columns) > 1 else []
    located = tuple(
        _located(pair, complete[pair.inputs[0]], complete[pair.inputs[1]], every[names.index(pair.requirement)])
        for pair in _discovered(pairs)
    )
    return Drivers(_discovered(singles), located, len(singles), len(pairs), undecided, fewest)


def _fewer_group(failed: np.ndarray) -> int:
    return int(min(failed.sum(), (~failed).sum()))


def success_along(values: Any, passed: np.ndarray, confidence: float = 0.95) -> SuccessCurve | None:
    """Success probability along one input; None without a case.  passed : bool[n]."""
    (column,) = input_columns({"": values})
    rows = np.flatnonzero(np.isfinite(column.values))
    if not rows.size:
        return None
    column, passed = column.at(rows), np.asarray(passed, dtype=bool)[rows]
    index, count = equal_bins(column, BINS)
    order = np.argsort(index, kind="stable")
    starts = np.searchsorted(index[order], np.arange(count))
    tried = np.bincount(index, minlength=count)
    good = np.bincount(index[passed], minlength=count)
    limits = np.array([clopper_pearson(int(k), int(n), confidence) for k, n in zip(good, tried, strict=True)])
    ordered = column.values[order]
    return SuccessCurve(
        middle=np.array([np.median(part) for part in np.split(ordered, starts[1:])]),
        low=np.minimum.reduceat(ordered, starts),
        high=np.maximum.reduceat(ordered, starts),
        passed=good,
        tried=tried,
        lower=limits[:, 0],
        upper=limits[:, 1],
        levels=column.levels,
    )


def _single_tests(columns: Sequence[InputColumn], failed: Mapping[str, np.ndarray], fewest: int) -> Iterator[Driver]:
    """The test of every input for each requirement, in the cases that have the input.

    An input from another run is missing where its case failed there: the other inputs still have all cases.
    """
    known = [np.flatnonzero(np.isfinite(column.values)) for column in columns]
    parts = [column.at(rows) for column, rows in zip(columns, known, strict=True)]
    for name, lost in failed.items():
        for part, rows in zip(parts, known, strict=True):
            if part.varies and _fewer_group(lost[rows]) >= fewest:
                yield _rank_test(name, part, lost[rows])


def _tested_rows(failed: np.ndarray) -> np.ndarray:
    """Rows of the cases that are tested: all, or of very many some of the failed and some of the others.

    failed : bool[n], of one requirement.  The test compares two groups, so their sizes do not bias it.  A selection by
    several requirements would: the cases that one of them passes would have more failures of the others.
    """
    if failed.size <= MOST_ROWS:
        return np.arange(failed.size)
    groups = np.flatnonzero(failed), np.flatnonzero(~failed)
    return np.sort(np.concatenate([group[picked_rows(group.size, MOST_ROWS // 2)] for group in groups]))


def _discovered(tested: list[Driver]) -> tuple[Driver, ...]:
    if not tested:
        return ()
    adjusted = _adjusted(np.array([driver.p_value for driver in tested]))
    discovered = [
        replace(driver, adjusted=float(value))
        for driver, value in zip(tested, adjusted, strict=True)
        if value <= FALSE_DISCOVERIES
    ]
    return tuple(sorted(discovered, key=lambda driver: (driver.p_value, -driver.effect)))


def _adjusted(p_values: np.ndarray) -> np.ndarray:
    """Adjusted p-values, float64[n]: the rate of false discoveries if this one is the last that counts as one."""
    order = np.argsort(p_values)
    scaled = p_values[order] * p_values.size / np.arange(1, p_values.size + 1)
    adjusted = np.empty(p_values.size)
    adjusted[order] = np.minimum.accumulate(scaled[::-1])[::-1].clip(0.0, 1.0)
    return adjusted


def _rank_test(requirement: str, column: InputColumn, failed: np.ndarray) -> Driver:
    if column.levels:
        return _level_test(requirement, column, failed)
    ranks = average_ranks(column.values)
    ends = average_ranks(np.abs(ranks - 0.5 * (ranks.size + 1)))
    (trend, p_trend), (spread, p_spread) = _separation(ranks, failed), _separation(ends, failed)
    if p_trend <= p_spread:
        where, effect = ("high" if trend > 0.0 else "low"), abs(trend)
    else:
        where, effect = (_ends(column.values, ranks, failed) if spread > 0.0 else "in the middle"), abs(spread)
    p_value = min(1.0, 2.0 * min(p_trend, p_spread))  # two were tried
    return Driver(requirement, (column.name,), (where,), effect, p_value, p_value)


def _ends(values: np.ndarray, ranks: np.ndarray, failed: np.ndarray) -> str:
    """At which ends of the values cases fail: at both, where each half of the cases shows its own beyond chance, or
    where the halves differ no more than by chance."""
    upper = ranks > 0.5 * (ranks.size + 1)
    rise, fall = (_normal_score(average_ranks(values[half]), failed[half]) for half in (upper, ~upper))
    apart = (rise + fall) / np.sqrt(2.0)  # failures of the lower half lie at its low end
    both = min(rise, -fall) > ONE_END or abs(apart) < ONE_END
    return "at both ends" if both else f"at the {'high' if apart > 0.0 else 'low'} end"


def _normal_score(ranks: np.ndarray, failed: np.ndarray) -> float:
    """A separation in its standard deviations; 0 where all cases fail, or none."""
    if failed.all() or not failed.any():
        return 0.0
    separation, p_value = _separation(ranks, failed)
    return float(-np.sign(separation) * scipy.special.ndtri(max(0.5 * p_value, np.finfo(float).tiny)))


def _separation(ranks: np.ndarray, failed: np.ndarray) -> tuple[float, float]:
    """Cliff's delta of failed against passed cases and its two-sided p-value, from average ranks.

    Mann & Whitney, Ann. Math. Stat. 18 (1947), 50-60, with the permutation variance, which ties are part of; Cliff,
    Psychol. Bull. 114 (1993), 494-509.  With few failed cases the normal tail is wider than the exact one.
    """
    n, n_failed = failed.size, int(failed.sum())
    n_passed = n - n_failed
    excess = float(ranks[failed].sum()) - 0.5 * n_failed * (n + 1)
    variance = n_failed * n_passed / (n * (n - 1.0)) * float(((ranks - 0.5 * (n + 1)) ** 2).sum())
    if variance == 0.0:
        return 0.0, 1.0
    return 2.0 * excess / (n_failed * n_passed), float(2.0 * scipy.special.ndtr(-abs(excess) / np.sqrt(variance)))


def _level_test(requirement: str, column: InputColumn, failed: np.ndarray) -> Driver:
    """The level with most or fewest failed cases for its size: Fisher's exact test of each level against all others."""
    levels, index, size = np.unique(column.values, return_inverse=True, return_counts=True)
    n, n_failed = failed.size, int(failed.sum())
    hits = np.bincount(index[failed], minlength=levels.size)
    drawn = zip(size.tolist(), hits.tolist(), strict=True)
    tail = np.array(
        [min(hypergeometric_tails(n, n_failed, level_size, level_hits)) for level_size, level_hits in drawn]
    )
    effects = hits / n_failed - (size - hits) / (n - n_failed)
    best = int(np.lexsort((-effects, tail))[0])
    # of two levels one test says all
    p_value = float(min(1.0, 2.0 * tail[best] * (1 if len(levels) == 2 else len(levels))))
    if len(levels) == 2:
        best = int(effects.argmax())
    where = column.levels[int(levels[best])]
    return Driver(
        requirement,
        (column.name,),
        (where if effects[best] >= 0.0 else f"not {where}",),
        float(abs(effects[best])),
        p_value,
        p_value,
    )


def _scores(column: InputColumn) -> list[np.ndarray]:
    """Centred scores of a column that products are made of: the rank, or, for more than two levels, a column each."""
    if column.ordered:
        ranks = average_ranks(column.values)
        return [2.0 * ranks / (ranks.size + 1) - 1.0]
    indicators = [(column.values == level).astype(np.float64) for level in np.unique(column.values)]
    return [indicator - indicator.mean() for indicator in indicators]


def _pair_tests(columns: Sequence[InputColumn], failed: Mapping[str, np.ndarray]) -> Iterator[Driver]:
    """The test of every pair of inputs, for each requirement; where its cases fail is not yet looked for.

    The scores of a pair and the failures are regressed on the scores of the single inputs and their squares; without an
    effect of the pair, the residuals of the two are uncorrelated.  The larger of two variances is used: with and
    without equal spread over the cases (White, Econometrica 48 (1980), 817-838).
    """
    scored = [
        (column.name, score) for column in columns if len(column.levels) <= MOST_LEVELS for score in _scores(column)
    ]
    table = np.column_stack([score for _, score in scored])
    owner = np.array([name for name, _ in scored])
    n = len(table)
    basis, sizes, _ = np.linalg.svd(np.column_stack([np.ones(n), table, table**2 - 1.0 / 3.0]), full_matrices=False)
    basis = basis[:, sizes > 1e-9 * sizes[0]]
    if n < 3 * basis.shape[1]:
        return
    lost = np.column_stack([cases.astype(np.float64) for cases in failed.values()])
    freed = lost - basis @ (basis.T @ lost)
    z: dict[tuple[str, str], list[np.ndarray]] = {}
    for k, (name, score) in enumerate(scored):
        others = np.flatnonzero(owner[k:] != name) + k  # the scores of one input stand together
        product = table[:, others] * score[:, None]
        product -= basis @ (basis.T @ product)
        for m, row in zip(others, _studentised(product, freed, n / (n - basis.shape[1])), strict=True):
            z.setdefault((name, scored[m][0]), []).append(np.abs(row))
    for pair, rows in z.items():
        for requirement, largest in zip(failed, np.max(rows, axis=0), strict=True):
            p_value = float(min(1.0, 2.0 * scipy.special.ndtr(-largest) * len(rows)))
            yield Driver(requirement, pair, ("", ""), 0.0, p_value, p_value)


def _studentised(product: np.ndarray, freed: np.ndarray, factor: float) -> np.ndarray:
    """Sum of product times failure residuals over its standard error, float64[n_products, n_requirements].

    0 for a product that the single inputs determine exactly.
    """
    square, left = product**2, freed**2
    equal = square.sum(axis=0)[:, None] * left.mean(axis=0)
    variance = factor * np.maximum(equal, square.T @ left)
    usable = (square.sum(axis=0) > 1e-12 * len(product))[:, None] & (variance > 0.0)
    return np.where(usable, product.T @ freed / np.sqrt(np.where(usable, variance, 1.0)), 0.0)


def _located(driver: Driver, first: InputColumn, second: InputColumn, failed: np.ndarray) -> Driver:
    """The pair with the cell of the two inputs where the largest share of cases fails, and how far it separates.

    It is counted in all cases: a selection has another ratio of failed cases to others.
    """
    (row, n_rows), (place, n_places) = equal_bins(first, 3), equal_bins(second, 3)
    cell = row * n_places + place
    tried = np.bincount(cell, minlength=n_rows * n_places)
    lost = np.bincount(cell[failed], minlength=n_rows * n_places)
    worst = int(np.argmax(lost / np.maximum(tried, 1)))
    inside, outside = int(lost[worst]), int(tried[worst] - lost[worst])
    return replace(
        driver,
        where=(_third(first, worst // n_places, n_rows), _third(second, worst % n_places, n_places)),
        effect=inside / int(failed.sum()) - outside / int((~failed).sum()),
        inside_failed=inside,
        inside_tried=int(tried[worst]),
    )


def _third(column: InputColumn, index: int, count: int) -> str:
    if column.levels:
        return column.levels[int(np.unique(column.values)[index])]
    return ("low", "high")[index] if count == 2 else ("low", "middle", "high")[index]
