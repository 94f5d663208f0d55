"""Which cases are inside the limits of requirements, and how many."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np


class LimitCounts:
    """Numbers of cases outside the limits of requirements, on which verdicts are based, summed over parts of a table.

    A case that was not completed, or whose metric is NaN, is outside.
    """

    def __init__(self, requirements: Sequence[Mapping[str, Any]]):
        self.requirements = requirements
        self.tried = 0
        self._outside, self._lost = np.zeros((2, len(requirements) + 1), dtype=np.int64)  # last: of any requirement

    def add(self, column: Callable[[str], np.ndarray], ok: np.ndarray) -> None:
        """Count cases.  column : metric to float64[n].  ok : bool[n]."""
        self.tried += ok.size
        kept = [inside_all([requirement], column, ok) for requirement in self.requirements]
        numbers = [
            ok & np.isfinite(np.asarray(column(str(requirement["metric"])), np.float64))
            for requirement in self.requirements
        ]
        for counts, good in ((self._outside, kept), (self._lost, numbers)):
            beyond = ~np.array(good, dtype=bool).reshape(len(good), ok.size)
            counts += [*beyond.sum(axis=1), beyond.any(axis=0).sum()]

    def outside(self, requirement: int = -1) -> int:
        """Cases outside one requirement, named by its index, or outside any of them."""
        return int(self._outside[requirement])

    def without_number(self, requirement: int = -1) -> int:
        """Cases without a number for one requirement, or for any of them."""
        return int(self._lost[requirement])


def limits_of(requirement: Mapping[str, Any]) -> tuple[float | None, float | None]:
    """(lower, upper) limit of a requirement record, each or None."""
    at_least, at_most = requirement.get("at_least"), requirement.get("at_most")
    return None if at_least is None else float(at_least), None if at_most is None else float(at_most)


def inside_all(
    requirements: Iterable[Mapping[str, Any]], column: Callable[[str], np.ndarray], ok: np.ndarray
) -> np.ndarray:
    """bool[n]: completed, and inside the limits of all these requirement records.

    column : metric to float64[n].  ok : bool[n].  Without a requirement every completed case is inside.
    """
    inside = np.array(ok, dtype=bool)
    for requirement in requirements:
        values = np.asarray(column(str(requirement["metric"])), dtype=np.float64)
        inside &= inside_limits(values, *limits_of(requirement))
    return inside


def inside_limits(values: np.ndarray, at_least: float | None, at_most: float | None) -> np.ndarray:
    """bool[n]: inside the limits that are set; False for NaN and infinite values."""
    inside = np.isfinite(values)
    with np.errstate(invalid="ignore"):
        if at_most is not None:
            inside &= values <= at_most
        if at_least is not None:
            inside &= values >= at_least
    return inside
