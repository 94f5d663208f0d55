"""Ranks of distribution-free tolerance limits: the limits that the cases at hand demonstrate, whatever was required.

An upper limit is the (A + 1)-th largest value when A is the most failures with which so many cases still demonstrate
the probability (Wilks, Ann. Math. Statist. 12 (1941), 91-96).  Two limits leave A + 1 values out in all, their own two
among them; which end loses the next one may depend on those lost before (Tukey, Ann. Math. Statist. 18 (1947), 529-539;
Fraser, Ann. Math. Statist. 22 (1951), 372-381).  Cases without a number are worse than every number and are lost first.
A limit that would need more cases than there are is None.

usable : cases with a number.  accepted : acceptance number of these and of the `no_number` others, None if there is
    none.  Ranks are those of order statistics, 1 ... usable.
"""


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


def enclosing_ranks(usable: int, accepted: int | None, no_number: int) -> tuple[int, int] | None:
    """The ranks of the two values that enclose the share; the ends lose values in turn, the upper one first."""
    if accepted is None:
        return None
    lost = accepted + 1 - no_number
    above, below = (lost + 1) // 2, lost // 2
    return None if below < 1 or above + below > usable else (below, usable + 1 - above)
