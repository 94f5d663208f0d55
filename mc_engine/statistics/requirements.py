"""Verdicts on requirements: is the required probability of being inside the limit demonstrated?

pass              the lower confidence bound on the probability is at least the required probability
fail              the upper confidence bound is below it
not demonstrable  neither is true, because of too few cases, or the design gives no probabilities

A case that failed, or whose metric is not a number, counts as not inside the limit.

If the number of cases was decided while looking at the results (`looked`), the bounds are those of `time_uniform`,
which hold at every number of cases; else those of `binomial`, which hold for a number fixed in advance.

Several requirements.  Each verdict has the confidence that its requirement asks for.  The joint verdict counts the
cases inside all limits at once.  Its required probability is 1 minus the sum of the failure probabilities that the
requirements allow, which follows if every requirement is met (Boole).  It passes if this probability is demonstrated
and every requirement passes; it then has the smallest of their confidences (Berger, Technometrics 24 (1982), 295-300).
It fails if one of these tests fails with the allowed error, 1 - confidence, divided by their number (Bonferroni).
`shared_outcome` is each verdict at that confidence; these verdicts hold together.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Protocol

import numpy as np

from mc_engine.sampling.designs import EXTENSIBLE as EXTENSIBLE  # reports take it from here
from mc_engine.statistics import binomial, time_uniform, tolerance
from mc_engine.statistics.limits import LimitCounts, limits_of
from mc_engine.statistics.tolerance import Judged
from mc_engine.statistics.worst import Limits

PASS = "pass"
FAIL = "fail"
NOT_DEMONSTRABLE = "not demonstrable"
JOINT = "all at once"

# Designs whose cases are a sample of the dispersions, so that a share of cases estimates a probability.
SAMPLING_DESIGNS = ("mc", "lhs", "sobol", "halton")  # the last one of runs of older versions
# Designs whose every case is chosen: percentiles of them would be of that choice.
CHOSEN_DESIGNS = ("grid", "one_at_a_time")


def judged_by(requirement: Mapping[str, Any]) -> Judged:
    """What a requirement record is judged by; the limits are named if there are two."""
    limits = limits_of(requirement)
    return Judged(str(requirement["metric"]), *(limits if None not in limits else ()))


class ShareLimits(Protocol):
    """What `binomial` and `time_uniform` both offer."""

    def lower_bound(self, passed: int, tried: int, confidence: float = ...) -> float: ...
    def upper_bound(self, passed: int, tried: int, confidence: float = ...) -> float: ...
    def acceptance_number(self, tried: int, share: float, confidence: float) -> int | None: ...
    def smallest_sample(self, share: float, confidence: float, failures: int = ...) -> int: ...


@dataclass(frozen=True)
class Verdict:
    """The verdict on one requirement from the cases of a run, or, without metric and limits, on all of them at once.

    name : str, of the requirement
    metric : str, column that is limited
    at_most : float or None, upper limit
    at_least : float or None, lower limit
    share : float, required probability of being inside the limits
    confidence : float, required of the demonstration
    outcome : str, "pass", "fail" or "not demonstrable"
    passed : int, cases inside the limits
    tried : int, all cases
    no_number : int, cases that failed or have no finite metric; they count as not inside
    estimate : float or None, passed / tried
    lower : float or None, one-sided lower confidence bound on the probability
    upper : float or None, one-sided upper confidence bound
    demonstrated : float or None, the limit that the cases demonstrate with share and confidence (tolerance limit);
        None with two limits
    enclosed : tuple or None, for a requirement with two limits the two that the cases demonstrate: the required ones
        moved inward by the same distance, the margin, or outward if it is negative
    needed : int or None, total number of cases with which an extended run demonstrates the share if no further case
        fails, or, if the design cannot be extended, a new run with as many failures; None if the verdict is decided
    accepted : int or None, most failures with which this number of cases passes; None if it cannot pass
    consumer_risk : float or None, probability of passing a system that just misses the share; None if the number of
        cases was decided along the way: then it is at most 1 - confidence
    producer_risk : float or None, probability of not passing a system that fails half as often as allowed
    shared_outcome : str, the outcome at the confidence at which all verdicts of a campaign hold together
    failing : tuple of str, for a joint verdict the requirements that make it fail although its own fraction does not
    random : bool, the cases are a random sample, so that a fraction of them estimates a probability
    looked : bool, the number of cases was decided by looking at the results

    >>> requirement = {"name": "fuel", "metric": "fuel_kg", "at_most": 2.5, "share": 0.9, "confidence": 0.9}
    >>> verdict = judge(requirement, np.linspace(1.0, 2.0, 40), np.ones(40, dtype=bool))
    >>> verdict.outcome, verdict.demonstrated, verdict.margin
    ('pass', 1.9743589743589745, 0.5256410256410255)
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
    enclosed: tuple[float, float] | None
    needed: int | None
    accepted: int | None
    consumer_risk: float | None
    producer_risk: float | None
    shared_outcome: str
    random: bool
    looked: bool
    failing: tuple[str, ...] = ()

    @property
    def remark(self) -> str:
        """Why a joint verdict differs from the one of its own count; else empty."""
        if self.failing:
            *others, last = self.failing
            who = f"{', '.join(others)} and {last} fail" if others else f"{last} fails"
            return f"{who} with confidence shared"
        alone = not self.metric and self.outcome == NOT_DEMONSTRABLE
        if alone and self.lower is not None and self.lower >= self.share:
            return "not every requirement is demonstrated by itself"
        return ""

    @property
    def limits(self) -> Limits:
        """The required limits; none of a joint verdict."""
        return Limits(self.at_most, self.at_least)

    @property
    def margin(self) -> float | None:
        """Distance from the demonstrated limit to the required one, positive inside; None if there is none.

        The requirement passes if and only if there is a margin and it is zero or positive.
        """
        low, high = self.enclosed if self.enclosed is not None else (self.demonstrated, self.demonstrated)
        above = None if self.at_most is None or high is None else self.at_most - high
        below = None if self.at_least is None or low is None else low - self.at_least
        return min((distance for distance in (above, below) if distance is not None), default=None)


def judge_all(
    requirements: Sequence[Mapping[str, Any]],
    column: Callable[[str], np.ndarray],
    ok: np.ndarray,
    design: str = "mc",
    looked: bool = False,
    chained: bool = False,
) -> tuple[list[Verdict], Verdict | None]:
    """The verdicts on all requirements of a campaign, one by one and jointly.

    requirements : sequence of dict ("name", "metric", "at_most", "at_least", "share", "confidence"), as in a manifest
    column : function from a metric's name to float64[n_tried]
    ok : bool[n_tried], whether the case was completed
    design : str, of the campaign; only for `SAMPLING_DESIGNS` does a fraction of cases estimate a probability
    looked : bool, whether the number of cases was decided by looking at the results; see `was_looked_at`
    chained : bool, whether the cases are those of another run, so that the run cannot be extended

    Returns (verdicts, joint): a list of Verdict, and the joint Verdict, or None for fewer than two requirements.

    Raises ValueError for a confidence outside (0, 1).

    >>> requirements = [{"name": "fuel", "metric": "fuel_kg", "at_most": 2.5, "share": 0.9, "confidence": 0.9}]
    >>> verdicts, joint = judge_all(requirements, lambda metric: np.linspace(1.0, 2.0, 40), np.ones(40, dtype=bool))
    >>> verdicts[0].outcome, joint
    ('pass', None)
    """
    ok = np.asarray(ok, dtype=bool)
    counts = LimitCounts(requirements)
    counts.add(column, ok)
    ordered: dict[Judged, np.ndarray] = {}

    def ranked(judged: Judged, rank: int) -> float:
        if judged not in ordered:
            values = np.asarray(column(judged.metric), dtype=np.float64)
            ordered[judged] = np.sort(judged.of(values[ok & np.isfinite(values)]))
        return float(ordered[judged][rank - 1])

    return judge_counted(counts, ranked, design, looked, chained)


def judge_counted(
    counts: LimitCounts,
    ranked: Callable[[Judged, int], float] | None,
    design: str = "mc",
    looked: bool = False,
    chained: bool = False,
) -> tuple[list[Verdict], Verdict | None]:
    """The verdicts on the counted requirements, and the joint verdict; None for fewer than two requirements.

    ranked : (Judged, rank from 1) to the order statistic of the usable values; None: no demonstrated bounds.
    design, looked, chained : see `judge_all`.  The joint verdict is also None if the
    joint probability to be demonstrated is not positive.  Its confidence is the smallest of theirs.
    """
    requirements = counts.requirements
    share = (
        joint_share([float(requirement["share"]) for requirement in requirements]) if len(requirements) > 1 else None
    )
    among = len(requirements) + (share is not None)
    further = _further_bounds(design, looked, chained)
    of_all = partial(_verdict, counts=counts, ranked=ranked, design=design, looked=looked, further=further, among=among)
    verdicts = [of_all(requirement, which=k) for k, requirement in enumerate(requirements)]
    if share is None:
        return verdicts, None
    confidence = min(verdict.confidence for verdict in verdicts)
    asked = {"name": JOINT, "metric": "", "share": share, "confidence": confidence}
    alone = of_all(asked, which=-1)
    return verdicts, _joined(alone, [*verdicts, alone], further)


def _joined(joint: Verdict, tests: Sequence[Verdict], further: ShareLimits) -> Verdict:
    """The verdict on the joint share with the outcome of all tests together.

    Cases needed are those for every requirement: of an extended run those that have passed are judged anew.
    """
    failing = tuple(test.name for test in tests if test.shared_outcome == FAIL)
    shared = {test.shared_outcome for test in tests}
    joint = replace(joint, shared_outcome=FAIL if failing else PASS if shared == {PASS} else NOT_DEMONSTRABLE)
    if failing:
        return replace(joint, outcome=FAIL, needed=None, failing=() if joint.outcome == FAIL else failing)
    if all(test.outcome == PASS for test in tests):
        return replace(joint, outcome=PASS, needed=None)
    if not joint.random or any(test.outcome == FAIL for test in tests):
        return replace(joint, outcome=NOT_DEMONSTRABLE, needed=None)
    needed = [
        test.needed or further.smallest_sample(test.share, test.confidence, test.tried - test.passed) for test in tests
    ]
    return replace(joint, outcome=NOT_DEMONSTRABLE, needed=max(needed))


def joint_share(shares: Sequence[float]) -> float | None:
    """The probability of being inside all limits at once that follows if every requirement is met.

    Boole's inequality; None if it gives no positive probability.
    """
    left = 1.0 - sum(1.0 - share for share in shares)
    return left if 0.0 < left < 1.0 else None


def judge(
    requirement: Mapping[str, Any], values: np.ndarray, ok: np.ndarray, design: str = "mc", looked: bool = False
) -> Verdict:
    """The verdict on one requirement.

    requirement : dict ("name", "metric", "at_most", "at_least", "share", "confidence"), as in a manifest
    values : float64[n_tried], the metric
    ok : bool[n_tried], whether the case was completed
    design : str, of the campaign
    looked : bool, whether the number of cases was decided by looking at the results

    Returns a Verdict.

    Raises ValueError for a confidence outside (0, 1).

    >>> requirement = {"name": "fuel", "metric": "fuel_kg", "at_most": 2.5, "share": 0.9, "confidence": 0.9}
    >>> judge(requirement, np.linspace(2.0, 3.0, 40), np.ones(40, dtype=bool)).outcome
    'fail'
    """
    return judge_all([requirement], lambda _: values, ok, design, looked)[0][0]


def _verdict(
    requirement: Mapping[str, Any],
    which: int,
    counts: LimitCounts,
    ranked: Callable[[Judged, int], float] | None,
    design: str,
    looked: bool,
    further: ShareLimits,
    among: int,
) -> Verdict:
    limits = time_uniform if looked else binomial
    share, confidence = float(requirement["share"]), float(requirement["confidence"])
    at_least, at_most = limits_of(requirement)
    tried, passed = counts.tried, counts.tried - counts.outside(which)
    random = design in SAMPLING_DESIGNS
    known = random and tried > 0
    outcome, lower, upper = _outcome(limits, passed, tried, share, confidence) if known else _UNKNOWN
    shared = _outcome(limits, passed, tried, share, 1.0 - (1.0 - confidence) / among)[0] if known else outcome
    accepted = limits.acceptance_number(tried, share, confidence) if known else None
    exact, undecided = known and not looked, random and outcome == NOT_DEMONSTRABLE
    verdict = Verdict(
        name=str(requirement["name"]),
        metric=str(requirement["metric"]),
        at_most=at_most,
        at_least=at_least,
        share=share,
        confidence=confidence,
        outcome=outcome,
        passed=passed,
        tried=tried,
        no_number=counts.without_number(which),
        estimate=passed / tried if tried else None,
        lower=lower,
        upper=upper,
        demonstrated=None,
        enclosed=None,
        needed=further.smallest_sample(share, confidence, tried - passed) if undecided else None,
        accepted=accepted,
        consumer_risk=binomial.pass_chance(tried, accepted, share) if exact else None,
        producer_risk=1.0 - binomial.pass_chance(tried, accepted, binomial.half_rate_share(share)) if exact else None,
        shared_outcome=shared,
        random=random,
        looked=looked,
    )
    if ranked is None or which < 0 or not known:
        return verdict
    return _with_demonstrated_limits(verdict, judged_by(requirement), ranked)


def _further_bounds(design: str, looked: bool, chained: bool) -> ShareLimits:
    """The bounds that judge a run of more cases: this one extended, or a new one where it cannot be extended."""
    return time_uniform if (looked or design in EXTENSIBLE) and not chained else binomial


_UNKNOWN: tuple[str, float | None, float | None] = (NOT_DEMONSTRABLE, None, None)


def _outcome(
    limits: ShareLimits, passed: int, tried: int, share: float, confidence: float
) -> tuple[str, float | None, float | None]:
    """Outcome, lower and upper bound of the passing share."""
    lower = limits.lower_bound(passed, tried, confidence)
    upper = limits.upper_bound(passed, tried, confidence)
    if lower >= share:
        return PASS, lower, upper
    return (FAIL if upper < share else NOT_DEMONSTRABLE), lower, upper


def _with_demonstrated_limits(verdict: Verdict, judged: Judged, ranked: Callable[[Judged, int], float]) -> Verdict:
    """The verdict with the tolerance limit, or both, that the usable values demonstrate."""
    lost, usable = verdict.no_number, verdict.tried - verdict.no_number
    worst_is_largest = verdict.at_least is None
    rank = (tolerance.upper_rank if worst_is_largest else tolerance.lower_rank)(usable, verdict.accepted, lost)
    if rank is None:
        return verdict
    value = ranked(judged, rank)
    if verdict.at_most is None or verdict.at_least is None:
        return replace(verdict, demonstrated=value)
    low = verdict.at_least + value
    return replace(verdict, enclosed=(low, max(low, verdict.at_most - value)))  # midway they may cross by rounding


def was_looked_at(manifest: Mapping[str, Any], n_cases: int, n_flown: int | None = None) -> bool:
    """Whether the number of cases was not fixed before the flight: `run --until verdict`, extended or interrupted runs.

    manifest : dict, of the run
    n_cases : int, number of cases of the run when it is complete
    n_flown : int or None, number of cases flown; None for all of them

    Returns a bool, the argument `looked` of `judge_all`.

    Raises nothing.

    >>> was_looked_at({"campaign": {"cases": 1000}}, 2000)
    True
    """
    shard = manifest.get("shard")
    due = shard["stop"] - shard["first"] if shard else n_cases
    if n_flown is not None and n_flown < due:
        return True
    return bool(manifest.get("looks")) or n_cases > manifest.get("campaign", {}).get("cases", n_cases)
