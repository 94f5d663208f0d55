"""Requirement verdicts: is the wanted share of cases inside the limit, shown with the wanted confidence?

pass              the lower confidence bound on the passing share reaches the wanted share
fail              even the upper confidence bound stays below it
not demonstrable  the number of cases decides neither way, or the design gives no probabilities

A case that failed, or whose metric is not a number, counts as not inside the limit.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mc_engine.plan import smallest_sample
from mc_engine.statistics.binomial import lower_bound, upper_bound
from mc_engine.statistics.order_statistics import quantile_ranks

PASS = "pass"
FAIL = "fail"
NOT_DEMONSTRABLE = "not demonstrable"

# Designs whose cases are a sample of the dispersions, so that a share of cases estimates a probability.
SAMPLING_DESIGNS = ("mc", "lhs", "sobol", "halton")


@dataclass(frozen=True)
class Verdict:
    """One requirement judged.  `estimate`, `lower`, `upper` are shares; None without a case.

    demonstrated : the limit that the cases at hand do show with share and confidence, None if they show none
        (or if the requirement has two limits).  margin : how far that is inside the required limit.
    needed : cases that would show the share if no further one failed; None if it is shown or refuted.
    """

    name: str
    metric: str
    at_most: float | None
    at_least: float | None
    share: float
    confidence: float
    outcome: str
    passed: int
    tried: int
    no_number: int
    estimate: float | None
    lower: float | None
    upper: float | None
    demonstrated: float | None
    needed: int | None
    random: bool

    @property
    def margin(self) -> float | None:
        """Distance from the demonstrated limit to the required one, positive inside; None if there is none."""
        if self.demonstrated is None:
            return None
        if self.at_most is not None:
            return self.at_most - self.demonstrated
        return self.demonstrated - self.at_least if self.at_least is not None else None


def pass_probability(passed: int, tried: int, confidence: float = 0.90) -> tuple[float, float]:
    """Share of passing cases with its exact lower confidence bound.

    passed, tried : int, 0 <= passed <= tried, tried > 0.  Failed cases count as tried.
    Returns (estimate, lower).  With nothing failed, lower = (1 - confidence)**(1/tried).

    Clopper & Pearson, Biometrika 26 (1934), 404-413.
    """
    if tried <= 0:
        raise ValueError("no case was tried")
    return passed / tried, lower_bound(passed, tried, confidence)


def judge(requirement: Mapping[str, Any], values: np.ndarray, ok: np.ndarray, design: str = "mc") -> Verdict:
    """Verdict on one requirement record ("name", "metric", "at_most", "at_least", "share", "confidence").

    values : float64[n_tried], the metric; ok : bool[n_tried], whether the case was flown to its end.
    """
    values = np.asarray(values, dtype=np.float64)
    at_most, at_least = _limit(requirement, "at_most"), _limit(requirement, "at_least")
    share, confidence = float(requirement["share"]), float(requirement["confidence"])
    usable = np.asarray(ok, dtype=bool) & np.isfinite(values)
    inside = usable & inside_limits(values, at_most, at_least)
    passed, tried = int(inside.sum()), int(values.size)
    random = design in SAMPLING_DESIGNS
    known = random and tried > 0
    lower = lower_bound(passed, tried, confidence) if known else None
    upper = upper_bound(passed, tried, confidence) if known else None
    outcome = _outcome(lower, upper, share)
    return Verdict(
        name=str(requirement["name"]),
        metric=str(requirement["metric"]),
        at_most=at_most,
        at_least=at_least,
        share=share,
        confidence=confidence,
        outcome=outcome,
        passed=passed,
        tried=tried,
        no_number=tried - int(usable.sum()),
        estimate=passed / tried if tried else None,
        lower=lower,
        upper=upper,
        demonstrated=_demonstrated(values[usable], tried, at_most, at_least, share, confidence) if known else None,
        needed=smallest_sample(share, confidence, tried - passed) if random and outcome == NOT_DEMONSTRABLE else None,
        random=random,
    )


def _limit(requirement: Mapping[str, Any], key: str) -> float | None:
    value = requirement.get(key)
    return None if value is None else float(value)


def inside_limits(values: np.ndarray, at_most: float | None, at_least: float | None) -> np.ndarray:
    """bool[n]: inside the limits that there are; a value that is not a number, or infinite, is not."""
    inside = np.isfinite(values)
    with np.errstate(invalid="ignore"):
        if at_most is not None:
            inside &= values <= at_most
        if at_least is not None:
            inside &= values >= at_least
    return inside


def _outcome(lower: float | None, upper: float | None, share: float) -> str:
    if lower is None or upper is None:
        return NOT_DEMONSTRABLE
    if lower >= share:
        return PASS
    return FAIL if upper < share else NOT_DEMONSTRABLE


def _demonstrated(
    usable: np.ndarray,
    tried: int,
    at_most: float | None,
    at_least: float | None,
    share: float,
    confidence: float,
) -> float | None:
    """The one-sided tolerance limit (Wilks): `share` of cases lie inside it, with `confidence`.

    Cases without a number are worse than every number, so they take the worst ranks.
    """
    if (at_most is None) == (at_least is None):
        return None
    # quantile_ranks puts (1 - c)/2 in each tail; a one-sided limit wants 1 - confidence in one.
    rank = quantile_ranks(tried, share, 2.0 * confidence - 1.0)[1]
    if rank is None or rank > usable.size:
        return None
    from_best = np.sort(usable if at_most is not None else -usable)
    return float(from_best[rank - 1]) if at_most is not None else -float(from_best[rank - 1])
