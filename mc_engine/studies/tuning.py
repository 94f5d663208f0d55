"""Tuning: a search for the parameters with the best metrics, of the nominal or dispersed cases, within constraints.

A generation is flown as one table of cases; see `candidates`.  Every candidate flown is kept, and the front is computed
from all of them, not from the last generation alone.
"""

from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from mc_engine.campaign.loading import Campaign, refuse_no_campaign
from mc_engine.campaign.tuning_section import Constraint, Objective, Tuning
from mc_engine.errors import CampaignError, Problem, RunInterrupted
from mc_engine.interruption import stop_signal
from mc_engine.runner.manifest import manifest_of
from mc_engine.runner.sessions import ProgressCall, count_of, session_of
from mc_engine.section import Section
from mc_engine.store.parts import Column
from mc_engine.store.result_folder import ColumnsAndArrays, write_result
from mc_engine.store.run_files import TUNING, default_folder, path_of
from mc_engine.store.store import refuse_occupied
from mc_engine.store.writer_lock import WriterLock, writer_of_new
from mc_engine.studies.candidates import Scores, cases_per_candidate, fly_candidates
from mc_engine.studies.genetic_search import GeneticSearch, hypervolume, non_dominated
from mc_engine.studies.tuning_folder import UNFINISHED, TuningRecord, open_tuning

_SEED_RANGE = 2**32  # what the search takes
_NEWS = 1e-3  # a smaller growth of the dominated volume, or fall of the violation, is no progress


class Generation(NamedTuple):
    """One generation: its candidates, their scores, and the front and least violation of all so far.

    front : float64[n, n_objectives], small is good
    """

    candidates: np.ndarray
    scores: Scores
    front: np.ndarray
    least_violation: float


def tune(
    campaign: Campaign,
    out: Path | None = None,
    *,
    seed: int | None = None,
    generations: int | None = None,
    population: int | None = None,
    workers: int | None = None,
    progress: ProgressCall | None = None,
) -> TuningRecord:
    """Search for the best parameters by NSGA-II, as the campaign's section [tuning] specifies, and store the result.

    Needs the extra `tune` (pymoo).  The result is stored after every generation.

    campaign : Campaign with a [tuning]
    out : Path, the new directory; runs/<campaign>-<UTC time> by default
    seed : int, of the search, in place of the file's
    generations : int, in place of the file's
    population : int, candidates in a generation, in place of the file's
    workers : int, threads; all cores by default.  The result does not depend on it.
    progress : function of (flights done, flights wanted, flights failed), called after each generation

    Returns a TuningRecord.

    Raises CampaignError without a [tuning], EngineError without pymoo and for invalid numbers, StoreError if `out` is
    occupied, and RunInterrupted after the generation in which Ctrl-C was pressed; the generations completed by then are
    stored.

    >>> record = tune(load_campaign("apogee.toml"), "runs/apogee", generations=2, population=4)
    >>> len(record.evaluations)
    8
    """
    refuse_no_campaign(campaign)
    tuning = campaign.tuning
    if tuning is None:
        message = (
            "is missing: nothing says what is to be tuned, and for what; write [tuning.parameter.NAME] and "
            "[tuning.objective.NAME], as flexible_satellite/stage_1 does"
        )
        raise CampaignError(campaign.name, [Problem("tuning", message)])
    path = default_folder(campaign.name) if out is None else path_of(out, "out: {} is no path")
    session = session_of(progress, workers, None, "threading")
    own_seed = campaign.seed % _SEED_RANGE if tuning.seed is None else tuning.seed
    plan: dict[str, Any] = {
        "seed": own_seed if seed is None else count_of("seed", seed, 0),
        "population": tuning.population if population is None else count_of("population", population, 4),
        "generations": tuning.generations if generations is None else count_of("generations", generations),
        "patience": tuning.patience,
    }
    search = GeneticSearch(tuning, plan["population"], plan["seed"])  # says so if pymoo is not there
    manifest = manifest_of(campaign)
    manifest["provenance"]["packages"]["pymoo"] = version("pymoo")

    def keep(flown: list[Generation], end: str) -> None:
        about = {**plan, "flown": len(flown), "end": end, **_search_record(campaign, tuning)}
        _write_tables(path, campaign, tuning, flown, {**manifest, "tuning": about}, lock)

    with writer_of_new(path, lambda: refuse_occupied(path)) as lock:
        flown, end = _search(campaign, tuning, plan, search, session.workers, keep, progress)
        keep(flown, end)
    if end == "interrupted":
        raise RunInterrupted(f"interrupted after {len(flown)} of {plan['generations']} generations; they are in {path}")
    return open_tuning(path)


def _search(
    campaign: Campaign,
    tuning: Tuning,
    plan: dict[str, Any],
    search: GeneticSearch,
    workers: int,
    keep: Callable[[list[Generation], str], None],
    progress: ProgressCall | None,
) -> tuple[list[Generation], str]:
    """All generations, and why there are no more of them; `keep` stores what there is after each."""
    per, flown = cases_per_candidate(campaign, tuning), list[Generation]()
    with stop_signal() as stop:
        for number in range(plan["generations"]):
            candidates = search.ask()
            if not len(candidates):
                return flown, "no new candidate"
            scores = fly_candidates(campaign, tuning, candidates, workers)
            search.tell(scores)
            before = flown[-1] if flown else None
            flown.append(_generation(candidates, scores, before, tuning.signs))
            keep(flown, UNFINISHED)
            if progress is not None:
                failed = sum(int(generation.scores.failed.sum()) for generation in flown)
                progress(
                    per * sum(len(generation.candidates) for generation in flown),
                    per * plan["population"] * plan["generations"],
                    failed,
                )
            if number + 1 < plan["generations"] and stop.is_set():
                return flown, "interrupted"
            if plan["patience"] is not None and is_stalled(flown, plan["patience"]):
                return flown, f"no progress in {plan['patience']} generations"
    return flown, "all generations"


def _generation(candidates: np.ndarray, scores: Scores, before: Generation | None, signs: np.ndarray) -> Generation:
    violation = scores.violation
    front = signs * scores.objectives[violation == 0.0]
    least = float(violation.min(initial=np.inf))
    if before is not None:
        front, least = np.vstack([before.front, front]), min(before.least_violation, least)
    return Generation(candidates, scores, front[non_dominated(front)], least)


def is_stalled(flown: Sequence[Generation], patience: int) -> bool:
    """Whether the last `patience` generations brought neither a larger front nor a smaller violation."""
    if len(flown) <= patience:
        return False
    then, now = flown[-1 - patience], flown[-1]
    if not len(now.front):
        return now.least_violation > (1.0 - _NEWS) * then.least_violation or now.least_violation == then.least_violation
    volumes = dominated_shares([then.front, now.front])
    return bool(len(then.front)) and volumes[1] - volumes[0] < _NEWS * max(volumes[1], 1e-300)


def dominated_shares(fronts: Sequence[np.ndarray]) -> np.ndarray:
    """float64[n]: fraction of the common bounding box that each front dominates; 0 for an empty front."""
    every = np.vstack(list(fronts))
    if not len(every):
        return np.zeros(len(fronts))
    low, high = every.min(axis=0), every.max(axis=0)
    # a little beyond the worst, so that the ends of the front count, too, and a front of one point has a volume
    room = np.where(high > low, high - low, np.maximum(np.abs(high), 1.0))
    reference = np.full(len(low), 1.1)
    return np.array([hypervolume((front - low) / room, reference) for front in fronts]) / 1.1 ** len(low)


# ---- the tables


def _write_tables(
    path: Path,
    campaign: Campaign,
    tuning: Tuning,
    flown: list[Generation],
    manifest: dict[str, Any],
    lock: WriterLock,
) -> None:
    columns, arrays = _evaluations(campaign, tuning, flown)
    small = tuning.signs * np.column_stack([arrays[objective.name] for objective in tuning.objectives])
    front = np.flatnonzero(non_dominated(np.where(arrays["feasible"][:, None], small, np.nan)))
    front = front[np.argsort(small[front, 0], kind="stable")]
    ended = manifest["tuning"]["end"] != UNFINISHED
    tables: dict[str, ColumnsAndArrays] = {
        "evaluations": (columns, arrays),
        "generations": _generations(flown, ended),
        "front": (columns, {name: values[front] for name, values in arrays.items()}),
    }
    write_result(path, TUNING, campaign.text, manifest, tables, lock)


def _evaluations(
    campaign: Campaign, tuning: Tuning, flown: list[Generation]
) -> tuple[list[Column], dict[str, np.ndarray]]:
    model, violation = campaign.model, np.concatenate([generation.scores.violation for generation in flown])
    inputs = [model.input(parameter.name) for parameter in tuning.parameters]
    columns = [
        Column("candidate", "", "candidate", "number of the candidate, from 0", "integer"),
        Column("generation", "", "candidate", "generation that it came in, from 0", "integer"),
        *(Column(input.name, input.unit, "tuned", input.description) for input in inputs),
        *(_measure_column(campaign, objective, "objective") for objective in tuning.objectives),
        *(_measure_column(campaign, constraint, "constraint") for constraint in tuning.constraints),
        Column("violation", "", "candidate", "how far beyond the limits, in shares of them, added up"),
        Column("feasible", "", "candidate", "whether all its measures are numbers that meet the constraints", "switch"),
        Column("failed_cases", "", "candidate", "its cases that did not complete", "integer"),
        Column("commonest_failure", "", "candidate", "how and why most of these ended", "word"),
    ]
    numbers = np.vstack(
        [
            np.hstack([generation.candidates, generation.scores.objectives, generation.scores.limited])
            for generation in flown
        ]
    )
    arrays = {
        "candidate": np.arange(len(numbers)),
        "generation": np.repeat(np.arange(len(flown)), [len(generation.candidates) for generation in flown]),
        **{column.name: numbers[:, k] for k, column in enumerate(columns[2:-4])},
        "violation": violation,
        "feasible": violation == 0.0,
        "failed_cases": np.concatenate([generation.scores.failed for generation in flown]),
        "commonest_failure": np.concatenate([generation.scores.reasons for generation in flown]),
    }
    return columns, arrays


def _measure_column(campaign: Campaign, measure: Objective | Constraint, role: str) -> Column:
    metric = next(metric for metric in campaign.model.metrics if metric.name == measure.metric)
    of = (
        "the nominal case"
        if measure.quantile is None
        else f"quantile {measure.quantile:g} of {campaign.cases} dispersed cases"
    )
    return Column(measure.name, metric.unit, role, f"{metric.description}; {of}")


def _generations(flown: list[Generation], ended: bool) -> tuple[list[Column], dict[str, np.ndarray]]:
    """How the search went on; the shares, which take time and change with every front, once it has ended."""
    columns = [
        Column("generation", "", "generation", "number of the generation, from 0", "integer"),
        Column("evaluations", "", "generation", "candidates flown so far", "integer"),
        Column("feasible_so_far", "", "generation", "of these, how many are feasible", "integer"),
        Column("front_size", "", "generation", "candidates on the front of all so far", "integer"),
        Column("least_violation", "", "generation", "smallest violation so far; 0 where a candidate is feasible"),
        Column("dominated_share", "", "generation", "fraction of the box of all fronts that this front dominates"),
    ]
    arrays = {
        "generation": np.arange(len(flown)),
        "evaluations": np.cumsum([len(generation.candidates) for generation in flown]),
        "feasible_so_far": np.cumsum([np.count_nonzero(generation.scores.violation == 0.0) for generation in flown]),
        "front_size": np.array([len(generation.front) for generation in flown]),
        "least_violation": np.array([generation.least_violation for generation in flown]),
        "dominated_share": dominated_shares([generation.front for generation in flown])
        if ended
        else np.full(len(flown), np.nan),
    }
    return columns, arrays


def _search_record(campaign: Campaign, tuning: Tuning) -> dict[str, Any]:
    """What was searched, as plain data for the report."""
    return {
        "cases": campaign.cases if tuning.robust else 1,
        "parameters": [
            _record(parameter) | {"nominal": campaign.nominal[parameter.name]} for parameter in tuning.parameters
        ],
        "objectives": [_record(objective) for objective in tuning.objectives],
        "constraints": [_record(constraint) for constraint in tuning.constraints],
        "published": [_record(point) for point in tuning.published],
        "crossover": tuning.crossover,
        "mutation": tuning.mutation or 1.0 / len(tuning.parameters),
    }


def _record(section: Section) -> dict[str, Any]:
    return section.model_dump(exclude={"note"})
