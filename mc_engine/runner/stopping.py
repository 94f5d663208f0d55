"""Sequential testing: a run in batches, with an interim analysis after each, until every requirement is decided.

The schedule is in the manifest before the first case flies.  Such runs, and runs that were extended after results were
seen, are judged by time-uniform bounds (`statistics.time_uniform`), which hold at every number of cases at once:
neither early stopping nor extension reduces the confidence.  Only for the design "mc", since the bounds need
independent cases.
"""

from dataclasses import replace
from pathlib import Path

from mc_engine.campaign.loading import Campaign
from mc_engine.errors import CampaignError, Problem
from mc_engine.runner import runner
from mc_engine.runner.backends import Backend
from mc_engine.runner.progress import ProgressCall
from mc_engine.runner.summary import outcomes
from mc_engine.store.opening import open_store
from mc_engine.store.store import Store

FIRST_LOOK = 100  # cases before the first interim analysis
GROWTH = 1.5  # from one analysis to the next: a run has at most half as many cases again as it needed
DESIGN = "mc"


def fly_until_decided(
    campaign: Campaign,
    out: Path,
    *,
    progress: ProgressCall | None = None,
    workers: int | None = None,
    backend: Backend | str = "threading",
) -> Store:
    """Run into the new directory `out` until every requirement passes or fails, with at most `campaign.cases` cases.

    Raises CampaignError if the campaign has no requirement or does not allow interim analyses, and RunInterrupted as
    `runner.run` does; `carry_on` then continues by the same schedule.
    """
    refuse_undecidable(campaign)
    looks = schedule(campaign)
    begun = replace(campaign, cases=looks[0], looks=looks)
    store = runner.run(begun, out, progress=progress, workers=workers, backend=backend)
    return _by_schedule(store, progress, workers, backend)


def carry_on(
    path: str | Path,
    *,
    progress: ProgressCall | None = None,
    workers: int | None = None,
    backend: Backend | str = "threading",
    repair: bool = False,
) -> Store:
    """Complete a run: one by `fly_until_decided` until its requirements are decided, others to their last case."""
    store = runner.resume(path, progress=progress, workers=workers, backend=backend, repair=repair)
    return _by_schedule(store, progress, workers, backend)


def _by_schedule(store: Store, progress: ProgressCall | None, workers: int | None, backend: Backend | str) -> Store:
    while not decided(store):
        later = [int(look) for look in store.manifest.get("looks", []) if look > store.n_cases]
        if not later:
            break
        runner.extend(store.path, later[0], progress=progress, workers=workers, backend=backend)
        store = open_store(store.path)
    return store


def refuse_undecidable(campaign: Campaign) -> None:
    """CampaignError unless the campaign can be flown until its requirements are decided."""
    problems = []
    if not campaign.requirements:
        problems.append(Problem("requirement", "there is none to decide; add [requirement.NAME], or fly all cases"))
    if campaign.design != DESIGN:
        message = f'cases of "{campaign.design}" are not independent, as interim analyses need; use "{DESIGN}", '
        problems.append(Problem("campaign.design", f"{message}or fly all cases"))
    if campaign.upstream is not None:
        problems.append(Problem("inputs", "there are as many cases as the run upstream has; fly all cases"))
    if problems:
        raise CampaignError(campaign.name, problems)


def schedule(campaign: Campaign) -> tuple[int, ...]:
    """Numbers of cases of the interim analyses; the last is the number of cases of the campaign.

    A geometric series from FIRST_LOOK by GROWTH, and the number at which all requirements pass if no case fails.
    """
    from mc_engine.statistics.time_uniform import smallest_sample

    most = campaign.cases
    without_failures = [smallest_sample(required.share, required.confidence) for required in campaign.requirements]
    looks = {most, max(without_failures)}
    look = FIRST_LOOK
    while look < most:
        looks.add(look)
        look = int(look * GROWTH)
    return tuple(sorted(look for look in looks if look <= most))


def decided(store: Store) -> bool:
    """True if every requirement passes or fails on the cases at hand."""
    from mc_engine.statistics.requirements import NOT_DEMONSTRABLE

    return all(verdict.outcome != NOT_DEMONSTRABLE for verdict in outcomes(store)[0])
