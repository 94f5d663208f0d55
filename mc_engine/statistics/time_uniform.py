"""Anytime-valid confidence bounds on the probability that a case passes: they hold at every number of cases at once.

Clopper-Pearson bounds hold for a number of cases that was fixed in advance.  If they are checked repeatedly until they
give the desired result, they are wrong more often than stated.  The bounds here may be checked after every case, and
hold at all checks together with the stated confidence.  They are wider: near 99.73 % with 90 % confidence and no
failure, 1104 cases are needed instead of 852.

A failure rate q0 is rejected once the mixed likelihood ratio

    e(q0) = integral of w(q) (q / q0)^k ((1 - q) / (1 - q0))^(n - k) dq       k failures in n cases

reaches 1 / (1 - confidence).  Under q0 it is a martingale that starts at 1, so the probability that it ever reaches
this value is at most 1 - confidence (Ville, Etude critique de la notion de collectif, 1939; Robbins, Ann. Math.
Statist. 41 (1970), 1397-1409; Howard, Ramdas, McAuliffe & Sekhon, Ann. Statist. 49 (2021), 1055-1080).  The weights
w(q) are proportional to q^(-1/2) on the side that would refute q0 (below it for the lower bound on the passing
probability, above it for the upper one), and zero on the other side.  Valid for independent cases (design `mc`).
"""

from collections.abc import Callable
from math import log

import numpy as np
import scipy  # loads its packages when they are used

from mc_engine.statistics.binomial import check_counts, fewest_cases, most_failures

_POWER = 0.5  # weights q^(_POWER - 1): much weight on rare failures, some on frequent ones
_HALVINGS = 100  # of a bracket inside (0, 1): more than doubles can tell apart


def lower_bound(passed: int, tried: int, confidence: float = 0.90) -> float:
    """One-sided lower bound on the probability that a case passes; 0.0 if no case passed or none was tried."""
    check_counts(passed, tried, confidence)
    if passed == 0:
        return 0.0
    failures, wanted = tried - passed, -log(1.0 - confidence)
    return 1.0 - _crossing(lambda q: _evidence(failures, tried, q, below=True) >= wanted, failures / tried, 1.0)


def upper_bound(passed: int, tried: int, confidence: float = 0.90) -> float:
    """One-sided upper bound on the probability that a case passes; 1.0 if all cases passed or none was tried."""
    check_counts(passed, tried, confidence)
    if passed == tried:
        return 1.0
    failures, wanted = tried - passed, -log(1.0 - confidence)
    return 1.0 - _crossing(lambda q: _evidence(failures, tried, q, below=False) >= wanted, failures / tried, 0.0)


def acceptance_number(tried: int, share: float, confidence: float) -> int | None:
    """The most failures among `tried` cases that still demonstrate `share`; None if zero failures do not."""
    return most_failures(lambda failures: lower_bound(tried - failures, tried, confidence) >= share, tried)


def smallest_sample(share: float, confidence: float, failures: int = 0) -> int:
    """Smallest number of cases in which `failures` failures demonstrate `share`, valid at any time of checking."""
    return fewest_cases(lambda cases: lower_bound(cases - failures, cases, confidence) >= share, failures)


def _crossing(refuted: Callable[[float], bool], kept: float, end: float) -> float:
    """The failure rate between `kept` (not refuted) and `end` beyond which all are refuted; bisection.

    Returns the last refuted rate, so the bound is never on the unsafe side.
    """
    for _ in range(_HALVINGS):
        middle = 0.5 * (kept + end)
        if middle in (kept, end):
            break
        kept, end = (kept, middle) if refuted(middle) else (middle, end)
    return end


def _evidence(failures: int, tried: int, rate: float, below: bool) -> float:
    """log e(rate), the weights on failure rates below `rate`, or above it."""
    a, b = failures + _POWER, tried - failures + 1.0
    mass = log(_POWER) - (_POWER * log(rate) if below else np.log1p(-(rate**_POWER)))
    share = scipy.special.betainc(a, b, rate) if below else scipy.special.betaincc(a, b, rate)
    log_likelihood = failures * log(rate) + (tried - failures) * np.log1p(-rate)
    return float(mass + scipy.special.betaln(a, b) + np.log(share) - log_likelihood)
