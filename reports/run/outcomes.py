"""How each case came out: inside all limits, outside one of them, or failed.

Every count of cases in a report comes from `statistics.limits.inside_all`, over the table at hand by `inside`,
over all cases by `HeldCases.limit_counts`; its words come from `inside_words`: a figure or table over some of the
requirements never says "all limits".
"""

from collections.abc import Mapping, Sequence

import numpy as np

from mc_engine.statistics import Verdict
from mc_engine.statistics.limits import inside_all
from reports.run.flown import Flown
from reports.text.numbers import count

INSIDE, OUTSIDE, FAILED = 0, 1, 2
ALL_LIMITS, COMPLETED, NOT_COMPLETED = "inside all limits", "completed", "failed"


def inside(flown: Flown, verdicts: Sequence[Verdict] | None = None) -> np.ndarray:
    """bool[n_held]: completed, and inside the limits of these requirements, of all without any named."""
    own, names = flown.own, None if verdicts is None else {verdict.name for verdict in verdicts}
    asked = [vars(verdict) for verdict in own.verdicts if names is None or verdict.name in names]
    return inside_all(asked, own.values, own.ok)


def inside_words(flown: Flown, verdicts: Sequence[Verdict] | None = None) -> str:
    """What cases that are `inside` are called; without a requirement they are only completed."""
    if not flown.verdicts:
        return COMPLETED
    if verdicts is None or len(verdicts) == len(flown.verdicts):
        return ALL_LIMITS
    return f"inside the limit{'s' if len(verdicts) > 1 else ''} of {', '.join(verdict.name for verdict in verdicts)}"


def failures(flown: Flown) -> Mapping[str, np.ndarray]:
    """bool[n_held] by requirement: not inside it; and, if cases failed, not completed.

    Requirements that the same cases miss stand together: "fuel, completed".
    """
    violations = {verdict.name: ~inside(flown, [verdict]) for verdict in flown.verdicts}
    if not flown.ok.all():
        violations[COMPLETED] = ~flown.ok
    names: dict[bytes, list[str]] = {}
    for name, cases in violations.items():
        names.setdefault(cases.tobytes(), []).append(name)
    return {", ".join(same): violations[same[0]] for same in names.values()}


def case_outcomes(flown: Flown) -> np.ndarray:
    """int8[n_held]: INSIDE, OUTSIDE or FAILED; a metric that is not a number is outside its limit."""
    return np.where(flown.ok, np.where(inside(flown), INSIDE, OUTSIDE), FAILED).astype(np.int8)


def outcome_names(flown: Flown) -> tuple[str, str, str]:
    """The words for the three outcomes; without a requirement, nothing can be outside."""
    return inside_words(flown), "outside a limit", NOT_COMPLETED


def outcome_sentence(flown: Flown) -> str:
    """Such as "9 980 inside all limits, 8 outside a limit, 12 failed, of 10 000 cases"; of all cases."""
    counts = (
        flown.every.inside_all,
        flown.every.completed - flown.every.inside_all,
        flown.n_tried - flown.every.completed,
    )
    named = enumerate(zip(counts, outcome_names(flown), strict=True))
    parts = [f"{count(n)} {name}" for k, (n, name) in named if n or k == INSIDE]
    return f"{', '.join(parts)}, of {count(flown.n_tried)} cases"
