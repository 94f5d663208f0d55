"""How many cases a campaign needs to demonstrate a share of success with a given confidence.

k of N: with at most k failures among N cases the share is shown (Clopper & Pearson, Biometrika 26 (1934), 404-413).
The same numbers are those of distribution-free tolerance limits (Wilks, Ann. Math. Statist. 12 (1941), 91-96):
the (k + 1)-th largest of N values is an upper limit to the share, and the interval between two order statistics
that leaves r values out at each end, those two among them, takes as many cases as 2 r - 1 failures.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

ROWS = 6  # failures 0 to 5


class PlanRow(NamedTuple):
    """failures allowed among `cases`; `shown` is the share that they still demonstrate.

    half_rate : probability that so many cases pass a system that fails half as often as it may.
    """

    failures: int
    cases: int
    shown: float
    half_rate: float


def demonstrated_share(cases: int, failures: int, confidence: float) -> float:
    """Lower confidence bound of the share of success after `failures` in `cases`; 0 if all failed.

    Clopper & Pearson, Biometrika 26 (1934), 404-413.
    """
    from scipy.special import betaincinv

    if failures >= cases:
        return 0.0
    return float(betaincinv(cases - failures, failures + 1, 1.0 - confidence))


def smallest_sample(share: float, confidence: float, failures: int = 0) -> int:
    """Smallest number of cases in which `failures` failures still demonstrate `share` with `confidence`.

    share, confidence : in (0, 1), else ValueError.  failures : not negative.
    """
    for name, value in (("share", share), ("confidence", confidence)):
        if not 0.0 < value < 1.0:
            raise ValueError(f"{name} is {value}; it must lie between 0 and 1")
    if failures < 0:
        raise ValueError(f"failures is {failures}; it must not be negative")
    return fewest_cases(lambda cases: _demonstrates(cases, share, confidence, failures), failures)


def smallest_interval_sample(share: float, confidence: float, left_out: int = 1) -> int:
    """Smallest number of cases whose `left_out`-th smallest and largest values enclose `share` of all cases.

    left_out : from 1, the rank of the two limits, counted from either end.  With 1, smallest and largest value.
    Wilks, Ann. Math. Statist. 12 (1941), 91-96: 93 for 95 % with 95 % confidence.
    """
    if left_out < 1:
        raise ValueError(f"left_out is {left_out}; the first rank is 1")
    return smallest_sample(share, confidence, 2 * left_out - 1)


def acceptance_number(tried: int, share: float, confidence: float) -> int | None:
    """The most failures among `tried` cases that still show `share`; None if even none at all would not do."""
    return most_failures(lambda failures: _demonstrates(tried, share, confidence, failures), tried)


def fewest_cases(demonstrates: Callable[[int], bool], failures: int) -> int:
    """The smallest number of cases above `failures` that demonstrates, and all larger ones with it; bisection."""
    too_few, enough = failures, failures + 1
    while not demonstrates(enough):
        too_few, enough = enough, 2 * enough
    while enough - too_few > 1:
        middle = (too_few + enough) // 2
        too_few, enough = (too_few, middle) if demonstrates(middle) else (middle, enough)
    return enough


def most_failures(demonstrates: Callable[[int], bool], tried: int) -> int | None:
    """The largest number of failures below `tried` that demonstrates, and all smaller ones with it; None if none."""
    most, too_many = -1, tried
    while too_many - most > 1:
        middle = (most + too_many) // 2
        most, too_many = (middle, too_many) if demonstrates(middle) else (most, middle)
    return None if most < 0 else most


def _demonstrates(cases: int, share: float, confidence: float, failures: int) -> bool:
    """True if so few failures would be too lucky, had the share of success been just below `share`."""
    from scipy.special import betainc

    # betainc(n - k, k + 1, p) is the binomial chance of at most k failures when each case succeeds with p.
    return bool(betainc(cases - failures, failures + 1, share) <= 1.0 - confidence)


def half_rate_share(share: float) -> float:
    """The share of success of a system that fails half as often as `share` allows."""
    return 0.5 * (1.0 + share)


def plan_row(share: float, confidence: float, failures: int) -> PlanRow:
    """The smallest sample for so many failures, and what it comes to."""
    from scipy.special import bdtr

    cases = smallest_sample(share, confidence, failures)
    passes = float(bdtr(failures, cases, 1.0 - half_rate_share(share)))
    return PlanRow(failures, cases, demonstrated_share(cases, failures, confidence), passes)


def plan_table(share: float, confidence: float, rows: int = ROWS) -> list[PlanRow]:
    """The smallest samples for 0, 1, ..., rows - 1 failures."""
    return [plan_row(share, confidence, failures) for failures in range(rows)]


def table_lines(rows: Sequence[PlanRow], share: float, confidence: float) -> Iterator[str]:
    """A line per row, under a heading; with the cases that `run --until verdict` takes for as many failures."""
    from mc_engine.statistics.time_uniform import smallest_sample as smallest_at_any_time

    heading = f"{'failures':>8}  {'cases':>9}  {'until verdict':>13}  {'demonstrated share':>18}"
    yield f"{heading}  passes at half the failures"
    for row in rows:
        anytime = smallest_at_any_time(share, confidence, row.failures)
        yield f"{row.failures:>8}  {row.cases:>9}  {anytime:>13}  {row.shown:>18.6f}  {100.0 * row.half_rate:.1f} %"


def interval_lines(share: float, confidence: float, rows: int = 3) -> Iterator[str]:
    """Cases for an interval between order statistics that holds the share (two-sided, Wilks)."""
    yield f"{'between the':>28}  {'cases':>9}"
    for rank in range(1, rows + 1):
        words = "smallest and the largest" if rank == 1 else f"{_ordinal(rank)} smallest and largest"
        yield f"{words:>28}  {smallest_interval_sample(share, confidence, rank):>9}"


def _ordinal(rank: int) -> str:
    return f"{rank}{({2: 'nd', 3: 'rd'}).get(rank, 'th')}"
