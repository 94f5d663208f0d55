"""Paired comparison of the levels of a choice: differences between cases that differ only in this choice."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from mc_engine.statistics.binomial import clopper_pearson
from mc_engine.statistics.order_statistics import Quantile, quantile


@dataclass(frozen=True)
class PairedDifference:
    """Differences between two levels over their pairs; n_used of n_tried pairs have both numbers.

    median : with its distribution-free interval (that of the sign test);  smaller : pairs with a difference below 0,
    and the Clopper-Pearson interval on their fraction.  None without a pair that has both numbers.
    """

    n_used: int
    n_tried: int
    median: Quantile | None
    smallest: float | None
    largest: float | None
    smaller: int
    smaller_share: tuple[float, float] | None


def matching_rows(choice: np.ndarray, levels: Sequence[str], others: Mapping[str, np.ndarray]) -> np.ndarray:
    """int64[n_groups, n_levels]: rows of cases that differ only in the choice, one column for each level.

    choice : the level of each case;  others : every other dispersed input.  Cases without a partner at every level,
    and those flown more than once, are in no group.
    """
    table = pd.DataFrame({f"input {k}": values for k, values in enumerate(others.values())})
    if table.shape[1] == 0:
        table["alone"] = np.zeros(len(choice), dtype=np.int64)
    groups = table.groupby(list(table.columns), sort=False, dropna=False).ngroup().to_numpy()
    place = pd.Categorical(choice, categories=list(levels)).codes.astype(np.int64)
    known = place >= 0
    n_groups = int(groups.max()) + 1 if groups.size else 0
    slot = groups[known] * len(levels) + place[known]
    flown = np.bincount(slot, minlength=n_groups * len(levels))
    rows = np.full(n_groups * len(levels), -1, dtype=np.int64)
    rows[slot] = np.flatnonzero(known)
    rows[flown != 1] = -1
    matched = rows.reshape(n_groups, len(levels))
    return matched[(matched >= 0).all(axis=1)]


def paired_difference(values: np.ndarray, reference: np.ndarray, confidence: float = 0.90) -> PairedDifference:
    """values - reference over pairs (float64[n_pairs] each, NaN for a case without a number)."""
    with np.errstate(invalid="ignore"):
        differences = np.asarray(values, dtype=np.float64) - np.asarray(reference, dtype=np.float64)
    ordered = np.sort(differences[np.isfinite(differences)])
    used, tried = int(ordered.size), int(differences.size)
    if not used:
        return PairedDifference(0, tried, None, None, None, 0, None)
    smaller = int(np.count_nonzero(ordered < 0.0))
    return PairedDifference(
        n_used=used,
        n_tried=tried,
        median=quantile(ordered, 0.5, confidence),
        smallest=float(ordered[0]),
        largest=float(ordered[-1]),
        smaller=smaller,
        smaller_share=clopper_pearson(smaller, used, confidence),
    )
