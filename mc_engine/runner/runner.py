"""Running of campaigns: run, resume, extend, rerun, merge, replay.

A worker draws, flies and writes a chunk of cases; the calling process commits it.  The result of a case depends only on
campaign, sources, seed and case_id, and not on chunks, workers or backend.
"""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mc_engine.campaign.cases import case_table
from mc_engine.campaign.loading import Campaign, load_campaign, refuse_no_campaign
from mc_engine.campaign.sections import HistoriesSection
from mc_engine.durable_file import remove_folder, remove_if_empty
from mc_engine.errors import CampaignError, EngineError, ModelError, Problem, StoreError
from mc_engine.flight.chunks import name_upstream
from mc_engine.flight.flyers import flyer_of
from mc_engine.interruption import in_threads
from mc_engine.runner.backends import Backend, flyer_on
from mc_engine.runner.flown_campaign import campaign_of, companions_of, refuse_undeclared_data
from mc_engine.runner.histories import history_frame, inputs_of
from mc_engine.runner.manifest import columns_of, manifest_of
from mc_engine.runner.progress import ProgressCall
from mc_engine.runner.sessions import Session, complete, count_of, fly_failed, session_of
from mc_engine.runner.shards import Shard, merge_shards
from mc_engine.sampling.designs import block_problem, extension_problem
from mc_engine.status import CRASHED, STATUS_NAME
from mc_engine.store.opening import open_store
from mc_engine.store.parts import PART_FOLDERS
from mc_engine.store.repair import mend_journal
from mc_engine.store.run_files import CAMPAIGN, JOURNAL, MANIFEST, NOMINAL, SIMULATOR, default_folder, path_of, stem_of
from mc_engine.store.store import Store, create_store
from mc_engine.store.urls import is_url
from mc_engine.store.writer_lock import LOCK_FILES

if TYPE_CHECKING:
    import pandas as pd

THREADS = Backend()


@dataclass(frozen=True)
class Replay:
    """The result of `replay`: one case flown again, and whether its numbers equal the stored ones.

    equal : bool, every stored number has the same bits, or is within `tolerance`
    differences : tuple of str, a sentence for each number that differs
    history : DataFrame, the time history: case_id, t_s and the model's outputs
    row : dict, the stored row of the case table, by column name
    lost : str, file, line and values of what made the state or a metric infinite or NaN; empty if all are finite
    tolerance : float, allowed relative difference, that of a simulator which is not deterministic; None if bits were
        compared

    >>> again = replay("runs/small", 3)
    >>> again.equal, list(again.history)
    (True, ['case_id', 't_s', 'altitude_km', 'speed_m_s'])
    """

    equal: bool
    differences: tuple[str, ...]
    history: "pd.DataFrame"
    row: dict[str, Any]
    lost: str = ""
    tolerance: float | None = None


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
    """Run a campaign and store every case in the new directory `out`.

    campaign : Campaign, from `load_campaign`
    out : str or Path, must not exist, or be empty; runs/<campaign>-<UTC time> by default
    progress : function of (cases done, cases wanted, cases failed), called after each chunk
    workers : int, number of threads or processes; one per core by default
    chunk : int, number of cases that a worker flies at a time
    backend : Backend, or its name: "threading", "loky" (processes: a crash in model code is isolated), "dask",
        "cuda" (NVIDIA cards), or "auto"
    shard : Shard, fly only these cases; `mc_engine.runner.runner.merge` joins the shards

    Returns the complete Store.  Its rows do not depend on workers, chunk and backend.  If the campaign takes inputs
    from another one that has yet to be flown, that one is flown first, into a directory next to `out`.

    Raises StoreError if `out` is occupied or a URL, and RunInterrupted on Ctrl-C or a full disk; completed chunks are
    kept, and `resume` flies the rest.  Raises ModelError if the model is at fault; if no case has completed, the run is
    removed, so that the same call flies the corrected model.  A simulator that no longer starts once a case has been
    flown, be it the nominal one, interrupts the run.

    >>> store = run(load_campaign("minimal", cases=8), "runs/example")
    >>> store.cases()["apogee_altitude_km"].median().round(1)
    np.float64(657.5)
    """
    if out is not None and is_url(out):
        raise StoreError(f"{out}: is a URL; fly into a folder, and give that and the URL to object_store.publish")
    refuse_no_campaign(campaign)
    if shard is not None and not isinstance(shard, Shard):
        raise EngineError(f'shard: {shard!r} is no Shard; Shard.parse("1/2") of mc_engine.runner.shards makes one')
    path = default_folder(campaign.name) if out is None else path_of(out, "out: {} is no path")
    session = session_of(progress, workers, chunk, backend)
    flyer_on(session.backend.name, campaign).refuse_faults()
    refuse_undeclared_data(campaign)
    campaign = _after_first(campaign, path, session)
    manifest = manifest_of(campaign)
    if shard is not None:
        manifest["shard"] = shard.record(campaign.cases)
    companions = companions_of(campaign)
    store = create_store(path, manifest, campaign.text, columns_of(campaign), companions)
    try:
        return complete(store, campaign, session)
    except ModelError:
        if not store.parts:  # `resume` would fly its copy of the faulty model
            _remove(path, companions)
        raise


def _remove(path: Path, companions: Iterable[str]) -> None:
    """Remove what a run has written in its directory, and the directory if nothing else is in it."""
    own = (CAMPAIGN, MANIFEST, NOMINAL, SIMULATOR, *PART_FOLDERS, *{Path(name).parts[0] for name in companions})
    with suppress(OSError, StoreError):
        for name in (JOURNAL, *own, *LOCK_FILES):  # the journal first: a directory without it is no run
            remove_folder(path, name)
    remove_if_empty(path)


def _after_first(campaign: Campaign, path: Path, session: Session) -> Campaign:
    """The campaign with its upstream run, which is first made or completed next to `path` if necessary."""
    if campaign.first is None:
        return campaign
    beside = path.with_name(f"{path.name}-{stem_of(campaign.first.name)}")
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
    """Complete a run that was interrupted.

    path : str or Path, the run directory
    progress : function of (cases done, cases wanted, cases failed), called after each chunk
    workers : int, threads or processes; all cores by default
    chunk : int, cases that a worker flies at a time
    backend : Backend, or its name, as for `run`
    repair : bool, also fly the cases of damaged parts again

    Returns the complete Store.

    Raises StoreError if the model or the engine's sampling has changed since the run began, and RunInterrupted as `run`
    does.

    >>> resume("runs/small").missing()
    []
    """
    if repair:
        mend_journal(path_of(path, "a run is repaired by its path, and {} is none"))
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
    """Add cases to a run; its present cases stay as they are.

    path : str or Path, the run directory
    cases : int, the new total number of cases
    progress : function of (cases done, cases wanted, cases failed), called after each chunk
    workers : int, threads or processes; all cores by default
    chunk : int, cases that a worker flies at a time
    backend : Backend, or its name, as for `run`

    Returns the complete Store.  Its cases equal those of a run with this number of cases from the start.

    Raises StoreError if the design cannot be extended or the run already has as many cases, CampaignError if the number
    does not fit the blocks of the design, and RunInterrupted as `run` does.

    >>> extend("runs/small", 12).n_cases
    12
    """
    cases = count_of("cases", cases)
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

    All other rows stay as they are.  A case that failed because of its physics fails again, with the same bits.
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
    """Join the run directories of all shards of a campaign in the new run directory `out`; returns its Store.

    StoreError if cases are missing, or if the shards are not of one campaign; see `mc_engine.runner.shards`.
    """
    store, campaign = merge_shards(Path(out), [Path(shard) for shard in shards], chunk, workers)
    return complete(store, campaign, session_of(progress, workers, chunk, THREADS))


def replay(path: str | Path, case_id: int) -> Replay:
    """Fly one case of a run again and compare every stored number bit for bit.

    The numbers of a simulator that is not deterministic are compared within its `tolerance`.

    path : str or Path, the run directory
    case_id : int, number of the case, from 0

    Returns a Replay, with the time history of the flight.

    Raises StoreError if there is no such case, or if the model or the engine's sampling has changed since.

    >>> replay("runs/small", 3).differences
    ()
    """
    store = open_store(path)
    campaign = campaign_of(store)
    table, flyer = case_table(campaign, np.array([case_id])), flyer_of(campaign)
    inputs, noise = inputs_of(campaign, case_id)
    flights = flyer.histories(inputs, np.array([noise]), HistoriesSection().rows)
    [(flight, history)] = in_threads(next, [flights])
    name_upstream(campaign, np.array([case_id]), flight)
    stored = store.row(case_id)
    again = {**table, **flight}
    # the reason of a crash has the words of the program, perhaps with a time, an address or the number of a process
    crashed = stored["status"] == flight["status"][0] == STATUS_NAME[CRASHED]
    differences = [
        f"case {case_id}, {name}: stored {stored[name]!r}, now {value!r}"
        for name, value in ((name, np.asarray(column).tolist()[0]) for name, column in again.items())
        if flyer.differs(stored[name], value) and not (name == "reason" and crashed)
    ]
    lost = flyer.lost_number(inputs, noise, flight, f"case {case_id}")
    frame = history_frame(case_id, history)
    return Replay(not differences, tuple(differences), frame, stored, lost, flyer.tolerance)
