"""Running of campaigns: run, resume, extend, rerun, merge, replay.

A worker draws, flies and writes a chunk of cases; the calling process commits it.  The result of a case depends only on
campaign, sources, seed and case_id, and not on chunks, workers or backend.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from mc_engine.campaign.cases import case_table, full_inputs
from mc_engine.campaign.loading import Campaign, load_campaign
from mc_engine.campaign.sensitivity_design import noise_ids
from mc_engine.errors import CampaignError, Problem, StoreError
from mc_engine.flight.chunks import name_upstream
from mc_engine.flight.contract import refuse_breaches
from mc_engine.flight.flight import fly_history
from mc_engine.flight.lost_numbers import first_lost, may_be_lost
from mc_engine.runner.backends import Backend
from mc_engine.runner.flown_campaign import campaign_of, companions_of, refuse_undeclared_data
from mc_engine.runner.histories import history_frame
from mc_engine.runner.manifest import columns_of, manifest_of
from mc_engine.runner.progress import ProgressCall
from mc_engine.runner.sessions import Session, complete, fly_failed, session_of
from mc_engine.runner.shards import Shard, merge_shards
from mc_engine.sampling.designs import block_problem, extension_problem
from mc_engine.store.opening import open_store
from mc_engine.store.repair import mend_journal
from mc_engine.store.run_files import JOURNAL
from mc_engine.store.run_folder import default_folder
from mc_engine.store.store import Store, create_store
from mc_engine.store.urls import is_url

THREADS = Backend()


@dataclass(frozen=True)
class Replay:
    """One case flown again.  differences : each stored number that is not reproduced to the bit; `equal` if none.

    history, row : the case's time history, and its stored row.
    lost : the place in the model where the state or a metric became not finite, with values; empty if all are finite.
    """

    equal: bool
    differences: tuple[str, ...]
    history: pd.DataFrame
    row: dict[str, Any]
    lost: str = ""


def run(
    campaign: Campaign,
    out: str | Path | None = None,
    *,
    progress: ProgressCall | None = None,
    workers: int | None = None,
    chunk: int | None = None,
    backend: Backend | str = THREADS,
    shard: Shard | None = None,
) -> Store:
    """Run a campaign and store every case in the new directory `out` (by default runs/<campaign>-<time>).

    workers : number of threads or processes, by default one per core.  chunk : cases that a worker flies at a time.
    backend : a Backend or its name, "threading", "loky" or "dask".  shard : only its cases; `merge` joins the shards.
    progress : called with the cases done, in all and failed.
    If the campaign takes inputs from a run that does not exist yet, that run is made first, next to `out`.
    Returns the complete Store.  Raises CampaignError or ModelError (invalid campaign or model), StoreError (`out` is
    occupied or a URL), RunInterrupted (Ctrl-C or a full disk; complete chunks are kept, and `resume` continues).
    """
    if out is not None and is_url(out):
        raise StoreError(f"{out}: is a URL; fly into a folder, and give that and the URL to object_store.publish")
    path = Path(out) if out is not None else default_folder(campaign.name)
    session = session_of(progress, workers, chunk, backend)
    refuse_breaches(campaign)
    refuse_undeclared_data(campaign)
    campaign = _after_first(campaign, path, session)
    manifest = manifest_of(campaign)
    if shard is not None:
        manifest["shard"] = shard.record(campaign.cases)
    store = create_store(path, manifest, campaign.text, columns_of(campaign), companions_of(campaign))
    return complete(store, campaign, session)


def _after_first(campaign: Campaign, path: Path, session: Session) -> Campaign:
    """The campaign with its upstream run, which is first made or completed next to `path` if necessary."""
    if campaign.first is None:
        return campaign
    name = re.sub(r"[^\w.-]+", "-", campaign.first.name)
    beside = path.with_name(f"{path.name}-{name}")
    if (beside / JOURNAL).exists():
        store = open_store(beside)
        complete(store, campaign_of(store), session)
        if store.manifest["campaign"]["digest"] != campaign.first.digest or store.n_cases != campaign.first.cases:
            raise StoreError(f"{beside}: holds another run than this campaign takes its inputs from")
    else:
        run(
            campaign.first,
            beside,
            progress=session.progress,
            workers=session.workers,
            chunk=session.chunk,
            backend=session.backend,
        )
    return load_campaign(
        campaign.name,
        cases=campaign.cases,
        seed=campaign.seed,
        text=campaign.text,
        directory=campaign.directory,
        upstream=beside,
    )


def resume(
    path: str | Path,
    *,
    progress: ProgressCall | None = None,
    workers: int | None = None,
    chunk: int | None = None,
    backend: Backend | str = THREADS,
    repair: bool = False,
) -> Store:
    """Complete the run in `path`; StoreError if the sources have changed since it began.

    repair : fly damaged parts again, see `mc_engine.store.repair`.  All other arguments as for `run`.
    """
    if repair:
        mend_journal(Path(path))
    store = open_store(path)
    return complete(store, campaign_of(store), session_of(progress, workers, chunk, backend), repair)


def extend(
    path: str | Path,
    cases: int,
    *,
    progress: ProgressCall | None = None,
    workers: int | None = None,
    chunk: int | None = None,
    backend: Backend | str = THREADS,
) -> Store:
    """Extend the run in `path` to `cases` cases; they are the same as in a run that began with so many.

    StoreError if the design cannot be extended or has as many cases already; CampaignError if the number is no whole
    number of the design's blocks.  All other arguments as for `run`.
    """
    store = open_store(path)
    if sentence := extension_problem(store.manifest, store.n_cases, cases):
        raise StoreError(f"{path}: {sentence}")
    campaign = campaign_of(store)  # first of all, since it refuses changed sources
    if sentence := block_problem(campaign.design, len(campaign.dispersions), cases):
        raise CampaignError(campaign.name, [Problem("cases", sentence)])
    store.note("extended", cases=cases)
    return complete(store, campaign_of(store), session_of(progress, workers, chunk, backend))


def rerun(
    path: str | Path,
    *,
    progress: ProgressCall | None = None,
    workers: int | None = None,
    backend: Backend | str = THREADS,
) -> Store:
    """Fly the failed cases of a complete run again, for example after their worker was killed.

    All other rows stay.  A case that failed because of its physics fails again, with the same bits.
    """
    store = open_store(path)
    return fly_failed(store, campaign_of(store), session_of(progress, workers, None, backend))


def merge(
    out: str | Path,
    shards: Sequence[str | Path],
    *,
    progress: ProgressCall | None = None,
    workers: int | None = None,
    chunk: int | None = None,
) -> Store:
    """Join the run directories of all shards of a campaign in the new run directory `out`.

    StoreError if cases are missing, or if the shards are not of one campaign; see `mc_engine.runner.shards`.
    """
    store, campaign = merge_shards(Path(out), [Path(shard) for shard in shards], chunk)
    return complete(store, campaign, session_of(progress, workers, chunk, THREADS))


def replay(path: str | Path, case_id: int) -> Replay:
    """Fly one case of a run alone, by the scalar kernel, and compare every stored number bit for bit."""
    store = open_store(path)
    campaign = campaign_of(store)
    table = case_table(campaign, np.array([case_id]))
    inputs = full_inputs(campaign, {name: column[0] for name, column in table.items()})
    flown = campaign.model, inputs, int(noise_ids(campaign, np.array([case_id]))[0]), campaign.seed
    flight, history = fly_history(*flown, folder=campaign.directory, width=1)
    name_upstream(campaign, np.array([case_id]), flight)
    stored = store.row(case_id)
    again = {**table, **flight}
    differences = [
        f"case {case_id}, {name}: stored {stored[name]!r}, now {value!r}"
        for name, value in ((name, column[0]) for name, column in again.items())
        if not _same_bits(stored[name], value)
    ]
    lost = first_lost(*flown, f"case {case_id}") if may_be_lost(campaign.model, flight) else ""
    return Replay(not differences, tuple(differences), history_frame(case_id, history), stored, lost)


def _same_bits(stored: Any, value: Any) -> bool:
    if isinstance(value, float | np.floating):
        return np.float64(stored).tobytes() == np.float64(value).tobytes()
    return bool(stored == value)
