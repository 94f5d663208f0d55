"""Flying until every requirement is decided: batches by a stated schedule, and a look at the verdicts after each.

The schedule stands in the manifest before the first case flies.  Runs of this kind, and runs that were given more
cases after the first had been seen, are judged by limits that hold at every number of cases at once
(`statistics.time_uniform`), so that stopping early, going on after all, or extending by hand takes nothing from the
confidence.  Only for the design "mc": cases of "lhs" are a sample as a whole only, and those of "sobol"
depend on one another, which the limits do not allow for.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from mc_engine.campaign.loading import Campaign
from mc_engine.errors import CampaignError, Problem
from mc_engine.runner import runner
from mc_engine.runner.backends import Backend
from mc_engine.runner.progress import ProgressCall
from mc_engine.runner.summary import judgement
from mc_engine.store.opening import open_store
from mc_engine.store.store import Store

FIRST_LOOK = 100  # cases; a design that fails often is recognised with fewer still, and that soon costs nothing
GROWTH = 1.5  # from look to look: at most half as many cases again as were needed
DESIGN = "mc"


def fly_until_decided(
    campaign: Campaign,
    out: Path,
    *,
    progress: ProgressCall | None = None,
    workers: int | None = None,
    backend: Backend | str = "threading",
) -> Store:
    """Fly into the new directory `out` until every requirement passes or fails, `campaign.cases` at most.

    Raises CampaignError if the campaign has nothing to decide or its cases cannot be judged on the way, and
    RunInterrupted as `runner.run` does; `carry_on` then goes on by the same schedule.
    """
    refuse_undecidable(campaign)
    looks = schedule(campaign)
    begun = replace(campaign, cases=looks[0], looks=looks)
    store = runner.run(begun, out, progress=progress, workers=workers, backend=backend)
    return _by_looks(store, progress, workers, backend)


def carry_on(
    path: str | Path,
    *,
    progress: ProgressCall | None = None,
    workers: int | None = None,
    backend: Backend | str = "threading",
    repair: bool = False,
) -> Store:
    """Complete a run: one that `fly_until_decided` began up to the look that decides, others to their last case."""
    store = runner.resume(path, progress=progress, workers=workers, backend=backend, repair=repair)
    return _by_looks(store, progress, workers, backend)


def _by_looks(store: Store, progress: ProgressCall | None, workers: int | None, backend: Backend | str) -> Store:
    while not decided(store):
        later = [look for look in looks_of(store.manifest) if look > store.n_cases]
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
        message = f'cases of "{campaign.design}" are not independent and cannot be judged on the way; use "{DESIGN}", '
        problems.append(Problem("campaign.design", f"{message}or fly all cases"))
    if campaign.upstream is not None or campaign.first is not None:
        problems.append(Problem("inputs", "there are as many cases as the run upstream has; fly all cases"))
    if problems:
        raise CampaignError(campaign.name, problems)


def schedule(campaign: Campaign) -> tuple[int, ...]:
    """The numbers of cases at which the verdicts are looked at; the last is all that the campaign has.

    From FIRST_LOOK on by GROWTH, and where every requirement passes if no case fails.
    """
    from mc_engine.statistics.time_uniform import smallest_sample

    most = campaign.cases
    looks = {most, max(smallest_sample(one.share, one.confidence) for one in campaign.requirements)}
    look = FIRST_LOOK
    while look < most:
        looks.add(look)
        look = int(look * GROWTH)
    return tuple(sorted(look for look in looks if look <= most))


def looks_of(manifest: Mapping[str, Any]) -> list[int]:
    """The schedule that a run was begun with; empty if it was to fly all its cases."""
    return [int(look) for look in manifest.get("looks", [])]


def decided(store: Store) -> bool:
    """True if every requirement passes or fails on the cases at hand."""
    from mc_engine.statistics.requirements import NOT_DEMONSTRABLE

    return all(verdict.outcome != NOT_DEMONSTRABLE for verdict in judgement(store)[0])
