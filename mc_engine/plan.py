"""How many cases a campaign needs to demonstrate a share of success with a given confidence."""

from typing import NamedTuple


class PlanRow(NamedTuple):
    """failures allowed among `cases`; `shown` is the share that they still demonstrate."""

    failures: int
    cases: int
    shown: float


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
    too_few, enough = failures, failures + 1
    while not _demonstrates(enough, share, confidence, failures):
        too_few, enough = enough, 2 * enough
    while enough - too_few > 1:
        middle = (too_few + enough) // 2
        if _demonstrates(middle, share, confidence, failures):
            enough = middle
        else:
            too_few = middle
    return enough


def _demonstrates(cases: int, share: float, confidence: float, failures: int) -> bool:
    """True if so few failures would be too lucky, had the share of success been just below `share`."""
    from scipy.special import betainc

    # betainc(n - k, k + 1, p) is the binomial chance of at most k failures when each case succeeds with p.
    return bool(betainc(cases - failures, failures + 1, share) <= 1.0 - confidence)


def plan_table(share: float, confidence: float, rows: int = 6) -> list[PlanRow]:
    """The smallest samples for 0, 1, ..., rows - 1 failures."""
    table = []
    for failures in range(rows):
        cases = smallest_sample(share, confidence, failures)
        table.append(PlanRow(failures, cases, demonstrated_share(cases, failures, confidence)))
    return table
