"""Sobol' indices from Saltelli's blocks and elementary effects from Morris's trajectories, analysed by SALib.

A block or trajectory in which a case has no number is left out as a whole, because its other cases are of no use alone.
Such blocks are not a random selection; if there are many, the indices describe only the cases that complete.

Herman & Usher, J. Open Source Softw. 2 (2017) 97 (SALib); Saltelli et al., Comput. Phys. Commun. 181 (2010), 259-270;
Campolongo, Cariboni & Saltelli, Environ. Model. Softw. 22 (2007), 1509-1518 (mu*).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mc_engine.sampling.designs import IN_BLOCKS as IN_BLOCKS  # for readers of runs, too
from mc_engine.sampling.designs import MORRIS_LEVELS, block_size
from mc_engine.statistics.input_columns import input_columns
from mc_engine.statistics.moments import near_one, varying_rows
from mc_engine.statistics.pick_freeze import whole_blocks
from mc_engine.statistics.picked_cases import picked_rows

FEWEST_BLOCKS = 10
RESAMPLES = 200
_SEED = 1  # of the bootstrap behind the intervals: the same cases give the same report


@dataclass(frozen=True)
class DesignedIndices:
    """Indices by name, float64[n_inputs, n_metrics], NaN where undefined; `reach` has their half intervals.

    NaN too, of Saltelli's, for a metric most of whose variance is that of fewer than 10 blocks.

    Saltelli: "first_order" and "total", fractions of the metric's variance.  Morris: "mu_star", "mu" and "sigma", mean
    size, mean and standard deviation of the metric's change in a step of half the levels, divided by the step as a
    fraction of the range between the outer levels (2/3); no "mu" and "sigma" of an input with more than two words,
    whose steps have no direction.
    n_used : int64[n_metrics], complete blocks with numbers, of n_tried.
    """

    design: str
    inputs: tuple[str, ...]
    metrics: tuple[str, ...]
    values: Mapping[str, np.ndarray]
    reach: Mapping[str, np.ndarray]
    n_used: np.ndarray
    n_tried: int


def designed_indices(
    design: str,
    case_ids: np.ndarray,
    inputs: Mapping[str, Any],
    metrics: Mapping[str, np.ndarray],
    confidence: float = 0.90,
) -> DesignedIndices:
    """Indices of a run of design "saltelli" or "morris".  case_ids : int64[n]; metrics : float64[n], NaN where none."""
    size = block_size(design, len(inputs))
    rows = whole_blocks(np.asarray(case_ids, dtype=np.int64), size)
    names = ("first_order", "total") if design == "saltelli" else ("mu_star", "mu", "sigma")
    shape = (len(inputs), len(metrics))
    values = {name: np.full(shape, np.nan) for name in names}
    reach = {name: np.full(shape, np.nan) for name in names}
    n_used = np.zeros(len(metrics), dtype=np.int64)
    columns = input_columns(inputs)
    coded = np.column_stack([column.values for column in columns])[rows]
    for k, column in enumerate(metrics.values()):
        y = np.asarray(column, dtype=np.float64)[rows]
        flown = np.isfinite(y).all(axis=1)
        n_used[k] = int(flown.sum())
        y = y[flown]
        if n_used[k] < FEWEST_BLOCKS or np.ptp(y) <= 1e-12 * np.abs(y).max():
            continue
        scaled = near_one(y.ravel())[0].reshape(y.shape)
        if design == "saltelli" and varying_rows(scaled - scaled.mean()) < FEWEST_BLOCKS:
            continue
        if design == "saltelli":
            indices = _saltelli(tuple(inputs), y, confidence)
        else:
            indices = _morris(tuple(inputs), coded[flown], y, confidence)
        for name, (value, half) in indices.items():
            values[name][:, k], reach[name][:, k] = value, half
    for name in {"mu", "sigma"}.intersection(names):
        values[name][[not column.ordered for column in columns]] = np.nan
    return DesignedIndices(design, tuple(inputs), tuple(metrics), values, reach, n_used, len(rows))


def picked_block_rows(design: str, case_ids: np.ndarray, n_inputs: int, most: int, seed: int = 0) -> np.ndarray:
    """Rows, int64, ascending, of blocks selected evenly over the case numbers, with about `most` cases in all."""
    block = case_ids // (size := block_size(design, n_inputs))
    blocks = np.unique(block)
    return np.flatnonzero(np.isin(block, blocks[picked_rows(blocks.size, max(most // size, 1), seed)]))


def _salib_problem(names: tuple[str, ...]) -> dict[str, Any]:
    return {"num_vars": len(names), "names": list(names), "bounds": [[0.0, 1.0]] * len(names)}


def _saltelli(names: tuple[str, ...], y: np.ndarray, confidence: float) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    from SALib.analyze import sobol  # imports matplotlib and pandas

    indices = sobol.analyze(
        _salib_problem(names),
        y.ravel(),
        calc_second_order=False,
        num_resamples=RESAMPLES,
        conf_level=confidence,
        seed=_SEED,
    )
    return {"first_order": (indices["S1"], indices["S1_conf"]), "total": (indices["ST"], indices["ST_conf"])}


def _morris(
    names: tuple[str, ...], coded: np.ndarray, y: np.ndarray, confidence: float
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Of the inputs SALib takes only which one moved, and whether up; a move to an equal value has no effect."""
    from SALib.analyze import morris

    effects = morris.analyze(
        _salib_problem(names),
        coded.reshape(-1, len(names)),
        y.ravel(),
        num_levels=MORRIS_LEVELS,
        num_resamples=RESAMPLES,
        conf_level=confidence,
        seed=_SEED,
    )
    unknown = np.full(len(names), np.nan)
    return {
        "mu_star": (np.asarray(effects["mu_star"]), np.asarray(effects["mu_star_conf"])),
        "mu": (np.asarray(effects["mu"]), unknown),
        "sigma": (np.asarray(effects["sigma"]), unknown),
    }
