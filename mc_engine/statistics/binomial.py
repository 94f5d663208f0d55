"""Exact confidence bounds on the probability that a case passes, for a number of cases that was fixed in advance.

Valid for independent cases drawn from the dispersions (design `mc`).  For `lhs` and `sobol` the scatter of the passing
fraction is smaller than binomial, so the bounds are conservative; for `grid` and `one_at_a_time` a fraction of cases is
no probability and none of this applies.  Where the number of cases was decided by looking at them, use `time_uniform`.

k of N: a probability is demonstrated by N cases with at most k failures.  The same numbers apply to distribution-free
tolerance limits (Wilks, Ann. Math. Statist. 12 (1941), 91-96): the (k + 1)-th largest of N values is an upper tolerance
limit.  The interval from the r-th smallest to the r-th largest value needs as many cases as a demonstration with
2 r - 1 failures.

Clopper & Pearson, Biometrika 26 (1934), 404-413.
"""

from bisect import bisect_left
from collections.abc import Callable

import numpy as np
import scipy  # loads its packages when they are used


def lower_bound(passed: int, tried: int, confidence: float = 0.90) -> float:
    """One-sided lower confidence bound on the probability that a case passes (Clopper-Pearson).

    passed : int, number of cases that passed
    tried : int, number of independent cases, fixed in advance
    confidence : float in (0, 1)

    Returns a float in [0, 1]; 0.0 if no case passed or none was tried.

    Raises ValueError for impossible counts, or a confidence outside (0, 1).

    >>> round(lower_bound(2302, 2302), 4)
    0.999
    """
    check_counts(passed, tried, confidence)
    return float(scipy.special.betaincinv(passed, tried - passed + 1, 1.0 - confidence)) if passed else 0.0


def upper_bound(passed: int, tried: int, confidence: float = 0.90) -> float:
    """One-sided upper confidence bound on the probability that a case passes (Clopper-Pearson).

    passed : int, number of cases that passed
    tried : int, number of independent cases, fixed in advance
    confidence : float in (0, 1)

    Returns a float in [0, 1]; 1.0 if all cases passed or none was tried.

    Raises ValueError for impossible counts, or a confidence outside (0, 1).

    >>> round(upper_bound(90, 100), 3)
    0.937
    """
    check_counts(passed, tried, confidence)
    return float(scipy.special.betaincinv(passed + 1, tried - passed, confidence)) if passed < tried else 1.0


def clopper_pearson(count: int, tried: int, confidence: float = 0.95) -> tuple[float, float]:
    """Two-sided confidence interval on a probability; each tail holds (1 - confidence)/2.

    count : int, number of cases counted
    tried : int, number of independent cases, fixed in advance
    confidence : float in (0, 1)

    Returns (lower, upper).

    Raises ValueError for impossible counts, or a confidence outside (0, 1).

    Clopper & Pearson, Biometrika 26 (1934), 404-413.

    >>> [round(limit, 3) for limit in clopper_pearson(90, 100)]
    [0.824, 0.951]
    """
    check_counts(count, tried, confidence)
    one_sided = 0.5 * (1.0 + confidence)
    return lower_bound(count, tried, one_sided), upper_bound(count, tried, one_sided)


def pass_probability(passed: int, tried: int, confidence: float = 0.90) -> tuple[float, float]:
    """Fraction of passing cases with its exact lower confidence bound.

    passed : int, 0 <= passed <= tried
    tried : int, above 0; failed cases count as tried
    confidence : float in (0, 1)

    Returns (estimate, lower).  Without a failure, lower = (1 - confidence)**(1/tried).

    Raises ValueError for impossible counts, or a confidence outside (0, 1).

    Clopper & Pearson, Biometrika 26 (1934), 404-413.

    >>> estimate, lower = pass_probability(2302, 2302)
    >>> estimate, lower >= 0.999
    (1.0, True)
    """
    if tried <= 0:
        raise ValueError("no case was tried")
    return passed / tried, lower_bound(passed, tried, confidence)


def pass_chance(tried: int, accepted: int | None, true_share: float) -> float:
    """Probability that at most `accepted` of `tried` cases fail when the true success probability is `true_share`.

    At the required probability this is the consumer's risk; above it, 1 minus the producer's risk.  0 if accepted is
    None.  Hanson & Beard, NASA/TP-2010-216447, section 4.
    """
    if accepted is None:
        return 0.0
    # not bdtr, which is NaN beyond 2**31 cases
    return float(scipy.special.betainc(tried - accepted, accepted + 1, true_share)) if accepted < tried else 1.0


def smallest_sample(share: float, confidence: float, failures: int = 0) -> int:
    """Smallest number of cases that demonstrates the success probability `share` with `confidence`, given `failures`.

    share, confidence : in (0, 1), else ValueError.  failures : number of failures, not negative.
    """
    for name, value in (("share", share), ("confidence", confidence)):
        if not 0.0 < value < 1.0:
            raise ValueError(f"{name} is {value}; it must lie between 0 and 1")
    if failures < 0:
        raise ValueError(f"failures is {failures}; it must not be negative")
    return fewest_cases(lambda cases: _demonstrates(cases, share, confidence, failures), failures)


def smallest_interval_sample(share: float, confidence: float, left_out: int = 1) -> int:
    """Smallest number of cases whose `left_out`-th smallest and largest values enclose `share` of all cases.

    left_out : rank of the two limits, counted from either end; 1 for the smallest and the largest value.
    Wilks, Ann. Math. Statist. 12 (1941), 91-96: 93 for 95 % with 95 % confidence.
    """
    if left_out < 1:
        raise ValueError(f"left_out is {left_out}; the first rank is 1")
    return smallest_sample(share, confidence, 2 * left_out - 1)


def acceptance_number(tried: int, share: float, confidence: float) -> int | None:
    """The most failures among `tried` cases that still demonstrate `share`; None if zero failures do not."""
    return most_failures(lambda failures: _demonstrates(tried, share, confidence, failures), tried)


def fewest_cases(demonstrates: Callable[[int], bool], failures: int) -> int:
    """The smallest number of cases above `failures` at which, and above which, `demonstrates(cases)` is true."""
    enough = failures + 1
    while not demonstrates(enough):
        enough *= 2
    return bisect_left(range(enough), True, lo=failures + 1, key=demonstrates)


def most_failures(demonstrates: Callable[[int], bool], tried: int) -> int | None:
    """The largest number below `tried` at which, and below which, `demonstrates(failures)` is true; None if none."""
    too_many = bisect_left(range(tried), True, key=lambda failures: not demonstrates(failures))
    return too_many - 1 if too_many else None


def _demonstrates(cases: int, share: float, confidence: float, failures: int) -> bool:
    """True if the lower bound of so few failures reaches `share`: the rule by which a verdict is "pass"."""
    return lower_bound(cases - failures, cases, confidence) >= share


def half_rate_share(share: float) -> float:
    """The success probability of a system that fails half as often as `share` allows."""
    return 0.5 * (1.0 + share)


def hypergeometric_tails(total: int, marked: int, drawn: int, count: int) -> tuple[float, float]:
    """Probabilities of at most, and of at least, `count` marked items among `drawn` of `total` with `marked` marked."""
    k = np.arange(max(0, drawn - (total - marked)), min(marked, drawn) + 1)
    chance = -scipy.special.gammaln(k + 1.0) - scipy.special.gammaln(marked - k + 1.0)
    chance -= scipy.special.gammaln(drawn - k + 1.0) + scipy.special.gammaln(total - marked - drawn + k + 1.0)
    chance = np.exp(chance - chance.max())
    return float(chance[k <= count].sum() / chance.sum()), float(chance[k >= count].sum() / chance.sum())


def check_counts(passed: int, tried: int, confidence: float) -> None:
    """ValueError unless the counts are possible and the confidence lies between 0 and 1."""
    if not 0 <= passed <= tried:
        raise ValueError(f"{passed} of {tried} cases cannot have passed")
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence {confidence} does not lie between 0 and 1")
