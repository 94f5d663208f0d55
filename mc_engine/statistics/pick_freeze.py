"""First-order and total Sobol' indices of groups of inputs, from the pick-freeze cases of [sensitivity].

The cases of a block are made from a point A, with its random draws, and an independent point B.  A_B(g) is A with group
g taken from B.  A_B(g) and B have only group g in common, so their correlation is the first-order index of g.  A_B(g)
and A differ only in group g, so 1 minus their correlation is its total index.  Random draws made in flight are one
group.  Inputs that are correlated with one another must be in one group.

A with a group at its nominal values shows by how much the variance falls without the dispersion of that group.  The
mean of this fall over all values at which the group may be held is its first-order index.  With interactions, the fall
at one value may be far from this mean, and from the total index.

A and B are independent, but over a finite number of blocks their correlation is not zero, and this chance correlation
is also in the indices.  It serves as a control variate: a multiple of the correlation of the independent rows, whose
true value is zero, is subtracted from each correlation.  The multiple comes from the regression of one influence
function on the other, so the variance falls by the square of the correlation between the two.

Janon, Klein, Lagnoux, Nodet & Prieur, ESAIM: Probab. Stat. 18 (2014), 342-364, eq. (6) (first order, pooled mean and
variance) and section 2.3 (its asymptotic variance, by the delta method); Jansen, Comput. Phys. Commun. 117 (1999),
35-43 (total: half the mean square of the difference, over the variance); Glen & Isaacs, Environ. Model. Softw. 37
(2012), 157-166 (chance correlations of the rows); Lavenberg & Welch, Management Science 27 (1981), 322-335 (control
variates with fitted coefficients).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mc_engine.sampling.block_layout import BlockLayout
from mc_engine.statistics.moments import varying_rows

FEWEST_BLOCKS = 20  # that make up most of the variance of a metric
_ROUNDING = 1e-20  # variance of scaled values that are all the same


def layout_of(record: Mapping[str, Any]) -> BlockLayout:
    """The block layout that a companion's manifest records under "sensitivity"."""
    groups = tuple(group["name"] for group in record["groups"])
    return BlockLayout(groups, tuple(record["repeated"]), tuple(record.get("held", ())))


@dataclass(frozen=True)
class PickFreeze:
    """Indices float64[n_groups, n_metrics] with their standard errors; NaN for a metric that does not vary, or most of
    whose variance is that of fewer than 20 blocks.

    fall : the fraction by which the variance falls with the group at its nominal values; NaN unless that was flown.
    n_used : int64[n_metrics], blocks in which every case has a number, of n_tried.
    """

    groups: tuple[str, ...]
    metrics: tuple[str, ...]
    first: np.ndarray
    first_error: np.ndarray
    total: np.ndarray
    total_error: np.ndarray
    fall: np.ndarray
    fall_error: np.ndarray
    n_used: np.ndarray
    n_tried: int


def pick_freeze(layout: BlockLayout, case_ids: np.ndarray, metrics: Mapping[str, np.ndarray]) -> PickFreeze:
    """Indices of every group and metric.

    case_ids : int64[n]; case `block * layout.size + row` is that row of that block.
    metrics : float64[n], NaN where a case has no number: its block is then left out as a whole.
    """
    rows = whole_blocks(np.asarray(case_ids, dtype=np.int64), layout.size)
    shape = (len(layout.groups), len(metrics))
    first, first_error, total, total_error, fall, fall_error = (np.full(shape, np.nan) for _ in range(6))
    n_used = np.zeros(len(metrics), dtype=np.int64)
    for k, values in enumerate(metrics.values()):
        y = np.asarray(values, dtype=np.float64)[rows]
        y = y[np.isfinite(y).all(axis=1)]
        n_used[k] = len(y)
        scaled = _scaled(y, y[:, : layout.n_drawn])
        if scaled is None or varying_rows(scaled[:, : layout.n_drawn]) < FEWEST_BLOCKS:
            continue
        for g, group in enumerate(layout.groups):
            by_chance = _correlation(scaled, layout.independent(group))
            first[g, k], first_error[g, k] = _less(by_chance, _correlation(scaled, layout.in_common(group)))
            left, total_error[g, k] = _less(by_chance, _correlation(scaled, layout.differing(group)))
            total[g, k] = 1.0 - left
            if group in layout.held:
                fall[g, k], fall_error[g, k] = _fall(*scaled[:, layout.without(group)].T)
    shares = first, first_error, total, total_error, fall, fall_error
    return PickFreeze(layout.groups, tuple(metrics), *shares, n_used, len(rows))


def whole_blocks(case_ids: np.ndarray, size: int) -> np.ndarray:
    """int64[n_blocks, size]: places of the cases of each block that is there as a whole."""
    order = np.argsort(case_ids, kind="stable")
    block = case_ids[order] // size
    whole = np.bincount(block)[block] == size if block.size else np.zeros(0, dtype=bool)
    return order[whole].reshape(-1, size)


def _scaled(y: np.ndarray, drawn: np.ndarray) -> np.ndarray | None:
    """The values centred and scaled, so that squares neither overflow nor lose digits; None without a spread.

    drawn : the rows in which no group is held at its nominal values; the scale is their spread.
    """
    largest = float(np.abs(y).max(initial=0.0))
    if largest == 0.0:
        return None
    mean, spread = float((drawn / largest).mean()), float((drawn / largest).std())
    return None if spread < 1e-13 else (y / largest - mean) / spread


def _correlation(y: np.ndarray, pairs: Sequence[tuple[int, int]]) -> tuple[float, np.ndarray]:
    """Correlation of pairs of rows with pooled mean and variance, and its influence function float64[n_blocks].

    The mean square of the influence function, over n_blocks, is the variance of the correlation.
    """
    a, b = y[:, [pair[0] for pair in pairs]], y[:, [pair[1] for pair in pairs]]
    product, square, middle = (a * b).mean(axis=1), (0.5 * (a * a + b * b)).mean(axis=1), (0.5 * (a + b)).mean(axis=1)
    mean = middle.mean()
    variance = square.mean() - mean * mean
    if variance <= 0.0:
        return np.nan, np.full(len(y), np.nan)
    value = (product.mean() - mean * mean) / variance
    influence = (product - 2.0 * mean * middle - value * (square - 2.0 * mean * middle)) / variance
    return float(value), influence - influence.mean()


def _less(by_chance: tuple[float, np.ndarray], found: tuple[float, np.ndarray]) -> tuple[float, float]:
    """A correlation, corrected by another one whose true value is zero (control variate), and its standard error."""
    (chance, control), (value, influence) = by_chance, found
    if control @ control > 0.0:
        multiple = (influence @ control) / (control @ control)
        value, influence = value - multiple * chance, influence - multiple * control
    freedom = len(influence) - 2  # the mean and the multiple are fitted
    return float(value), float(np.sqrt(influence @ influence / (freedom * len(influence))))


def _fall(drawn: np.ndarray, held: np.ndarray) -> tuple[float, float]:
    """1 - var(held) / var(drawn) of values paired by block, float64[n_blocks] each, and its standard error."""
    squares, left = (drawn - drawn.mean()) ** 2, (held - held.mean()) ** 2
    if squares.mean() < _ROUNDING:
        return np.nan, np.nan
    ratio = left.mean() / squares.mean()
    influence = (left - ratio * squares) / squares.mean()
    return float(1.0 - ratio), float(influence.std() / np.sqrt(drawn.size))
