"""Exact limits on the share of passing cases.  (How many cases it takes to show a share: `mc_engine.plan`.)

Valid for independent cases drawn from the dispersions (design `mc`).  For `lhs`, `sobol` and `halton` the
spread of a share is smaller than binomial, so the limits are then on the safe side; for `grid` and
`one_at_a_time` a share of cases is no probability and none of this applies.

Clopper & Pearson, Biometrika 26 (1934), 404-413.
"""

from scipy.special import betaincinv


def lower_bound(passed: int, tried: int, confidence: float = 0.90) -> float:
    """One-sided lower confidence bound on the passing share; 0.0 when nothing passed or nothing was tried."""
    _check(passed, tried, confidence)
    return float(betaincinv(passed, tried - passed + 1, 1.0 - confidence)) if passed else 0.0


def upper_bound(passed: int, tried: int, confidence: float = 0.90) -> float:
    """One-sided upper confidence bound on the passing share; 1.0 when all passed or nothing was tried."""
    _check(passed, tried, confidence)
    return float(betaincinv(passed + 1, tried - passed, confidence)) if passed < tried else 1.0


def clopper_pearson(count: int, tried: int, confidence: float = 0.95) -> tuple[float, float]:
    """Two-sided interval on a share, each tail holding (1 - confidence)/2."""
    one_sided = 0.5 * (1.0 + confidence)
    return lower_bound(count, tried, one_sided), upper_bound(count, tried, one_sided)


def _check(passed: int, tried: int, confidence: float) -> None:
    if not 0 <= passed <= tried:
        raise ValueError(f"{passed} of {tried} cases cannot have passed")
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence {confidence} does not lie between 0 and 1")
