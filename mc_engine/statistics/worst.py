"""The worst cases of a metric: those with the smallest margin to the nearest limit that a requirement sets.

Without a requirement, the largest values are the worst, or the smallest if the campaign file says so.  Failed cases
have no number and are listed separately.
"""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np


class Limits(NamedTuple):
    """The tightest limits that requirements set on one metric; None where they set none."""

    at_most: float | None = None
    at_least: float | None = None

    @property
    def two_sided(self) -> bool:
        """Whether both limits are set."""
        return self.at_most is not None and self.at_least is not None

    @property
    def ends(self) -> list[float]:
        """The limits that are set, the lower one first."""
        return [end for end in (self.at_least, self.at_most) if end is not None]

    @property
    def reach(self) -> float:
        """The unit of margins: half the distance between two limits, the size of a single one, 1 for a limit of 0."""
        ends = self.ends or [1.0]
        return abs(0.5 * (ends[0] - ends[1]) if self.two_sided else ends[0]) or 1.0

    def distances(self, values: np.ndarray) -> np.ndarray:
        """float64[n]: how far the values are inside the nearest limit, negative outside; infinite without a limit."""
        with np.errstate(over="ignore"):
            above = np.inf if self.at_most is None else self.at_most - values
            below = np.inf if self.at_least is None else values - self.at_least
        return np.minimum(above, below) + 0.0 * values

    def margins(self, values: np.ndarray) -> np.ndarray:
        """float64[n]: the distances divided by the reach."""
        return self.distances(values) / self.reach

    def largest_is_worst(self, values: np.ndarray) -> bool:
        """Whether large values are the worst; with two limits, whether the value nearest to a limit is at the upper."""
        if self.at_most is None or self.at_least is None:
            return self.at_least is None
        finite = values[np.isfinite(values)]
        return not finite.size or self.at_most - finite.max() <= finite.min() - self.at_least


def limits_on(metric: str, requirements: Iterable[Mapping[str, Any]]) -> Limits:
    """The tightest limits that these records ("metric", "at_most", "at_least") set on a metric."""
    records = [requirement for requirement in requirements if requirement["metric"] == metric]
    upper = [float(record["at_most"]) for record in records if record.get("at_most") is not None]
    lower = [float(record["at_least"]) for record in records if record.get("at_least") is not None]
    return Limits(min(upper, default=None), max(lower, default=None))


def _goodness(values: np.ndarray, largest: bool, limits: Limits | None) -> np.ndarray:
    """float64[n], smallest for the worst: the margin to the nearest limit, or without one the size or its negative."""
    if limits is not None and limits != Limits():
        return limits.margins(values)
    return -values if largest else values


def worst_cases(
    values: np.ndarray, ok: np.ndarray, count: int, largest: bool = True, limits: Limits | None = None
) -> np.ndarray:
    """The worst cases of a metric, worst first.

    values : float64[n], the metric
    ok : bool[n], whether the case was completed
    count : int, how many cases
    largest : bool, without limits, whether the largest values are the worst
    limits : Limits or None; with limits, the worst cases have the smallest margin to the nearest of them

    Returns row numbers, int64, `count` at most; ties in row order.  Cases without a finite value are left out.

    Raises nothing.

    >>> worst_cases(np.array([3.0, 9.0, np.nan, 5.0]), np.ones(4, dtype=bool), 2).tolist()
    [1, 3]
    """
    values = np.asarray(values, dtype=np.float64)
    rows = np.flatnonzero(np.asarray(ok, dtype=bool) & np.isfinite(values))
    goodness = _goodness(values[rows], largest, limits)
    if 0 < count < rows.size:  # sort none but those that can be among them: a table may have a million rows
        among = np.flatnonzero(goodness <= np.partition(goodness, count - 1)[count - 1])
        rows, goodness = rows[among], goodness[among]
    return rows[np.argsort(goodness, kind="stable")[:count]]


class WorstSoFar:
    """The `worst_cases` of cases that are read part by part in the order of their numbers.

    case_ids : int64, the worst cases so far.
    """

    def __init__(self, count: int, limits: Limits | None, largest: bool = True):
        self.count, self.limits, self.largest = count, limits, largest
        self.case_ids, self._goodness = np.zeros(0, dtype=np.int64), np.zeros(0)

    def add(self, values: np.ndarray, first: int) -> None:
        """Add cases.  values : float64[n] of the cases from `first` on, NaN for one that was not completed."""
        candidates = np.isfinite(values)
        finite = values if candidates.all() else np.where(candidates, values, np.nan)
        goodness = _goodness(finite, self.largest, self.limits)
        if self.case_ids.size == self.count:
            candidates &= goodness < self._goodness[-1]
        rows = np.flatnonzero(candidates)
        if rows.size:
            rows = rows[worst_cases(-goodness[rows], np.ones(rows.size, dtype=bool), self.count)]
            together = np.concatenate([self._goodness, goodness[rows]])
            best = np.argsort(together, kind="stable")[: self.count]
            self.case_ids = np.concatenate([self.case_ids, first + rows])[best]
            self._goodness = together[best]
