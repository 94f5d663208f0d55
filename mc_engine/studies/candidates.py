"""Candidates of a tuning: sets of values of the tuned parameters, flown together and scored.

All candidates of a generation, and for quantiles all their dispersed cases, are flown as one table of cases.  Every
candidate flies the same cases with the same noise, so that two candidates differ only in their parameters.
"""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mc_engine.campaign.cases import case_table
from mc_engine.campaign.loading import Campaign
from mc_engine.campaign.tuning_section import Constraint, Tuning
from mc_engine.flight.chunks import NOMINAL_NOISE, fly_in_threads
from mc_engine.model.faults import naming_faults
from mc_engine.sampling.distributions import column
from mc_engine.status import OK, STATUS_MEANING, STATUS_NAME


@dataclass(frozen=True)
class Scores:
    """Scores of n candidates, in declared units.  NaN: the nominal case, or too many of the dispersed ones, failed.

    objectives : float64[n, n_objectives]
    limited : float64[n, n_constraints], the metrics under constraints
    excess : float64[n, n_constraints], how far each is beyond its limit, as a fraction of that limit; 0 inside
    failed : int64[n], cases that did not complete
    reasons : object[n] of str, the commonest failure of each candidate; empty where none failed
    """

    objectives: np.ndarray
    limited: np.ndarray
    excess: np.ndarray
    failed: np.ndarray
    reasons: np.ndarray

    @property
    def violation(self) -> np.ndarray:
        """float64[n]: 0 for a candidate that meets all constraints; infinite where not every metric is a number."""
        total = self.excess.sum(axis=1)
        return np.where(np.isfinite(total) & np.isfinite(self.objectives).all(axis=1), total, np.inf)


def cases_per_candidate(campaign: Campaign, tuning: Tuning) -> int:
    """How many flights one candidate takes."""
    return int(tuning.nominal) + (campaign.cases if tuning.robust else 0)


def fly_candidates(campaign: Campaign, tuning: Tuning, candidates: np.ndarray, workers: int = 1) -> Scores:
    """Fly and measure candidates.

    candidates : float64[n, n_tuned], in declared units and the order of the tuning's parameters.
    workers : threads; the numbers do not depend on it.
    """
    n, per = len(candidates), cases_per_candidate(campaign, tuning)
    ids, table = _shared_cases(campaign, tuning)
    inputs = {name: np.tile(values, n) for name, values in table.items()}
    inputs |= {parameter.name: np.repeat(candidates[:, k], per) for k, parameter in enumerate(tuning.parameters)}
    names = list(dict.fromkeys(measure.metric for measure in tuning.measures))
    with naming_faults(campaign.model_reference, "a candidate"):
        flown = fly_in_threads(campaign, inputs, np.tile(ids, n), ["status", "reason", *names], workers)
    ok = (flown["status"] == STATUS_NAME[OK]).reshape(n, per)
    metrics = {name: np.where(ok, flown[name].reshape(n, per), np.nan) for name in names}
    measured = [
        _measured(metrics[measure.metric], measure.quantile, measure.large_is_bad, tuning.nominal)
        for measure in tuning.measures
    ]
    objectives, limited = measured[: len(tuning.objectives)], measured[len(tuning.objectives) :]
    excess = [_excess(values, constraint) for values, constraint in zip(limited, tuning.constraints, strict=True)]
    status, reason = (flown[name].reshape(n, per) for name in ("status", "reason"))
    reasons = [commonest_failure(how[~good], why[~good]) for how, why, good in zip(status, reason, ok, strict=True)]
    return Scores(
        _side_by_side(objectives, n),
        _side_by_side(limited, n),
        _side_by_side(excess, n),
        np.count_nonzero(~ok, axis=1),
        np.array(reasons, dtype=object),
    )


def commonest_failure(status: Iterable[str], reason: Iterable[str]) -> str:
    """The commonest status and reason among failed cases, as "refused: ..."; empty without any.

    status, reason : of each failed case; without a reason, the meaning of the status is used.  Of equally common ones,
        the first.
    """
    ends = Counter(f"{how}: {why or STATUS_MEANING[how]}" for how, why in zip(status, reason, strict=True))
    return ends.most_common(1)[0][0] if ends else ""


def _side_by_side(values: list[np.ndarray], n: int) -> np.ndarray:
    return np.column_stack(values) if values else np.empty((n, 0))


def _shared_cases(campaign: Campaign, tuning: Tuning) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """(case numbers, dispersed inputs) that every candidate flies; the nominal case is the first, if it is wanted."""
    nominal = {dispersion.name: column([campaign.nominal[dispersion.name]]) for dispersion in campaign.dispersions}
    if not tuning.robust:
        return np.array([NOMINAL_NOISE]), nominal
    ids = np.arange(campaign.cases, dtype=np.int64)
    table = case_table(campaign, ids)
    if not tuning.nominal:
        return ids, table
    return np.append(NOMINAL_NOISE, ids), {name: np.append(nominal[name], table[name]) for name in table}


def _measured(values: np.ndarray, quantile: float | None, large_is_bad: bool, nominal_first: bool) -> np.ndarray:
    """float64[n]: the nominal case's number, or an order statistic of the others; NaN where that is a failed case.

    values : float64[n, cases].  A case without a number takes the worst rank.
    """
    if quantile is None:
        return values[:, 0]
    dispersed = values[:, int(nominal_first) :]
    ranked = np.sort(np.where(np.isnan(dispersed), np.inf if large_is_bad else -np.inf, dispersed), axis=1)
    chosen = ranked[:, quantile_rank(quantile, ranked.shape[1], large_is_bad)]
    return np.where(np.isfinite(chosen), chosen, np.nan)


def quantile_rank(quantile: float, n_cases: int, large_is_bad: bool) -> int:
    """Place, from 0 and the smallest, of the case that stands for a quantile: never the better one of two."""
    share = quantile * n_cases
    rank = np.ceil(share - 1e-9) - 1 if large_is_bad else np.floor(share + 1e-9)
    return int(np.clip(rank, 0, n_cases - 1))


def _excess(values: np.ndarray, constraint: Constraint) -> np.ndarray:
    """How far beyond its limits a metric is, in shares of the limit (of 1 where that is zero); NaN stays NaN."""
    beyond = np.where(np.isnan(values), np.nan, 0.0)
    if constraint.at_most is not None:
        beyond = np.maximum(beyond, (values - constraint.at_most) / (abs(constraint.at_most) or 1.0))
    if constraint.at_least is not None:
        beyond = np.maximum(beyond, (constraint.at_least - values) / (abs(constraint.at_least) or 1.0))
    return beyond
