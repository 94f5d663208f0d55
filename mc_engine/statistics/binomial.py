"""Exact limits on the share of passing cases, for a number of cases that was fixed in advance.

Valid for independent cases drawn from the dispersions (design `mc`).  For `lhs`, `sobol` and `halton` the
spread of a share is smaller than binomial, so the limits are then on the safe side; for `grid` and
`one_at_a_time` a share of cases is no probability and none of this applies.  Where the number of cases was decided
by looking at them, `time_uniform` has the limits that hold.

Clopper & Pearson, Biometrika 26 (1934), 404-413.
"""

from scipy.special import bdtr, betaincinv

from mc_engine.plan import acceptance_number, smallest_sample

__all__ = [
    "acceptance_number",
    "check_counts",
    "clopper_pearson",
    "lower_bound",
    "pass_chance",
    "smallest_sample",
    "upper_bound",
]


def lower_bound(passed: int, tried: int, confidence: float = 0.90) -> float:
    """One-sided lower confidence bound on the passing share; 0.0 when nothing passed or nothing was tried."""
    check_counts(passed, tried, confidence)
    return float(betaincinv(passed, tried - passed + 1, 1.0 - confidence)) if passed else 0.0


def upper_bound(passed: int, tried: int, confidence: float = 0.90) -> float:
    """One-sided upper confidence bound on the passing share; 1.0 when all passed or nothing was tried."""
    check_counts(passed, tried, confidence)
    return float(betaincinv(passed + 1, tried - passed, confidence)) if passed < tried else 1.0


def clopper_pearson(count: int, tried: int, confidence: float = 0.95) -> tuple[float, float]:
    """Two-sided interval on a share, each tail holding (1 - confidence)/2."""
    check_counts(count, tried, confidence)
    one_sided = 0.5 * (1.0 + confidence)
    return lower_bound(count, tried, one_sided), upper_bound(count, tried, one_sided)


def pass_chance(tried: int, accepted: int | None, true_share: float) -> float:
    """Probability that at most `accepted` of `tried` cases fail when the true passing share is `true_share`.

    At the wanted share it is the consumer's risk, above it one less the producer's.  accepted None: 0.
    Hanson & Beard, NASA/TP-2010-216447, section 4.
    """
    return 0.0 if accepted is None else float(bdtr(accepted, tried, 1.0 - true_share))


def check_counts(passed: int, tried: int, confidence: float) -> None:
    """ValueError unless the counts are possible and the confidence lies between 0 and 1."""
    if not 0 <= passed <= tried:
        raise ValueError(f"{passed} of {tried} cases cannot have passed")
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence {confidence} does not lie between 0 and 1")
