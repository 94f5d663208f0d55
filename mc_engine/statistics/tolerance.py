"""Tolerance limits: the limits that the cases at hand do show, whatever was required, distribution-free.

An upper limit is the (A + 1)-th largest value when A is the most failures with which so many cases still show the
share (Wilks, Ann. Math. Statist. 12 (1941), 91-96).  Two limits leave A + 1 values out in all, its own two among
them; which end loses the next one may depend on those lost before (Tukey, Ann. Math. Statist. 18 (1947), 529-539;
Fraser, Ann. Math. Statist. 22 (1951), 372-381).  Cases without a number are worse than every number and are lost
first.  A limit that would need more cases than there are is None, never a guess.
"""

import numpy as np


def upper_limit(usable: np.ndarray, accepted: int | None, no_number: int) -> float | None:
    """The value that bounds the share from above.

    usable : float64[n], finite.  accepted : the acceptance number of all n + no_number cases, None if there is none.
    """
    if accepted is None:
        return None
    place = accepted - no_number  # so many larger values are left out
    return float(np.sort(usable)[usable.size - 1 - place]) if 0 <= place < usable.size else None


def lower_limit(usable: np.ndarray, accepted: int | None, no_number: int) -> float | None:
    """The value that bounds the share from below; as `upper_limit`."""
    mirrored = upper_limit(-usable, accepted, no_number)
    return None if mirrored is None else -mirrored


def interval(usable: np.ndarray, accepted: int | None, no_number: int) -> tuple[float, float] | None:
    """The two values that enclose the share; the ends lose values in turn, the upper one first."""
    if accepted is None:
        return None
    lost = accepted + 1 - no_number
    above, below = (lost + 1) // 2, lost // 2
    if below < 1 or above + below > usable.size:
        return None
    ordered = np.sort(usable)
    return float(ordered[below - 1]), float(ordered[usable.size - above])
