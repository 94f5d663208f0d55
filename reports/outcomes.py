"""How each case came out: inside all limits, outside one of them, or failed; what figures and tables of cases share."""

import numpy as np

from mc_engine.statistics.requirements import inside_limits
from reports.flown import Flown
from reports.numbers import count

INSIDE, OUTSIDE, FAILED = 0, 1, 2


def case_outcomes(flown: Flown) -> np.ndarray:
    """int8[n_tried]: INSIDE, OUTSIDE or FAILED; a metric that is not a number is outside its limit."""
    found = np.where(flown.ok, INSIDE, FAILED).astype(np.int8)
    for verdict in flown.verdicts:
        if not verdict.metric:  # all requirements jointly
            continue
        inside = inside_limits(flown.values(verdict.metric), verdict.at_most, verdict.at_least)
        found[flown.ok & ~inside] = OUTSIDE
    return found


def outcome_names(flown: Flown) -> tuple[str, str, str]:
    """The words for the three outcomes; without a requirement, nothing can be outside."""
    return ("inside all limits" if flown.verdicts else "flown to its end", "outside a limit", "failed")


def outcome_sentence(flown: Flown) -> str:
    """Such as "9 980 inside all limits, 8 outside a limit, 12 failed, of 10 000 cases"."""
    counts = np.bincount(case_outcomes(flown), minlength=3)
    parts = [f"{count(int(n))} {name}" for n, name in zip(counts, outcome_names(flown), strict=True) if n]
    return f"{', '.join(parts)}, of {count(flown.n_tried)} cases"
