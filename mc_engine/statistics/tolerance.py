"""Ranks of distribution-free tolerance limits: the limits that the cases demonstrate, independent of the required ones.

An upper limit is the (A + 1)-th largest value, where A is the most failures with which this number of cases still
demonstrates the probability (Wilks, Ann. Math. Statist. 12 (1941), 91-96).  Cases without a number count as worse than
every number, so they use up the failures first.  A limit that needs more cases than there are is None.

usable : cases with a number.  accepted : acceptance number for these and the `no_number` others together, None if
    there is none.  Ranks are those of order statistics, 1 ... usable.
"""

from typing import NamedTuple

import numpy as np

from mc_engine.statistics.worst import Limits


class Judged(NamedTuple):
    """The numbers whose tolerance limit is sought: a metric, or for two limits its distance inside the nearer one.

    A case stays between two limits that are both moved inward by a distance if it is inside the nearer one by at least
    that distance.  So two limits need one number with one limit, on whichever side the cases lie.
    """

    metric: str
    at_least: float | None = None
    at_most: float | None = None

    def of(self, values: np.ndarray) -> np.ndarray:
        """These numbers, float64[n], of the metric's values."""
        limits = Limits(self.at_most, self.at_least)
        return limits.distances(values) if limits.two_sided else values


def upper_rank(usable: int, accepted: int | None, no_number: int) -> int | None:
    """The rank of the value that is the upper tolerance limit."""
    if accepted is None:
        return None
    left_out = accepted - no_number  # so many larger values
    return usable - left_out if 0 <= left_out < usable else None


def lower_rank(usable: int, accepted: int | None, no_number: int) -> int | None:
    """The rank of the value that is the lower tolerance limit."""
    mirrored = upper_rank(usable, accepted, no_number)
    return None if mirrored is None else usable + 1 - mirrored
