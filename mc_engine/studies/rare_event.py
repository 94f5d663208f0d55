"""Probability that a campaign violates a requirement, for probabilities too small for plain cases.

Model, distributions and correlations are the campaign's; only the sampling differs: `statistics.subset_simulation` or
`statistics.importance_sampling`.  The result depends on campaign, method, settings and seed, not on the number of
threads.
"""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from mc_engine.campaign.columns import input_column
from mc_engine.campaign.loading import Campaign
from mc_engine.errors import CampaignError, Problem, RunInterrupted
from mc_engine.interruption import stop_signal
from mc_engine.runner.manifest import manifest_of
from mc_engine.statistics.importance_sampling import cross_entropy
from mc_engine.statistics.moments import number_or_none
from mc_engine.statistics.rare_events import RareEvent
from mc_engine.statistics.subset_simulation import subset_simulation
from mc_engine.store.parts import Column
from mc_engine.store.result_folder import write_result
from mc_engine.store.run_files import RARE_EVENT, default_folder
from mc_engine.store.store import refuse_occupied
from mc_engine.store.writer_lock import writer_of_new
from mc_engine.studies.limit_state import AT_LIMIT, LimitState, chosen_requirement
from mc_engine.studies.rare_event_folder import RareEventRecord, open_rare_event

METHODS: dict[str, Callable[..., RareEvent]] = {"subset": subset_simulation, "cross-entropy": cross_entropy}
CASES_PER_LEVEL = 10_000
_SEVERAL = "Failures lie in separate regions; the mean of their inputs lies between them and stands for no failed case."
_APART = 0.7  # distance of the mean of the failed cases over that of the nearest: below this, they lie apart


def estimate_rare_event(
    campaign: Campaign,
    requirement: str | None = None,
    out: Path | None = None,
    *,
    method: str = "subset",
    cases_per_level: int = CASES_PER_LEVEL,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> RareEventRecord:
    """Estimate the probability of not meeting a requirement, and store the result in the new directory `out`.

    requirement : its name; not needed for a single one.  method : one of METHODS.  progress : called with the numbers
    of cases flown and failed.  The interval has the confidence of the campaign's [report], or the greater one at which
    its upper end alone has the confidence that the requirement asks for.  Raises RunInterrupted on Ctrl-C; nothing is
    stored then.
    """
    path = Path(out) if out is not None else default_folder(f"{campaign.name}-rare")
    chosen = chosen_requirement(campaign, requirement)
    manifest = manifest_of(campaign)
    with writer_of_new(path, lambda: refuse_occupied(path)) as lock, stop_signal() as stop:

        def watch(flown: int, failed: int) -> None:
            if stop.is_set():
                raise RunInterrupted(
                    f"interrupted after {flown:,} cases, and nothing is stored: levels rest on one another, so "
                    "the same command has to begin again"
                )
            if progress is not None:
                progress(flown, failed)

        limit = LimitState(campaign, chosen, workers, watch)
        try:
            estimate = METHODS[method](
                limit,
                len(limit.names),
                cases_per_level=cases_per_level,
                seed=campaign.seed,
                noise=True,
                confidence=max(campaign.report.confidence, round(2.0 * chosen.confidence - 1.0, 12)),
            )
        except ValueError as error:
            raise CampaignError(campaign.name, [Problem("--cases-per-level", str(error))]) from None
        columns, arrays = _flown_cases(limit, estimate)
        facts = {"asked": {"method": method, "cases_per_level": cases_per_level}, **_result_record(limit, estimate)}
        record = {**manifest, "rare_event": facts}
        write_result(path, RARE_EVENT, campaign.text, record, {"cases": (columns, arrays)}, lock)
    return open_rare_event(path)


def _flown_cases(limit: LimitState, estimate: RareEvent) -> tuple[list[Column], dict[str, np.ndarray]]:
    campaign, cases, metric = limit.campaign, estimate.cases, limit.metric_field
    inputs = limit.inputs(cases.u)
    columns = [
        Column("case_id", "", "case", "number of the case, in the order flown", "integer"),
        Column("level", "", "case", "level that it was flown for, from 0", "integer"),
        Column("noise_id", "", "case", "case whose noise of the flight it had", "integer"),
        Column("weight", "", "case", "what it counts for; those of the failed add up to the probability"),
        Column("failed", "", "case", "whether the requirement is not met", "switch"),
        Column("status", "", "case", "how the case ended", "word"),
        *(input_column(campaign.model.input(name)) for name in inputs),
        Column(metric.name, metric.unit, "metric", metric.description),
        Column("margin", metric.unit, "case", "distance inside the limit; minus infinity without a number"),
    ]
    arrays = {
        "case_id": np.arange(estimate.n_cases),
        "level": cases.level,
        "noise_id": cases.noise,
        "weight": cases.weight,
        "failed": cases.failed,
        "status": np.concatenate(limit.status),
        **inputs,
        metric.name: np.concatenate(limit.metric),
        "margin": _distance(cases.margin),
    }
    return columns, arrays


def _result_record(limit: LimitState, estimate: RareEvent) -> dict[str, Any]:
    """The result as JSON; None for infinite values."""
    metric = limit.metric_field
    inputs, remark = _failed_inputs(limit, estimate)
    return {
        "requirement": asdict(limit.requirement),
        "metric": {"name": metric.name, "unit": metric.unit, "description": metric.description},
        "method": estimate.method,
        "probability": estimate.probability,
        "lower": estimate.lower,
        "upper": estimate.upper,
        "confidence": estimate.confidence,
        "relative_error": number_or_none(estimate.relative_error),
        "plain_cases": number_or_none(estimate.plain_cases),
        "cases": estimate.n_cases,
        "failed": int(estimate.cases.failed.sum()),
        "no_number": int(np.isneginf(estimate.cases.margin).sum()),
        "levels": [
            {**asdict(level), "margin": number_or_none(float(_distance(level.margin)))} for level in estimate.levels
        ],
        "inputs": inputs,
        "remarks": [*estimate.remarks, *remark],
    }


def _failed_inputs(limit: LimitState, estimate: RareEvent) -> tuple[list[dict[str, Any]], list[str]]:
    """The inputs of failed cases: one record for each input, and a remark if one mean does not describe them.

    The most probable failed case is the one nearest to the origin of standard normal space, where the density is
    largest: an estimate of the design point of structural reliability.  If failures are in several regions, the most
    probable failed case on the opposite side of the origin is added, if there is one.
    """
    failed = np.flatnonzero(estimate.cases.failed)
    if not estimate.cases.weight[failed].any():  # those of the levels before importance sampling count for nothing
        return [], []
    u, weight = estimate.cases.u[failed], estimate.cases.weight[failed]
    nearest = int(np.argmin((u * u).sum(axis=1)))
    share = weight / weight.sum()
    rare = estimate.probability < 0.5  # else they surround the origin, in one region
    apart = rare and float(np.linalg.norm(share @ u)) < _APART * float(np.linalg.norm(u[nearest]))
    across = np.flatnonzero(u @ u[nearest] < 0.0) if apart else np.empty(0, int)
    shown = {"likeliest": nearest}
    if across.size:
        shown["across"] = int(across[np.argmin((u[across] ** 2).sum(axis=1))])
    sigmas, values = limit.sigmas(u), limit.inputs(u[list(shown.values())])
    mean = share @ sigmas
    spread = np.sqrt(np.maximum(share @ (sigmas - mean) ** 2, 0.0))
    records = [
        {
            "name": name,
            "unit": limit.campaign.model.input(name).unit,
            "description": limit.campaign.model.input(name).description,
            "mean_sigma": mean[k],
            "spread_sigma": spread[k],
            **{f"{case}_sigma": sigmas[row, k] for case, row in shown.items()},
            **{case: values[name][place] for place, case in enumerate(shown)},
        }
        for k, name in enumerate(limit.names)
    ]
    return records, [_SEVERAL] * apart


def _distance(margin: np.ndarray | float) -> np.ndarray:
    """Margins as distances: that of a case right at its limit, which is inside, is 0."""
    return np.where(np.equal(margin, AT_LIMIT), 0.0, margin)
