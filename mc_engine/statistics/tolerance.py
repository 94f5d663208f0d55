"""Ranks of distribution-free tolerance limits: the limits that the cases at hand demonstrate, whatever was required.

An upper limit is the (A + 1)-th largest value when A is the most failures with which so many cases still demonstrate
the probability (Wilks, Ann. Math. Statist. 12 (1941), 91-96).  Cases without a number are worse than every number and
are lost first.  A limit that would need more cases than there are is None.

usable : cases with a number.  accepted : acceptance number of these and of the `no_number` others, None if there is
    none.  Ranks are those of order statistics, 1 ... usable.
"""

from typing import NamedTuple

import numpy as np

from mc_engine.statistics.worst import Limits


class Judged(NamedTuple):
    """Numbers whose tolerance limit is what a requirement demonstrates: a metric, or how far it is inside two limits.

    A case is between two limits that are both moved inward by a distance where it is inside the nearest of them by that
    distance: one number with one limit, on whichever side the cases lie.
    """

    metric: str
    at_least: float | None = None
    at_most: float | None = None

    def of(self, values: np.ndarray) -> np.ndarray:
        """These numbers, float64[n], of the metric's values."""
        limits = Limits(self.at_most, self.at_least)
        return limits.distances(values) if limits.two_sided else values


def upper_rank(usable: int, accepted: int | None, no_number: int) -> int | None:
    """The rank of the value that bounds the share from above."""
    if accepted is None:
        return None
    left_out = accepted - no_number  # so many larger values
    return usable - left_out if 0 <= left_out < usable else None


def lower_rank(usable: int, accepted: int | None, no_number: int) -> int | None:
    """The rank of the value that bounds the share from below."""
    mirrored = upper_rank(usable, accepted, no_number)
    return None if mirrored is None else usable + 1 - mirrored
