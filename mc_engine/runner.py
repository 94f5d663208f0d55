"""Flying a campaign into a store: chunks of cases on all cores, resumable at any moment, replayable case by case.

A chunk is drawn, flown and given back by one thread; kernels hold no interpreter lock.  Only the calling thread
writes.  What a case comes to depends on (campaign, sources, seed, case_id): chunks and threads are bookkeeping.
"""

import os
import re
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from mc_engine.campaign import Campaign, load_campaign
from mc_engine.cases import case_table, full_inputs, nominal_row
from mc_engine.designs import EXTENSIBLE
from mc_engine.errors import RunInterrupted, StoreError
from mc_engine.flight import fly, fly_history
from mc_engine.interruption import stop_signal
from mc_engine.kernel import source_digest
from mc_engine.manifest import columns_of, manifest_of, sampling_digest
from mc_engine.model_faults import naming_faults
from mc_engine.run_folder import default_folder
from mc_engine.status import OK, STATUS_NAME
from mc_engine.store import Store, create_store, is_run_directory, open_store
from mc_engine.streams import SEED_CONTRACT
from mc_engine.upstream import COMPANION

ProgressCall = Callable[[int, int, int], None]
Chunk = tuple[int, int]
SMALLEST_CHUNK, LARGEST_CHUNK = 64, 32_768
CHUNKS_IN_FLIGHT = 3  # per worker: flying, or flown and not yet stored
CHUNKS_PER_WORKER = 8  # enough for an even end, few enough that parts stay large
NOMINAL_NOISE = 2**52  # the nominal draws its noise where no case does


@dataclass(frozen=True)
class Replay:
    """One case flown again.  `differences` names each stored number that came out with other bits."""

    equal: bool
    differences: tuple[str, ...]
    history: pd.DataFrame
    row: dict[str, Any]


def run(
    campaign: Campaign,
    out: Path | None = None,
    *,
    progress: ProgressCall | None = None,
    workers: int | None = None,
    chunk: int | None = None,
) -> Store:
    """Fly a campaign into the new directory `out` (default: runs/<campaign>-<time>).

    workers : threads, all cores by default.  chunk : cases a thread flies at a time.
    A campaign that takes inputs from one that has yet to be flown has it flown first, beside `out`.
    Raises RunInterrupted on Ctrl-C; the store then holds whole chunks, and `resume` completes it.
    """
    path = Path(out) if out is not None else default_folder(campaign.name)
    campaign = _after_first(campaign, path, progress, workers, chunk)
    store = create_store(path, manifest_of(campaign), campaign.text, columns_of(campaign), _companions(campaign))
    return _complete(store, campaign, progress, workers, chunk)


def _companions(campaign: Campaign) -> dict[str, bytes]:
    """Files that the campaign reads from its own folder, by their names there: a run directory stands alone."""
    files = {one.spec["file"] for one in campaign.dispersions if one.dist == "empirical"}
    paths = {campaign.directory / file for file in files}
    if campaign.table_path is not None:
        paths.add(campaign.table_path)
    if campaign.model_reference.endswith(".py"):
        paths.update((campaign.directory / campaign.model_reference).resolve().parent.glob("*.py"))
    base = campaign.directory.resolve()
    contents = {path.resolve().relative_to(base).as_posix(): path.read_bytes() for path in sorted(paths)}
    return contents if campaign.upstream is None else {**contents, COMPANION: campaign.upstream.rows.content}


def _after_first(
    campaign: Campaign, path: Path, progress: ProgressCall | None, workers: int | None, chunk: int | None
) -> Campaign:
    """The campaign with the run that it takes inputs from, flown or completed beside `path` where it is not there."""
    if campaign.first is None:
        return campaign
    name = re.sub(r"[^\w.-]+", "-", campaign.first.name)
    beside = path.with_name(f"{path.name}-{name}")
    if is_run_directory(beside):
        store = resume(beside, progress=progress, workers=workers, chunk=chunk)
        if store.manifest["campaign"]["digest"] != campaign.first.digest or store.n_cases != campaign.first.cases:
            raise StoreError(f"{beside}: holds another run than this campaign takes its inputs from")
    else:
        run(campaign.first, beside, progress=progress, workers=workers, chunk=chunk)
    return load_campaign(
        campaign.name,
        cases=campaign.cases,
        seed=campaign.seed,
        text=campaign.text,
        directory=campaign.directory,
        upstream=beside,
    )


def resume(
    path: str | Path, *, progress: ProgressCall | None = None, workers: int | None = None, chunk: int | None = None
) -> Store:
    """Complete the run in `path`; StoreError if the sources have changed since it began."""
    store = open_store(path)
    return _complete(store, campaign_of(store), progress, workers, chunk)


def extend(
    path: str | Path,
    cases: int,
    *,
    progress: ProgressCall | None = None,
    workers: int | None = None,
    chunk: int | None = None,
) -> Store:
    """Give the run in `path` as many cases in all; the cases are those of a longer campaign.

    StoreError if the design cannot grow ("mc", "sobol" and "halton" can) or has as many cases already.
    """
    store = open_store(path)
    design = store.manifest["campaign"]["design"]
    if design not in EXTENSIBLE:
        raise StoreError(f'{path}: the design "{design}" cannot be extended; {", ".join(EXTENSIBLE)} can')
    if store.manifest.get("upstream") is not None:
        raise StoreError(f"{path}: takes its inputs from another run; extend that one, and fly this campaign anew")
    if cases <= store.n_cases:
        raise StoreError(f"{path}: has {store.n_cases} cases; give the number it is to have in all")
    campaign_of(store)  # refuses changed sources before anything is written
    store.note("extended", cases=cases)
    return _complete(store, campaign_of(store), progress, workers, chunk)


def campaign_of(store: Store) -> Campaign:
    """The campaign as it was flown, at its present length; StoreError if model or campaign have changed since."""
    store.check_companions()
    recorded = store.manifest["campaign"]
    cases = store.n_cases if recorded["design"] in ("lhs", *EXTENSIBLE) else None
    campaign = load_campaign(
        recorded["name"],
        cases=cases,
        seed=recorded["seed"],
        text=store.campaign_text,
        directory=store.path,
        upstream=store.path / COMPANION if store.manifest.get("upstream") is not None else None,
    )
    if campaign.digest != recorded["digest"]:
        raise StoreError(f"{store.path}: a file of the campaign was edited; run the campaign anew")
    ours = source_digest(campaign.model, campaign.directory), sampling_digest(), SEED_CONTRACT
    model, contract = store.manifest["model"], store.manifest["seed_contract"]
    if ours != (model["digest"], model["sampling_digest"], contract):
        raise StoreError(f"{store.path}: was flown by other sources of engine or model; run the campaign anew")
    return campaign


def replay(path: str | Path, case_id: int) -> Replay:
    """Fly one case of a run alone, through the plain float64 build, and compare every stored number bit for bit."""
    store = open_store(path)
    campaign = campaign_of(store)
    inputs = case_table(campaign, np.array([case_id]))
    flight, history = fly_history(
        campaign.model,
        full_inputs(campaign, _scalars(inputs)),
        case_id,
        campaign.seed,
        folder=campaign.directory,
        width=1,
    )
    _name_upstream(campaign, np.array([case_id]), flight)
    stored = store.row(case_id)
    again = {**inputs, **flight}
    differences = [
        f"case {case_id}, {name}: stored {stored[name]!r}, now {value!r}"
        for name, value in ((name, column[0]) for name, column in again.items())
        if not _same_bits(stored[name], value)
    ]
    return Replay(not differences, tuple(differences), _history_frame(case_id, history), stored)


def _same_bits(stored: Any, value: Any) -> bool:
    if isinstance(value, float | np.floating):
        return np.float64(stored).tobytes() == np.float64(value).tobytes()
    return bool(stored == value)


def _scalars(table: dict[str, np.ndarray]) -> dict[str, Any]:
    return {name: column[0] for name, column in table.items()}


def _complete(
    store: Store, campaign: Campaign, progress: ProgressCall | None, workers: int | None, chunk: int | None
) -> Store:
    """Fly what is missing, then the nominal and the histories."""
    workers = workers or os.cpu_count() or 1
    with store.lock(), stop_signal() as stop:
        missing = store.missing()
        wanted = sum(last - first for first, last in missing)
        size = chunk or chunk_size(wanted, workers)
        store.note("started", workers=workers, chunk=size, missing=wanted)
        begin = time.perf_counter()
        store.write_nominal(_nominal(campaign))  # also compiles the kernel
        compiled = time.perf_counter()
        total = store.n_cases
        done = total - wanted
        failed = sum(count for word, count in store.status_counts().items() if word != STATUS_NAME[OK])
        if progress is not None:
            progress(done, total, failed)
        for first, columns in _flights(campaign, list(_chunks(missing, size)), workers, stop.is_set):
            count = len(columns["status"])
            store.append(first, count, columns)
            done += count
            failed += int(np.count_nonzero(columns["status"] != STATUS_NAME[OK]))
            if progress is not None:
                progress(done, total, failed)
        if store.missing():
            store.note("interrupted", cases=done)
            raise RunInterrupted(
                f"interrupted with {done:,} of {total:,} cases; `mc-engine resume {store.path}` flies the rest"
            )
        flown = time.perf_counter()
        _write_histories(store, campaign, workers)
        store.note("finished", prepare_s=round(compiled - begin, 3), fly_s=round(flown - compiled, 3))
    return store


def chunk_size(cases: int, workers: int) -> int:
    """How many cases a thread flies at a time, and a part holds, unless said."""
    return min(max(-(-cases // (CHUNKS_PER_WORKER * workers)), SMALLEST_CHUNK), LARGEST_CHUNK)


def _chunks(missing: list[Chunk], size: int) -> Iterator[Chunk]:
    for first, stop in missing:
        for begin in range(first, stop, size):
            yield begin, min(begin + size, stop)


def _flights(
    campaign: Campaign, chunks: list[Chunk], workers: int, stopped: Callable[[], bool]
) -> Iterator[tuple[int, dict[str, np.ndarray]]]:
    """(first case, columns) of every chunk as it lands, in any order; chunks not begun when stopped stay out.

    At most a few chunks a worker wait to be taken: where storing is slower than flying, memory does not fill up, and
    a stop has little left to bring in.
    """
    from joblib import Parallel, delayed

    room, left = threading.Semaphore(CHUNKS_IN_FLIGHT * workers), threading.Event()

    def task(first: int, stop: int) -> tuple[int, dict[str, np.ndarray]] | None:
        while not room.acquire(timeout=0.1):
            if stopped() or left.is_set():
                return None
        return None if stopped() or left.is_set() else (first, fly_chunk(campaign, first, stop))

    if workers == 1 or len(chunks) <= 1:
        landed: Any = (task(*chunk) for chunk in chunks)
    else:
        pool = Parallel(n_jobs=workers, backend="threading", return_as="generator_unordered")
        landed = pool(delayed(task)(*chunk) for chunk in chunks)
    try:
        for result in landed:
            if result is not None:
                yield result
            room.release()
    finally:
        left.set()  # whoever waits for room waits in vain


def fly_chunk(campaign: Campaign, first: int, stop: int) -> dict[str, np.ndarray]:
    """All columns but case_id of the cases first to stop - 1."""
    ids = np.arange(first, stop, dtype=np.int64)
    table = case_table(campaign, ids)
    with naming_faults(campaign.model_reference, f"cases {first} to {stop - 1}"):
        flight = fly(campaign.model, full_inputs(campaign, table), ids, campaign.seed, folder=campaign.directory)
    _name_upstream(campaign, ids, flight)
    return {**table, **flight}


def _name_upstream(campaign: Campaign, ids: np.ndarray, flight: dict[str, np.ndarray]) -> None:
    """Say of cases that have nothing to start from what became of theirs upstream."""
    if campaign.upstream is not None:
        reasons = campaign.upstream.refusals(ids)
        flight["reason"] = np.where(reasons != "", reasons, flight["reason"])


def _nominal(campaign: Campaign) -> dict[str, Any]:
    inputs = nominal_row(campaign)
    ids = np.array([NOMINAL_NOISE])
    with naming_faults(campaign.model_reference, "the nominal case"):
        flight = fly(campaign.model, inputs, ids, campaign.seed, folder=campaign.directory)
    dispersed = {one.name: inputs[one.name] for one in campaign.dispersions}
    if campaign.upstream is not None:
        dispersed |= campaign.upstream.nominal_row()
    return {**dispersed, **_scalars(flight)}


def _write_histories(store: Store, campaign: Campaign, workers: int) -> None:
    """Fly the retained cases again, each alone and several at once, for their histories."""
    from joblib import Parallel, delayed

    flights = [(-1, nominal_row(campaign), NOMINAL_NOISE)] if campaign.retention.nominal else []
    for case_id in retained_cases(store, campaign):
        inputs = _scalars(case_table(campaign, np.array([case_id])))
        flights.append((case_id, full_inputs(campaign, inputs), case_id))
    pool = Parallel(n_jobs=min(workers, max(len(flights), 1)), backend="threading")
    frames = [frame for frame in pool(delayed(_history)(campaign, *flight) for flight in flights) if len(frame)]
    if frames:
        store.write_histories(pd.concat(frames, ignore_index=True))


def retained_cases(store: Store, campaign: Campaign) -> list[int]:
    """Cases that keep their history: the first, the named, and the worst of those flown to their end; each once."""
    wanted = campaign.retention
    chosen = [*range(min(wanted.first, store.n_cases)), *(case for case in wanted.cases if case < store.n_cases)]
    for worst in wanted.worst:
        table = store.cases(["case_id", "status", worst.metric])
        values = table.loc[table["status"] == STATUS_NAME[OK]].set_index("case_id")[worst.metric].dropna()
        # a stable sort: equal values go by their case, whatever the order of the chunks
        ranked = values.sort_index().sort_values(ascending=worst.side == "smallest", kind="stable")
        chosen += [int(case) for case in ranked.index[: worst.n_cases]]
    return list(dict.fromkeys(chosen))


def _history(campaign: Campaign, case_id: int, inputs: dict[str, Any], noise: int) -> pd.DataFrame:
    rows = campaign.retention.rows
    _, history = fly_history(campaign.model, inputs, noise, campaign.seed, folder=campaign.directory, rows=rows)
    return _history_frame(case_id, history)


def _history_frame(case_id: int, history: dict[str, np.ndarray]) -> pd.DataFrame:
    frame = pd.DataFrame(history)
    frame.insert(0, "case_id", np.full(len(frame), case_id, dtype=np.int64))
    return frame
